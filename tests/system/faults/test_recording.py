"""Fault rows F23, F24, F47, F50 and F51: doubles, a slow disk, no recorder or no room, strangers on the port."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from common.recording.run import Run
from tests.faults.rows import passed
from tests.system.faults.bench import AT, INTERVAL, LABS, Bench, DisturbedError, Process, undisturbed
from tests.system.faults.hostile import Stranger
from tests.system.faults.impostor import FAR
from tests.system.faults.reactions import later

pytestmark = pytest.mark.faults

QUIET = 2.0  # s without strangers
DOUBLES = 6.0  # s for a second slave and a second master


def test_f47_f51_neither_a_slow_disk_nor_strangers_delay_the_loop(tmp_path: Path) -> None:
    def scenario(folder: Path) -> None:
        slow = "tests.system.faults.slow_recorder"
        with Bench(
            folder, duration=AT + DOUBLES + QUIET + 5.5, stay=False, recorder=slow
        ).start_all() as bench:
            turned_away = doubles(bench)
            since = bench.now()
            bench.until(since + QUIET)
            begin = bench.now()
            stranger = Stranger(int(bench.place.listen.rpartition(":")[2]))
            stranger.connections(300)
            stranger.datagrams(5000)
            with stranger.held(300):
                end = bench.now()
                bench.ticked()
            run = bench.finish()
        latency, summary = run.columns["latency"], run.metadata["summary"]
        t, late = latency["seq"] * INTERVAL, latency["deadline_missed"]
        loud, quiet = late[(t >= begin) & (t < end)], late[(t >= since) & (t < begin)]
        later(loud, quiet, "strangers")
        assert summary["items_lost"] == summary["items_dropped"] == "0"
        for topic in ("master", "slave", "latency"):
            assert run.sequences[topic].tolist() == list(range(bench.plan.ticks))
        waiting = summary["items_waiting_most"]
        assert int(waiting) > 0.2 / INTERVAL  # of some items a tick, while the disk stalls for 0.3 s
        passed(
            "F47",
            "disk stalls 300 ms each second",
            "wrapper of the file",
            "running",
            None,
            0.0,
            f"nothing lost, {waiting} items waiting at most",
        )
        not_obeyed(run, turned_away)
        share = f"late ticks {loud.mean() * 100:.2f} % with, {quiet.mean() * 100:.2f} % without"
        how = "300 connections and 5000 datagrams of garbage, 300 half-open connections"
        passed("F51", "strangers on the port", how, "running", None, 0.0, share)

    undisturbed(scenario, tmp_path)


def doubles(bench: Bench) -> str:
    """A second slave, then a second master with a session of its own; what the former was told."""
    second = bench.start("slave", "--rt", "off")  # not at the first one's priority on its processor
    code = second.finish()
    if not bench.master.alive():
        raise DisturbedError("the test was over before a second slave could come")
    assert code == 2
    endpoint = bench.place.connect["slave"]
    impostor = Process("tests.system.faults.impostor", bench.path, "--connect", endpoint)
    bench.all.append(impostor)
    assert impostor.finish() == 0, impostor.errors
    return second.errors.strip()


def not_obeyed(run: Run, turned_away: str) -> None:
    """The second slave was sent away, and of the second master nothing came into force."""
    assert "Another slave takes part in this test already" in turned_away
    rejected = [event for event in run.events if event["code"] == "rejected" and event["lab"] == "slave"]
    assert rejected
    assert not np.any(run.columns["slave"]["table_target"] == FAR)
    how = "its own session, under the master's keys"
    passed("F23", "second master", how, "running", None, 0.0, rejected[-1]["text"])
    passed("F24", "second slave", "second process", "running", None, 0.0, turned_away)


def test_f50_nothing_is_armed_without_a_recorder_or_room_for_it(tmp_path: Path) -> None:
    with Bench(tmp_path, preflight="disk_factor = 1e9", more="[link]\nconnect_timeout = 4.0\n") as bench:
        bench.slave, bench.recorder = bench.start("slave"), bench.start("recorder")
        bench.master = bench.start("master")
        assert bench.recorder.finish() == 3
        assert "the recording needs" in bench.recorder.errors
        assert bench.master.finish() == 4
        assert "No recorder joined the test within 4 s" in bench.master.errors
        assert bench.slave.finish() == 3
        assert "No recorder joined" in bench.slave.errors
        for lab in LABS:
            modes = [data["mode"] for _, data in bench.lab(lab).said if data["kind"] == "mode"]
            assert set(modes) <= {"configured"}
            assert bench.logs[lab].written().ns.size == 0
            assert "Traceback" not in bench.lab(lab).errors
    how = "a recorder that finds no room, so that none is there"
    passed(
        "F50",
        "recorder absent, disk too small",
        how,
        "never armed",
        None,
        0.0,
        "exit codes 3 of the recorder and the slave, 4 of the master",
    )
