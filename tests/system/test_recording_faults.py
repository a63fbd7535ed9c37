"""Recordings under faults, with real processes, signals and a real small disk."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from common.recording.reader import read
from common.signals import TICK_TOPICS
from recorder import space
from report.facts.laboratories import plan_of
from tests.faults.rows import passed
from tests.helpers import PATIENT
from tests.processes import HANG_S
from tests.system.started import crew, finish, start, wait_for_ticks

pytestmark = [
    pytest.mark.faults,
    pytest.mark.skipif(sys.platform != "linux", reason="reads /proc and mounts a tmpfs"),
]

# the processes share a machine with others: a laboratory that is held up shall not end a test of the recorder
LOSS = "[link]\nloss_timeout = 5.0\n"
KILLS = 2


def plan_file(folder: Path, duration: float, preflight: str = "", recording: str = "") -> Path:
    path = folder / "plan.toml"
    patient = PATIENT.replace("[preflight]", f"[preflight]\n{preflight}")
    path.write_text(
        f"[test]\nname = 'trial'\nduration = {duration}\n{patient}{LOSS}[recording]\n{recording}\n"
    )
    return path


def stop(process: subprocess.Popen[str]) -> None:
    """End a run whose fault has been seen."""
    for _ in range(2):
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            time.sleep(0.3)
    finish(process)


def test_a_killed_recorder_loses_less_than_a_tenth_of_a_second(tmp_path: Path) -> None:
    plan = plan_file(tmp_path, 60.0, recording="patience = 5.0")
    losses = []
    for attempt in range(KILLS):
        path = tmp_path / f"{attempt}.mcap"
        process = start("run", plan, "-o", path, "--rt", "off")
        recorder = crew(process)["recorder"]
        wait_for_ticks(path, 300)
        time.sleep(0.013 * attempt)  # at different moments of the flush
        killed = time.time()
        os.kill(recorder, signal.SIGKILL)
        stop(process)
        run = read(path)
        assert not run.finished
        assert not run.damage
        assert run.sequences["master"].tolist() == list(range(run.ticks("master")))
        losses.append(killed - min(run.log_ns[topic][-1] for topic in TICK_TOPICS) * 1e-9)
        if attempt == 0:
            code, out, err = finish(start("recover", path))
            assert code == 0, out + err
            assert "Everything that was in the file is recovered." in out
            assert read(tmp_path / "0-recovered.mcap").finished
    print("lost, s:", [round(float(loss), 4) for loss in losses])
    assert min(losses) < 0.1  # a stall of a shared machine on top of it is not the recorder's
    lost = f"{min(losses) * 1e3:.0f} ms lost, file recovered whole"
    passed("F44", "recorder killed", "kill -9 of its process", "running while it is missed", None, 0.0, lost)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk that is full after two seconds of a test."""
    folder = tmp_path / "small"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=700k", "tmpfs", str(folder)],
        capture_output=True,
        text=True,
        timeout=HANG_S,
    )
    if mounted.returncode:
        pytest.skip(f"no disk can be mounted here: {mounted.stderr.strip()}")
    yield folder
    subprocess.run(["umount", "--lazy", str(folder)], check=True, timeout=HANG_S)


def test_a_full_disk_stops_the_test_in_order_and_keeps_the_written_samples(
    tmp_path: Path, small_disk: Path
) -> None:
    path = small_disk / "a.mcap"
    code, _, err = finish(start("run", plan_file(tmp_path, 20.0), "-o", path))
    assert code == 3
    assert f"the folder {small_disk} has 0.7 MB free, and the recording needs" in err
    plan = plan_file(tmp_path, 20.0, preflight="disk_factor = 0.0")
    code, out, err = finish(start("run", plan, "-o", path, "--rt", "off"))
    assert code == 3, out + err
    assert err.splitlines()[-1] == (
        "rths: The recording is lost: the disk cannot be written (No space left on device)."
    )
    assert "recorder: ends the test (recording_lost)" in err
    assert "Traceback" not in out + err
    run = read(path)
    ticks = run.ticks("master")
    assert ticks > 300
    assert not run.damage
    assert run.sequences["master"].tolist() == list(range(ticks))
    whole = tmp_path / "whole.mcap"
    assert finish(start("recover", path, "-o", whole))[0] == 0
    assert read(whole).ticks("master") == ticks
    evidence = f"recording_lost; all {ticks} ticks before it readable"
    passed("F46", "disk full", "a real disk of 700 kB", "ended in order, exit code 3", None, None, evidence)


def test_a_recorder_on_a_full_disk_refuses_the_test_in_one_sentence(tmp_path: Path, small_disk: Path) -> None:
    (small_disk / "ballast").write_bytes(bytes(700_000))
    plan = plan_file(tmp_path, 20.0, preflight="disk_factor = 0.0")
    code, _, err = finish(start("run", plan, "--virtual", "-o", small_disk / "a.mcap"))
    assert code == 2
    assert "Cannot begin the recording" in err
    assert "No space left on device" in err
    assert "Traceback" not in err


def test_a_recorder_that_is_paused_for_seven_seconds_receives_the_missed_samples(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    plan = plan_file(tmp_path, 11.0, recording="patience = 20.0")
    process = start("run", plan, "-o", path, "--rt", "off")
    recorder = crew(process)["recorder"]
    wait_for_ticks(path, 300)
    os.kill(recorder, signal.SIGSTOP)
    time.sleep(7.0)
    os.kill(recorder, signal.SIGCONT)
    code, out, err = finish(process)
    assert code == 0, out + err
    run = read(path)
    summary = run.metadata["summary"]
    print({name: summary[name] for name in ("items_lost", "items_dropped", "items_waiting_most")})
    print("late ticks", int(run.columns["latency"]["deadline_missed"].sum()))
    assert float(summary["recorder_stalled_s"]) > 6.0
    for topic in TICK_TOPICS:
        assert run.ticks(topic) + int(summary[f"{topic}_gaps"]) == 5500
    assert summary["items_lost"] == summary["items_dropped"] == "0"
    stalled = float(summary["recorder_stalled_s"])
    evidence = f"held up {stalled:.1f} s, nothing lost"
    passed("F45", "recorder held up 7 s", "SIGSTOP of its process", "running", None, 0.0, evidence)
    plan_read: Any = plan_of(run)
    assert space.need(plan_read) == pytest.approx(path.stat().st_size, rel=0.3)
