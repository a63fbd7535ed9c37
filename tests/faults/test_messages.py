"""Messages lost, late, repeated, out of order, damaged: F01 to F04, F11 to F14, F16."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from common.roles import MASTER, SLAVE
from tests.faults.rows import passed
from tests.faults.simulated import AT, LOST, Course, Scene, longest_silence, same_commands
from validation.faults.wire import Conditions


def table_motion(course: Course, first: int, count: int) -> float:
    """The table's motion over ticks whose commands are lost, m; it keeps the last command."""
    return course.motion(SLAVE, first - 1, count)


def test_f01_one_sample_lost(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    scene.impair(AT, 1, LOST, SLAVE)
    course = scene.play()
    course.calm()
    account, back = course.account(SLAVE), course.account(MASTER)
    assert (account.lost, account.rejected, back.lost) == (1, 0, 0)
    assert scene.route(SLAVE).ledger.numbers["lost"] == [AT]
    motion = table_motion(course, AT, 1)
    assert motion <= course.plan.limits.table_velocity * course.plan.test.interval
    passed(
        "F01",
        "one command lost",
        "simulation: the wire drops one command",
        "RUNNING",
        None,
        motion,
        f"commands: {account}; no hold before {course.plan.safety.hold_after} intervals",
    )


def test_f02_three_samples_lost(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    scene.impair(AT, 3, LOST, SLAVE)
    course = scene.play()
    course.calm(holding=True)
    assert course.modes(SLAVE) == ["running", "holding", "running", "ramping", "idle"]
    assert course.modes(MASTER) == ["running", "ramping", "idle"]  # it hears the slave, whose echo is late
    account = course.account(SLAVE)
    assert (account.lost, account.rejected) == (3, 0)
    motion = table_motion(course, AT, 3)
    watched = 3 * course.plan.test.interval
    assert motion <= course.plan.limits.table_velocity * watched
    since = scene.time(AT - 1)
    holding = course.seconds_to(SLAVE, "holding", since)
    assert course.seconds_to(SLAVE, "running", since) - holding <= 2 * course.plan.test.interval
    passed(
        "F02",
        "three commands lost in a row",
        "simulation: the wire drops three commands",
        "slave HOLDING, then RUNNING again; master RUNNING",
        holding,
        motion,
        f"events mode running → holding → running; commands: {account}",
    )


def test_f03_five_samples_lost(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    scene.impair(AT, 100, LOST, SLAVE)
    course = scene.play()
    stop = course.stopped(AT, codes={"watchdog", "remote_trip"})
    assert course.code(SLAVE) == "watchdog"
    assert course.modes(SLAVE) == ["running", "holding", "ramping", "safe"]
    account = course.account(SLAVE)
    assert account.lost >= 5
    passed(
        "F03",
        "five commands lost and more",
        "simulation: the wire drops a hundred commands",
        "RAMPING, then SAFE, both laboratories",
        stop.seconds,
        stop.motion,
        f"event watchdog in the slave, {course.code(MASTER)} in the master; "
        f"at rest after {stop.rest * 1e3:.0f} ms; "
        f"commands: {account}",
    )


@pytest.mark.slow
def test_f04_five_percent_lost_for_a_minute(tmp_path: Path) -> None:
    scene = Scene(tmp_path, 60.0)
    scene.impair(0, scene.plan.ticks, Conditions(loss=0.05))
    course = scene.play()
    for role in (MASTER, SLAVE):
        assert longest_silence(course, role) < course.plan.safety.ramp_after
    course.calm(holding=True)
    accounts = [course.account(role) for role in (SLAVE, MASTER)]
    shares = [account.lost / account.sent for account in accounts]
    assert all(abs(share - 0.05) < 0.01 for share in shares)
    holds = sum(course.count(role, "holding") for role in (MASTER, SLAVE))
    times, commands = course.commands(SLAVE)
    largest = float(np.max(np.abs(np.diff(commands))))
    assert times.size >= course.plan.ticks
    passed(
        "F04",
        "5 % of all messages lost, each by itself, 60 s",
        "simulation: loss of the wire in both directions",
        "RUNNING",
        None,
        largest,
        f"{holds} holds, no trip; commands: {accounts[0]}; feedbacks: {accounts[1]}; "
        "motion: largest step of the table",
    )


def test_f11_jitter(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    scene.impair(AT, 10_000, Conditions(minimum=0.002, mean=0.002))
    course = scene.play()
    stop = course.stopped(codes={"watchdog", "remote_trip"})
    holds = sum(course.count(role, "holding") for role in (MASTER, SLAVE))
    assert holds > 0
    lasted = course.simulation.loops[SLAVE].ticks - AT
    delays = np.diff(np.sort([time for time, *_ in scene.route(SLAVE).ledger.arrivals]))
    gap = float(np.max(delays)) * 1e-9
    passed(
        "F11",
        "delay of 2 ms and an exponential of mean 2 ms on top",
        "simulation: delay of the wire in both directions",
        "RUNNING and HOLDING, then RAMPING and SAFE where five intervals were silent",
        stop.seconds,
        stop.motion,
        f"{holds} holds in {lasted} intervals, longest gap between commands {gap * 1e3:.1f} ms; commands: "
        f"{course.account(SLAVE)}; feedbacks: {course.account(MASTER)}",
    )


def test_f12_a_step_of_the_delay(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    scene.impair(AT, 10_000, Conditions(minimum=0.010))
    course = scene.play()
    stop = course.stopped(AT, codes={"watchdog", "remote_trip"})
    account = course.account(SLAVE)

    scene = Scene(tmp_path)
    scene.impair(AT, 10_000, Conditions(minimum=0.003))
    smaller = scene.play()
    smaller.calm(holding=True)
    latency = smaller.run.columns["latency"]["command_one_way"]
    before, after = (
        float(np.nanmedian(latency[part])) for part in (slice(AT - 100, AT), slice(AT + 50, None))
    )
    assert 0.0029 < after - before < 0.0031
    passed(
        "F12",
        "delay longer by 10 ms at once",
        "simulation: delay of the wire in both directions",
        "RAMPING, then SAFE, both laboratories; with 3 ms RUNNING",
        stop.seconds,
        stop.motion,
        f"the step is a silence of five intervals: event watchdog; commands: {account}; the step of 3 ms is in the "
        f"latency from tick {AT} on ({before * 1e3:.2f} → {after * 1e3:.2f} ms)",
    )


def test_f13_duplicates(tmp_path: Path, undisturbed: Course) -> None:
    scene = Scene(tmp_path)
    scene.impair(0, scene.plan.ticks, Conditions(duplicate=0.2))
    course = scene.play()
    course.calm()
    accounts = {role: course.account(role) for role in (SLAVE, MASTER)}
    for role, account in accounts.items():
        twice = scene.route(role).ledger.counts["Command" if role == SLAVE else "Feedback"]["duplicated"]
        assert twice > 0.15 * account.sent
        assert account.turned_away.keys() == {"repeated"}
        assert 0 <= twice - account.turned_away["repeated"] <= 1  # the last one comes after the account
    assert same_commands(course, undisturbed)
    passed(
        "F13",
        "20 % of all messages twice",
        "simulation: the wire delivers them twice",
        "RUNNING",
        None,
        0.0,
        f"every command to the last bit that of the undisturbed test; commands: {accounts[SLAVE]}; feedbacks: "
        f"{accounts[MASTER]}",
    )


def test_f14_out_of_order(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    scene.impair(AT, 1, Conditions(reorder=1.0, hold=0.003), SLAVE)
    course = scene.play()
    course.calm()
    account = course.account(SLAVE)
    assert (account.lost, account.rejected, account.turned_away) == (0, 1, {"old": 1})
    motion = course.motion(SLAVE, AT - 1, 1)
    assert motion <= course.plan.limits.table_velocity * course.plan.test.interval
    passed(
        "F14",
        "a command comes after its successor",
        "simulation: the wire holds one command back for 3 ms",
        "RUNNING",
        None,
        motion,
        f"commands: {account}",
    )


def test_f16_flipped_bits(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    scene.impair(0, scene.plan.ticks, Conditions(corrupt=0.01))
    course = scene.play()
    course.calm(holding=True)
    for role in (SLAVE, MASTER):
        account = course.account(role)
        kind = "Command" if role == SLAVE else "Feedback"
        damaged = scene.route(role).ledger.counts[kind]["damaged"]
        assert damaged >= 5
        assert account.damaged == damaged
        assert course.rejected(role) == {"check": damaged}
    passed(
        "F16",
        "a bit flipped in 1 % of all messages",
        "simulation: the wire flips a bit in both directions",
        "RUNNING; a damaged message counts as a missing one, several in a second too (ADR 0023)",
        None,
        course.motion(SLAVE, scene.route(SLAVE).ledger.numbers["corrupted"][0] - 1, 1),
        f"event rejected, by check: {course.rejected(SLAVE)['check']} in the slave, "
        f"{course.rejected(MASTER)['check']} in the master; commands: {course.account(SLAVE)}",
    )
