"""Fault rows F19, F22, F54 and F55: a new master, emergency stops, and what a reset needs."""

from __future__ import annotations

import secrets
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from common.lab.operation import EMERGENCY, RESET
from common.lab.process import join
from common.link.endpoint import FrameEndpoint
from common.protocol.messages import Answer, Operator
from common.roles import OPERATOR
from common.terminal.cli import text_report
from tests.faults.rows import motion_bound, passed
from tests.system.faults.bench import INTERVAL, LABS, PAUSE, WATCHDOG, Bench, DisturbedError, undisturbed
from tests.system.faults.reactions import evidence, first_error, judge, modes_of, worst
from tests.system.faults.rigs import Wish

pytestmark = pytest.mark.faults

ANSWER_S = 3.0


class Hand:
    """An operator's hand on the buttons: a press can be held."""

    def __init__(self, endpoint: FrameEndpoint, digest: str) -> None:
        self._endpoint = endpoint
        self._digest = digest

    def press(self, word: str, number: int = 0) -> dict[str, Answer]:
        """Press a button, or hold it on under the number of a press; what the laboratories answer."""
        wish = Operator(0, self._digest, word, number or secrets.randbelow(2**62) + 1, "the fault matrix")
        answers: dict[str, Answer] = {}
        deadline = time.monotonic() + ANSWER_S
        while set(answers) != set(LABS) and time.monotonic() < deadline:
            self._endpoint.send(wish)
            while (received := self._endpoint.receive(0.05)) is not None:
                message = received.message
                if isinstance(message, Answer) and message.press == wish.press:
                    answers[received.role] = message
        return answers


@contextmanager
def hand(bench: Bench) -> Iterator[Hand]:
    """An operator at the place of the master."""
    plan = bench.plan
    link = join(plan, OPERATOR, str, text_report, connect=bench.place.listen)
    try:
        yield Hand(FrameEndpoint(link, plan.digest()), plan.digest())
    finally:
        link.close()


def test_f19_f22_a_killed_master_and_the_next_one(tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder).start_all() as bench:
            killed = bench.master.signal(signal.SIGKILL)
            bench.rest("slave")
            seconds, motion = by_log(bench, killed)
            passed(
                "F19",
                "master killed",
                "kill -9 of its process",
                "slave safe",
                seconds,
                motion,
                f"slave: {bench.slave.events('safe')[0]['text']}",
            )
            bench.recorder.kill()
            before = bench.logs["slave"].written().ns.size
            bench.master = bench.start("master")
            bench.master.wait(lambda data: data.get("code") == "latched", 10.0)
            text = bench.master.events("latched")[0]["text"]
            assert "slave refuses the test: it is latched in its safe state" in text
            time.sleep(0.2)
            assert bench.master.alive()
            assert bench.logs["slave"].written().ns.size == before
            with hand(bench) as operator:
                answers = operator.press(RESET)
            assert answers["slave"].accepted, answers
            assert bench.slave.finish() == 4
            bench.slave, bench.recorder = bench.start("slave"), bench.start("recorder")
            bench.until(0.4)
            bench.slave.signal(signal.SIGTERM)
            bench.rest(*LABS)
            run = bench.finish()
            assert run.ticks("slave") > 0.2 / INTERVAL - 1
            passed(
                "F22",
                "master starts again, slave latched",
                "new process, new session",
                "refused until the slave's reset, then runs",
                None,
                0.0,
                text,
            )

    undisturbed(scenario, tmp_path)


def by_log(bench: Bench, killed: float) -> tuple[float, float]:
    """From a master's end to the first command of the slave's ramp, and how far it went, by its rig's own log."""
    cause = bench.slave.causes[0]
    if cause["code"] == "overrun":
        raise DisturbedError(cause["text"])
    assert cause["code"] == "watchdog"
    ramp = round(cause["t"] / INTERVAL)
    written = bench.logs["slave"].written()
    if np.diff(written.ns[ramp - 8 : ramp + 1]).max() > (PAUSE + INTERVAL) * 1e9:
        raise DisturbedError("the slave paused")
    last = ramp - bench.plan.safety.ramp_after
    seconds = float(written.ns[ramp]) * 1e-9 - killed
    motion = float(np.max(np.abs(written.displacement[last:] - written.displacement[last])))
    assert seconds <= WATCHDOG + 2 * INTERVAL
    assert motion <= motion_bound(bench.plan, "slave")
    return seconds, motion


@pytest.mark.parametrize("lab", LABS)
def test_f54_an_emergency_stop_at_one_laboratory_stops_both(lab: str, tmp_path: Path) -> None:
    other = next(name for name in LABS if name != lab)

    def scenario(folder: Path) -> None:
        with Bench(folder).start_all() as bench:
            bench.want(lab, Wish.EMERGENCY)
            bench.lab(lab).mode("emergency_stop", 5.0)
            bench.rest(other)
            run = bench.finish()
            cause, far = first_error(run.events, lab), first_error(run.events, other)
            if "overrun" in (cause["code"], far["code"]):
                raise DisturbedError(far["text"])
            assert "red button" in cause["text"]
            assert modes_of(run, lab)[-1].endswith("→ emergency_stop (emergency)")
            assert lab not in run.ramps or not run.ramps[lab]["seq"].size
            found = {other: judge(run, bench, other, ["remote_trip"])}
            assert far["t"] - cause["t"] <= WATCHDOG
            assert "red button" in far["text"]
            if lab == "slave":
                state = "emergency stop where it was pressed, the other safe"
                passed(
                    "F54",
                    "emergency stop",
                    "rig raises, in either laboratory; rths stop --emergency",
                    state,
                    far["t"] - cause["t"],
                    worst(found)[1],
                    evidence(found),
                )

    undisturbed(scenario, tmp_path)


def test_f55_a_reset_needs_the_cause_to_be_gone_and_a_new_press(tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder).start_all() as bench:
            bench.want("slave", Wish.READ_FAR)
            bench.rest(*LABS)
            with hand(bench) as operator:
                first = operator.press(RESET, 1)
                assert first["master"].accepted
                assert not first["slave"].accepted
                assert "table_displacement is 1, beyond its limit" in first["slave"].text
                bench.want("slave", Wish.SERVE)
                time.sleep(1.0)
                held = operator.press(RESET, 1)
                assert held == first
                assert bench.slave.modes[-1] == "ramping → safe (secured)"
                again = operator.press(RESET, 2)
                assert again["slave"].accepted, again
            run = bench.finish()
            found = {
                "slave": judge(run, bench, "slave", ["limit"]),
                "master": judge(run, bench, "master", ["remote_trip"]),
            }
            assert found["slave"].modes[-1] == "safe → idle (reset)"
            passed(
                "F55",
                "reset held, or while the fault is present",
                "operator's messages; rig reads 1 m",
                "safe until a new press after the cause is gone",
                *worst(found),
                first["slave"].text,
            )

    undisturbed(scenario, tmp_path)


def test_f54_the_operators_emergency_stop(tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        with Bench(folder).start_all() as bench:
            with hand(bench) as operator:
                before = time.monotonic()
                answers = operator.press(EMERGENCY)
            assert all(answer.accepted for answer in answers.values()), answers
            for lab in LABS:
                assert bench.lab(lab).mode("emergency_stop", 1.0) - before < 0.2
            written = [bench.logs[lab].written() for lab in LABS]
            time.sleep(0.2)
            assert [one.ns.size for one in written] == [bench.logs[lab].written().ns.size for lab in LABS]
            run = bench.finish()
            for lab in LABS:
                cause = first_error(run.events, lab)
                assert cause["code"] in ("emergency", "remote_trip"), cause
                assert modes_of(run, lab)[-1].endswith("emergency_stop (emergency)")

    undisturbed(scenario, tmp_path)
