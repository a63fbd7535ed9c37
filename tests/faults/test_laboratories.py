"""Sensors, actuators, loops and processors that fail: F37 to F40, F42, F43."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan.plan import Plan
from common.reality.reality import Reality, as_planned
from common.roles import MASTER, SLAVE
from rths.__main__ import main
from simulation.world import Process
from tests.faults.rows import passed
from tests.faults.simulated import AT, Course, Scene, Stop
from tests.helpers import largest, with_table
from validation.faults.rigs import Wrong

CHANNELS = {
    SLAVE: ("table_displacement", "table_acceleration", "damper_stroke", "damper_force"),
    MASTER: ("column_displacement", "column_force"),
}
DELAYS = (0.044, 0.074, 0.114)  # s
OTHER = {SLAVE: MASTER, MASTER: SLAVE}


def with_wrong(path: Path, role: str, kind: str, place: int, by: float = 0.0, **tables: Any) -> Course:
    """A test in which one sensor is wrong from a tick on."""
    scene = Scene(path, tables=tables)
    probe = scene.simulation.probes[role]
    scene.at(AT, probe.set_wrong, "it", Wrong(kind, place, by))
    return scene.play()


def worst(stops: list[Stop]) -> Stop:
    """The longest times and the largest motions of several stops."""
    return Stop(*map(max, *stops))


def test_f37_a_sensor_that_gives_nan_or_always_the_same_value(tmp_path: Path) -> None:
    stops: dict[str, list[Stop]] = {"nan": [], "frozen": []}
    for role, channels in CHANNELS.items():
        for place, channel in enumerate(channels):
            course = with_wrong(tmp_path, role, "nan", place)
            assert (course.code(role), course.code(OTHER[role])) == ("rig", "remote_trip")
            stops["nan"].append(course.stopped(AT, within=3))

            course = with_wrong(tmp_path, role, "frozen", place)
            assert (course.code(role), course.code(OTHER[role])) == ("limit", "remote_trip")
            count = course.plan.safety.frozen_readings
            text = course.event(role, "limit")["text"]
            assert text.startswith(f"{channel} is frozen: {count} readings in a row")
            stops["frozen"].append(course.stopped(AT, within=count + 3))
    nan, frozen = (worst(found) for found in stops.values())
    passed(
        "F37",
        "a sensor reads NaN; or 25 times the same",
        "simulation: the rig's probe, each of the six sensors",
        "RAMPING, then SAFE, both laboratories",
        frozen.seconds,
        max(nan.motion, frozen.motion),
        f"NaN: event rig within {nan.seconds * 1e3:.0f} ms; frozen: event limit “{text}” at the 25th reading",
    )


def test_f38_a_force_beyond_its_limit(tmp_path: Path) -> None:
    stops = []
    for role, name in ((SLAVE, "damper_force"), (MASTER, "column_force")):
        place = CHANNELS[role].index(name)
        course = with_wrong(tmp_path, role, "beyond", place, 1.2 * getattr(Plan().limits, name))
        assert (course.code(role), course.code(OTHER[role])) == ("limit", "remote_trip")
        text = course.event(role, "limit")["text"]
        assert text.startswith(f"{name} is ")
        assert course.seconds_to(role, "ramping", course.scene.time(AT)) <= course.plan.test.interval
        stops.append(course.stopped(AT, within=3))
    stop = worst(stops)
    passed(
        "F38",
        "a force 20 % beyond its limit",
        "simulation: the rig's probe, in either laboratory",
        "RAMPING within the interval, then SAFE; no second, hard limit (ADR 0023)",
        stop.seconds,
        stop.motion,
        f"event limit: “{text}”",
    )


def slower(plan: Plan) -> Reality:
    """An actuator with a time constant so long that it hardly follows."""
    return replace(as_planned(plan), plan=with_table(plan, "actuator", time_constant=0.4))


def test_f39_an_actuator_that_does_not_follow(tmp_path: Path) -> None:
    tables = {"limits": {"column_error": 1e-3}}
    scene = Scene(tmp_path, 6.0, reality=slower, tables=tables)
    course = scene.play()
    assert (course.code(MASTER), course.code(SLAVE)) == ("limit", "remote_trip")
    text = course.event(MASTER, "limit")["text"]
    assert text.startswith("column_error is ")
    found = course.run.columns["master"]
    error = np.abs(found["column_target"] - found["column_displacement"])
    beyond = np.flatnonzero(error[: course.simulation.loops[MASTER].ticks] > 1e-3)
    last = int(beyond[0])
    stop = course.stopped(last, within=6)
    assert np.array_equal(beyond[-3:], np.arange(beyond[-1] - 2, beyond[-1] + 1))
    passed(
        "F39",
        "the specimen lags behind its target",
        "simulation: an actuator of 400 ms in place of 30 ms, column_error of 1 mm",
        "RAMPING after three intervals beyond the limit, then SAFE; no emergency stop at twice it (ADR 0023)",
        stop.seconds,
        stop.motion,
        f"event limit in the master: “{text}”",
    )


def test_f40_an_unstable_loop(tmp_path: Path) -> None:
    nominal = Scene(tmp_path, 8.0).play()
    reference = largest(nominal.run.columns["master"]["displacement"])
    peaks, seen = [], set()
    for delay in DELAYS:

        def later(plan: Plan, delay: float = delay) -> Reality:
            return replace(as_planned(plan), plan=with_table(plan, "actuator", delay=delay))

        course = Scene(tmp_path, 8.0, reality=later).play()
        assert (course.code(MASTER), course.code(SLAVE)) == ("limit", "remote_trip")
        seen.add(course.event(MASTER, "limit")["text"].split()[0])
        peaks.append(largest(course.run.columns["master"]["displacement"]) / reference)
        last = course.simulation.loops[MASTER].ticks - 1
        stop = course.stopped(last, within=3)
    assert max(peaks) < 1.5
    assert "error_energy" in seen
    passed(
        "F40",
        "a dead time of the actuator that makes the loop unstable",
        f"simulation: {', '.join(f'{1e3 * delay:.0f}' for delay in DELAYS)} ms in place of 14 ms",
        f"RAMPING and SAFE before x > {max(peaks):.2f} × the nominal peak",
        stop.seconds,
        stop.motion,
        f"event limit in the master: {' or '.join(sorted(seen))}; +8 ms is stable (ADR 0023)",
    )


STALLS = (0.020, 0.050, 0.200)


def test_f42_a_loop_that_stalls(tmp_path: Path) -> None:
    stops, shown = [], []
    for role in (MASTER, SLAVE):
        for seconds in STALLS:
            scene = Scene(tmp_path)
            scene.at(AT, scene.simulation.world.processes[role].stall, round(seconds * 1e9))
            course = scene.play()
            step = course.plan.test.interval
            assert (course.code(role), course.code(OTHER[role])) == ("overrun", "watchdog")
            times, _ = course.commands(role)
            gaps = np.diff(times) * 1e-9
            still = int(np.argmax(gaps))
            assert gaps[still] >= seconds - step
            ahead = gaps[still + 1 :]
            assert ahead[0] > 0.0  # on waking
            assert np.all(ahead[1:] > 0.9 * step)  # then a write per interval: nothing is caught up
            missed = round(float(gaps[still]) / step) - 1
            assert times.size <= course.plan.ticks - missed + 100
            other = course.seconds_to(OTHER[role], "ramping", scene.time(AT - 1))
            waited = 1.0 - course.plan.link.wait_share  # of an interval, by the master for the feedback
            assert other <= (course.plan.safety.ramp_after + 1 + waited) * step
            stops.append(course.stopped(AT, within=round(seconds / step) + 3))
            shown.append(f"{missed}")
    stop = worst(stops)
    passed(
        "F42",
        "a loop stands still for 20, 50, 200 ms",
        "simulation: either process does not run",
        "RAMPING, then SAFE: the other one by its watchdog within 12.5 ms, the one that stood still on waking",
        stop.seconds,
        stop.motion,
        f"events overrun and watchdog; {', '.join(shown)} intervals left out, none caught up",
    )


class Late:
    """Wakes a process too late, as another thread that holds the interpreter's lock does."""

    def __init__(self, process: Process, median: float) -> None:
        self._sleep, self._median = process.sleep_until, median
        self._chance = np.random.default_rng(3)

    def __call__(self, deadline: int) -> None:
        late = self._median * self._chance.uniform(0.5, 1.5)
        self._sleep(deadline + round(late * 1e9))


def test_f43_a_busy_thread_beside_the_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    strict = tmp_path / "strict.toml"
    strict.write_text("[wake_lateness]\np50 = 0.2e-3\n")
    found = {}
    for name, median, budget in (
        ("calm", 0.0, ["--budget", str(strict)]),
        ("a quarter of a millisecond", 0.25e-3, ["--budget", str(strict)]),
        ("a switch interval of 0.5 ms", 0.55e-3, []),
    ):
        scene = Scene(tmp_path)
        process = scene.simulation.world.processes[MASTER]
        if median:
            monkeypatch.setattr(process, "sleep_until", Late(process, median))
        course = scene.play()
        course.calm(holding=True)
        monkeypatch.setattr(sys, "argv", ["rths", "budget", str(course.scene.path), *budget, "--json"])
        code = main()
        report = json.loads(capsys.readouterr().out)
        over = [check["name"] for check in report["checks"] if check["verdict"] == "over"]
        found[name] = (code, over)
        assert code == int(bool(median)), (name, over)
        assert not median or "wake_lateness p50" in over, over
    passed(
        "F43",
        "a busy Python thread in the process",
        "simulation: the master's loop wakes late by 0.25 ms and by 0.55 ms, median",
        "RUNNING; the recording is over its budget",
        None,
        0.0,
        "rths budget ends with 1: p50 of wake_lateness over 0.2 ms (a budget of that), "
        "over 0.4 ms (the shipped one); the calm test is within",
    )
