"""Frames of others, or of another session, number or time: F25 to F33, F53."""

from __future__ import annotations

import math
import zlib
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.link.transport import CONTROL, TICK
from common.plan.tables import Test
from common.protocol import codec
from common.protocol.messages import Command, Feedback, Message
from common.roles import MASTER, SLAVE
from simulation.world import Drift
from tests.common.test_hostile import CONTENTS
from tests.faults.rows import passed
from tests.faults.simulated import AT, Course, Scene, same_commands, signed
from validation.faults import hostile, lab
from validation.faults.lab import SESSION, Surrounding
from validation.faults.wire import INSIDER, Letter


def changed_at(tick: int, **fields: float) -> Callable[[Any], Message | None]:
    """Changes the message of one tick."""
    return lambda message: message._replace(**fields) if message.seq == tick else None


def test_f25_replay_of_an_old_session(
    tmp_path: Path, undisturbed: Course, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(lab, "SESSION", SESSION + 8)
        before = Scene(tmp_path)
        before.play()
    scene = Scene(tmp_path)
    count = 0
    for role in (SLAVE, MASTER):
        for channel in (TICK, CONTROL):
            old = [
                one._replace(origin="injected", number=-1, intact=False)
                for one in before.route(role, channel).history
                if one.kind not in ("Register", "Waiting", "Arm")  # these are for all
            ]
            scene.put(AT, role, old, channel)
            count += len(old)
    course = scene.play()
    course.calm()
    assert same_commands(course, undisturbed)
    rejected = {role: course.rejected(role) for role in (SLAVE, MASTER)}
    assert sum(sum(counts.values()) for counts in rejected.values()) == count
    assert {reason for counts in rejected.values() for reason in counts} == {"check"}
    passed(
        "F25",
        "all frames of an earlier session again",
        "simulation: frames of a test played before are put onto all routes",
        "RUNNING",
        None,
        0.0,
        f"{count} frames, all rejected by check (the key is of the session); "
        "every command to the last bit that of the undisturbed test",
    )


def test_f26_replay_within_the_session(tmp_path: Path, undisturbed: Course) -> None:
    scene = Scene(tmp_path)
    for role in (SLAVE, MASTER):
        for channel in (TICK, CONTROL):
            scene.at(AT, scene.route(role, channel).again, 400)
    course = scene.play()
    course.calm()
    assert same_commands(course, undisturbed)
    accounts = [course.account(role) for role in (SLAVE, MASTER)]
    assert [account.turned_away for account in accounts] == [{"repeated": 400}] * 2
    passed(
        "F26",
        "frames of the same session again",
        "simulation: the first 400 frames of every route are put onto it again, those of the handshake too",
        "RUNNING",
        None,
        0.0,
        f"every command to the last bit that of the undisturbed test; commands: {accounts[0]}",
    )


@pytest.mark.slow
def test_f27_a_jump_of_the_sequence_numbers(tmp_path: Path) -> None:
    scene = Scene(tmp_path, 6.0)
    key = codec.session_key(SESSION, scene.plan.digest())
    ahead = [hostile.letter(hostile.command(SESSION, AT + 1000 + k, 0.01), key, INSIDER) for k in range(50)]
    scene.put(AT, SLAVE, ahead)
    one = scene.play()
    one.calm()
    turned = one.event(SLAVE, "exchange")["values"]["commands.turned_away.ahead"]
    assert turned == 50

    scene = Scene(tmp_path, 6.0)
    scene.simulation.strangers.add(SLAVE)
    scene.change(
        SLAVE, lambda message: message._replace(seq=message.seq + 1000) if message.seq >= AT else None
    )
    course = scene.play()
    stop = course.stopped(AT, codes={"watchdog", "remote_trip"})
    largest = Test.__dataclass_fields__["duration"].metadata["rule"].most / 1e-4
    assert largest < 2**32 < codec.MOST
    far = hostile.command(SESSION, 2**32 + 5, 0.0)
    assert codec.decode(codec.encode(far, key), key) == far
    passed(
        "F27",
        "numbers ahead by 1000; beyond 2^32",
        "simulation: an insider's 50 commands; a relay raises the numbers of all commands",
        "RUNNING with the insider's; RAMPING, then SAFE where all are ahead",
        stop.seconds,
        stop.motion,
        f"{turned:.0f} turned away as ahead; numbers do not wrap: the longest plan has {largest:.2g} ticks",
    )


@pytest.mark.slow
def test_f28_time_stamps_in_the_future_and_clock_offsets(tmp_path: Path, undisturbed: Course) -> None:
    second = 10**9
    for step in (second, -second):
        surrounding = Surrounding(seed=1, drifts={SLAVE: Drift(offset=5 * second + step)})
        course = Scene(tmp_path, surrounding=surrounding).play()
        course.calm()
        assert same_commands(course, undisturbed)
    scene = Scene(tmp_path)
    scene.change(
        SLAVE,
        lambda message: message._replace(sent_ns=message.sent_ns + second) if message.seq >= AT else None,
    )
    course = scene.play()
    course.calm()
    assert same_commands(course, undisturbed)

    future = int(np.nanmax(np.abs(course.run.columns["latency"]["command_one_way"])) * 1e6)

    scene = Scene(tmp_path)
    scene.change(
        MASTER,
        lambda message: message._replace(sent_ns=message.sent_ns + second) if message.seq >= AT else None,
    )
    course = scene.play()
    course.calm()
    assert same_commands(course, undisturbed)
    found = course.run.columns["latency"]
    assert abs(found["clock_offset"][-1]) < 1e-6
    bounds = (undisturbed.run.columns["latency"]["clock_offset_bound"][-1], found["clock_offset_bound"][-1])
    assert bounds[1] > bounds[0] + 50e-6
    one_way = float(np.nanmax(found["feedback_one_way"][AT:]))
    assert one_way < -0.9
    passed(
        "F28",
        "stamps 1 s in the future, clocks 4 and 6 s apart",
        "simulation: a relay changes sent_ns of commands, then of feedbacks; the slave's clock has an offset",
        "RUNNING",
        None,
        0.0,
        f"every command to the last bit that of the undisturbed test; "
        f"feedback_one_way is {one_way:.1f} s, which is no delay, "
        f"and clock_offset_bound is {bounds[1] * 1e6:.0f} µs in place of {bounds[0] * 1e6:.0f} µs; "
        f"with the commands' stamps nothing changes, command_one_way stays below {future} µs",
    )


@pytest.mark.slow
def test_f29_clocks_that_drift_apart(tmp_path: Path) -> None:
    drifts = {SLAVE: Drift(offset=10**9, ppb=200_000)}
    course = Scene(tmp_path, 20.0, surrounding=Surrounding(seed=1, drifts=drifts)).play()
    course.calm()
    found = course.run.columns["latency"]
    t = found["tick_ns"] * 1e-9
    slope = float(np.polyfit(t[5000:], found["clock_offset"][5000:], 1)[0])
    assert abs(slope - 200e-6) < 5e-6
    account = course.account(SLAVE)
    assert account.rejected == 0
    passed(
        "F29",
        "the slave's clock gains 200 ppm on the master's",
        "simulation: its clock drifts for 20 s, 4 ms in all",
        "RUNNING",
        None,
        0.0,
        f"slope of clock_offset {slope * 1e6:.1f} ppm, no hold; commands: {account}",
    )


def test_f30_values_that_are_not_finite(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    odd = {AT - 200: math.nan, AT - 150: math.inf, AT - 100: -math.inf}
    tiny = {AT - 50: -0.0, AT - 49: 5e-324}

    def changed(message: Command) -> Command | None:
        if message.seq in odd:
            return message._replace(target=odd[message.seq])
        if message.seq in tiny:
            return message._replace(jerk=tiny[message.seq])
        return message._replace(effort=math.nan) if message.seq >= AT else None

    scene.change(SLAVE, changed)
    course = scene.play()
    stop = course.stopped(AT, codes={"watchdog", "remote_trip"})
    assert course.modes(SLAVE) == ["running", "holding", "ramping", "safe"]
    rejected = course.rejected(SLAVE)
    account = course.account(SLAVE)
    assert rejected == {"value": scene.route(SLAVE).ledger.counts["Command"]["damaged"]}
    assert {AT - 50, AT - 49} <= {number for _, number in course.simulation.ports[SLAVE].answers}
    during = course.motion(SLAVE, AT - 1, course.plan.safety.ramp_after)
    watched = course.plan.safety.ramp_after * course.plan.test.interval
    assert during <= course.plan.limits.table_velocity * watched
    passed(
        "F30",
        "NaN, ±inf, −0.0 and a denormal in commands",
        "simulation: a relay changes a field under the right check, single ones and then all",
        "RUNNING with single ones, which count as missing; RAMPING, then SAFE with all",
        stop.seconds,
        stop.motion,
        f"event rejected, by value: {rejected['value']}; −0.0 and 5e-324 are used; commands: {account}",
    )


@pytest.mark.parametrize(
    ("fault", "fields", "title"),
    [
        ("F31", {"target": 0.41}, "a table target beyond its limit"),
        ("F32", {}, "a table target 10 mm off for one sample"),
    ],
)
def test_f31_f32_a_command_beyond_a_limit(
    tmp_path: Path, undisturbed: Course, fault: str, fields: dict[str, float], title: str
) -> None:
    target = undisturbed.run.columns["slave"]["table_target"]
    step = 0.010 * float(np.sign(target[AT] - target[AT - 1]))
    wrong = fields or {"target": float(target[AT]) + step}
    scene = Scene(tmp_path)
    scene.change(SLAVE, changed_at(AT, **wrong))
    course = scene.play()
    stop = course.stopped(AT, within=2, codes={"limit", "remote_trip"})
    assert course.code(SLAVE) == "limit"
    text = course.event(SLAVE, "limit")["text"]
    limits, step = course.plan.limits, course.plan.test.interval
    assert course.motion(SLAVE, AT - 1, 1) <= limits.table_velocity * step
    passed(
        fault,
        title,
        "simulation: a relay changes one command under the right check",
        "RAMPING at once, then SAFE, both laboratories",
        stop.seconds,
        stop.motion,
        f"event limit in the slave: “{text}” Nothing of that command reaches the rig, it is not clamped",
    )


def test_f33_hostile_contents(tmp_path: Path, undisturbed: Course) -> None:
    key = codec.session_key(SESSION, undisturbed.plan.digest())
    scene = Scene(tmp_path)
    expected: Counter[str] = Counter()
    letters = []
    for payload, reason in CONTENTS.values():
        expected[reason] += 1
        letters.append(Letter(signed(payload, key), "hostile", -1, 0, "injected", intact=False))
    letters.append(Letter(b"", "hostile", -1, 0, "injected", intact=False))
    letters.append(Letter(bytes(1_000_000), "hostile", -1, 0, "injected", intact=False))
    expected["length"] += 2
    for role in (SLAVE, MASTER):
        for repeat in range(5):
            scene.put(200 + 20 * repeat, role, letters)
    course = scene.play()
    course.calm()
    assert same_commands(course, undisturbed)
    assert course.rejected(SLAVE) == {reason: 5 * count for reason, count in expected.items()}
    assert sum(course.rejected(MASTER).values()) == 5 * len(letters)
    recorded = course.event(SLAVE, "rejected")["values"]
    assert recorded == course.rejected(SLAVE)
    told = ", ".join(f"{count:.0f} {reason}" for reason, count in sorted(recorded.items()))
    passed(
        "F33",
        f"{len(letters)} hostile contents: malformed, nested, oversize, empty",
        "simulation: each five times onto both routes of the ticks, under the right check",
        "RUNNING",
        None,
        0.0,
        f"event rejected in the slave: {told}; every command to the last bit that of the undisturbed test",
    )


def test_f53_correct_contents_with_a_wrong_checksum(tmp_path: Path, undisturbed: Course) -> None:
    plan = undisturbed.plan
    keys = [codec.session_key(SESSION, plan.digest()[::-1] + "x"), codec.session_key(0, "")]
    forged: dict[str, list[Letter]] = {SLAVE: [], MASTER: []}
    for seq in range(AT, AT + 50):
        there = hostile.command(SESSION, seq, 0.05)
        back: Feedback = hostile.feedback(SESSION, seq, 0.0, 0.0, 0.0, 500.0)
        for role, message in ((SLAVE, there), (MASTER, back)):
            forged[role] += [hostile.letter(message, key, "injected") for key in keys]
            payload = codec.encode(message, keys[0])[: -codec.CHECK_SIZE]
            check = zlib.crc32(payload).to_bytes(codec.CHECK_SIZE, "big")
            forged[role].append(Letter(payload + check, "forged", -1, 0, "injected", intact=False))
    scene = Scene(tmp_path)
    for role, letters in forged.items():
        scene.put(AT, role, letters)
    course = scene.play()
    course.calm()
    assert same_commands(course, undisturbed)
    for role, letters in forged.items():
        assert course.rejected(role) == {"check": len(letters)}
    passed(
        "F53",
        "right session, number and content, wrong check",
        "simulation: 150 forged frames each way: another plan's key, the key that all share, a CRC-32",
        "RUNNING",
        None,
        0.0,
        f"event rejected, by check: {len(forged[SLAVE])} in each laboratory; "
        "every command to the last bit that of the undisturbed test",
    )
