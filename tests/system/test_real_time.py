"""A test in real time on real processes, sockets and files."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan import read as plans
from common.reality import reality
from common.recording.reader import read
from common.recording.run import Run
from simulation import virtual
from tests.helpers import PATIENT, SLOW, patient
from tests.system.started import finish, start

TIMES = ("wake_lateness", "compute_time", "clock_offset", "clock_offset_bound")


@pytest.fixture(scope="module")
def real_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Run]:
    """Two seconds of the default test in real time: its summary and its recording."""
    path = tmp_path_factory.mktemp("real") / "real.mcap"
    code, out, err = finish(start("run", patient(path.parent), "--duration", "2", "-o", path, "--json"))
    assert code == 0, err
    return json.loads(out), read(path)


def test_every_tick_of_a_real_test_is_recorded(real_run: tuple[dict[str, Any], Run]) -> None:
    summary, recording = real_run
    assert recording.finished
    behind = 1000 - recording.ticks(
        "slave"
    )  # where the machine holds it up, as the master completes the test
    assert behind < 500
    for topic, ticks in (("master", 1000), ("latency", 1000), ("slave", 1000 - behind)):
        assert recording.sequences[topic].tolist() == list(range(ticks))
        assert summary["topics"][topic]["missing"] == 1000 - ticks
    assert summary["recorder"]["cause"] == "completed"
    assert np.all(np.diff(recording.log_ns["master"]) == 2_000_000)
    assert np.array_equal(recording.log_ns["master"][: 1000 - behind], recording.log_ns["slave"])
    assert abs(recording.log_ns["master"][0] * 1e-9 - time.time()) < 3600.0


@pytest.mark.slow
def test_real_time_equals_virtual_time_to_the_last_bit_until_a_message_is_late(tmp_path: Path) -> None:
    path = tmp_path / "slow.toml"
    path.write_text(SLOW + PATIENT)
    assert differing_from_virtual_time(path) == []


def differing_from_virtual_time(plan: Path) -> list[str]:
    """The signals of a real test that do not have the bits of one in virtual time before any message is late.

    Half of the ticks must come before. A machine that is shared may be late early; then once more.
    """
    chosen = plans.load(plan)
    path = plan.with_suffix(".mcap")
    assert virtual.run(virtual.assemble(chosen, reality.as_planned(chosen), path), str) is None
    expected = read(path)
    for attempt in range(5):
        again = plan.parent / f"{attempt}.mcap"
        code, out, err = finish(start("run", plan, "-o", again))
        assert code == 0, out + err
        real = read(again)
        if (ticks := ticks_in_time(real)) >= chosen.ticks // 2:
            break
    assert ticks >= chosen.ticks // 2
    return [
        f"{topic}/{name}"
        for topic in ("master", *chosen.roles)
        for name, values in expected.columns[topic].items()
        if not np.array_equal(real.columns[topic][name][:ticks], values[:ticks])
    ]


def ticks_in_time(recording: Run) -> int:
    """Ticks before the first late one of any slave."""
    late = [
        np.flatnonzero(columns["deadline_missed"])
        for topic, columns in recording.columns.items()
        if topic.startswith("latency")
    ]
    return min((int(found[0]) for found in late if found.size), default=recording.ticks("master"))


def test_a_real_test_replays_to_the_last_bit_with_or_without_late_messages(
    real_run: tuple[dict[str, Any], Run],
) -> None:
    code, out, err = finish(start("replay", real_run[1].path))
    assert code == 0, out + err


def test_the_latency_segments_of_a_real_test_add_up(real_run: tuple[dict[str, Any], Run]) -> None:
    columns = real_run[1].columns["latency"]
    good = columns["deadline_missed"] == 0
    assert np.count_nonzero(good) > 0.5 * good.size
    parts = columns["command_one_way"] + columns["slave_time"] + columns["feedback_one_way"]
    assert np.allclose(parts[good], columns["round_trip"][good], atol=1e-9)
    assert np.all(columns["command_one_way"][good] > -columns["clock_offset_bound"][good])
    assert np.all(columns["feedback_one_way"][good] > -columns["clock_offset_bound"][good])
    assert np.all(
        np.abs(columns["clock_offset"]) <= columns["clock_offset_bound"] + 1e-6
    )  # one machine, one clock
    assert np.all(columns["wake_lateness"] > -1e-9)
    stamps = ("tick_ns", "wake_ns", "command_sent_ns", "feedback_received_ns")
    ordered = np.stack([columns[name][good] for name in stamps])
    assert np.all(np.diff(ordered, axis=0) >= 0)


LOUD = """
class Loud:
    def __init__(self, interval, seed): ...
    def arm(self):
        for number in range(10_000):
            print("valve", number)
    def read(self):
        for number in range(5):
            print("reading", number)
        print("...", end="")
        return 0.0, 0.0
    def write(self, command): ...
    def disarm(self): ...
"""


@pytest.mark.slow
def test_a_rig_that_prints_delays_no_process(tmp_path: Path) -> None:
    (tmp_path / "loud.py").write_text(LOUD)
    plan = tmp_path / "loud.toml"
    plan.write_text(f"[test]\nduration = 1.0\n{PATIENT}[master.rig]\nclass = 'loud.py:Loud'\n")
    code, _, err = finish(start("run", plan, "-o", tmp_path / "a.mcap"))
    assert code == 0, err[-1000:]
    assert "master: valve 9999\n" in err
    assert err.count("reading 4\n") >= 500  # and on the ramp to rest
    assert "master: completed\n" in err
