"""Processes that are stopped, killed or never start: exit codes, messages, and that no process remains."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from common.recording.reader import read
from tests.helpers import PATIENT, patient
from tests.processes import HANG_S
from tests.system.started import crew, finish, free_port, gone, plan_file, start, wait_for_ticks


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_a_run_in_order_and_the_recording_names_it(
    number: signal.Signals, tmp_path: Path
) -> None:
    path = tmp_path / "stopped.mcap"
    process = start("run", patient(path.parent), "--duration", "60", "-o", path)
    wait_for_ticks(path)
    process.send_signal(number)
    code, out, err = finish(process)
    assert code == 3, err
    assert err.endswith(f"rths: stopped by the user ({number.name}).\n")
    assert "Traceback" not in out + err
    recording = read(path)
    assert recording.finished
    assert 0 < recording.ticks("master") < 30_000
    assert recording.ticks("slave") == pytest.approx(recording.ticks("master"), abs=200)
    assert recording.metadata["summary"]["cause"] == f"stopped by the user ({number.name})."


def test_after_the_run_command_is_killed_the_test_ends_in_order(tmp_path: Path) -> None:
    path = tmp_path / "orphan.mcap"
    process = start("run", patient(path.parent), "--duration", "60", "-o", path)
    wait_for_ticks(path)
    process.kill()
    process.communicate()
    deadline = time.monotonic() + HANG_S
    while not read(path).finished and time.monotonic() < deadline:
        time.sleep(0.2)
    recording = read(path)
    assert recording.finished
    assert "stopped by the user" in recording.metadata["summary"]["cause"]


LINUX = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


@pytest.mark.slow
@LINUX
@pytest.mark.parametrize("seconds", [0.0, 0.7])
def test_ctrl_c_during_the_start_ends_a_run_soon(seconds: float, tmp_path: Path) -> None:
    process = start("run", patient(tmp_path), "--duration", "60", "-o", tmp_path / "a.mcap")
    crew(process)
    time.sleep(seconds)
    process.send_signal(signal.SIGINT)
    code, out, err = finish(process, 15.0)
    assert code == 3, err
    assert "stopped by the user" in err
    assert "Traceback" not in out + err


@pytest.mark.slow
@LINUX
@pytest.mark.parametrize("seconds", [0.0, 0.7])
def test_a_run_command_that_is_killed_at_once_leaves_no_process(seconds: float, tmp_path: Path) -> None:
    process = start("run", patient(tmp_path), "--duration", "60", "-o", tmp_path / "a.mcap")
    numbers = crew(process).values()
    time.sleep(seconds)
    process.kill()
    process.communicate()
    deadline = time.monotonic() + HANG_S
    while not all(map(gone, numbers)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert all(map(gone, numbers))


@pytest.mark.slow  # a machine that stops for longer than the silence ends the test first
@LINUX
def test_a_killed_slave_is_detected_and_named_by_the_master(tmp_path: Path) -> None:
    path, planned = tmp_path / "a.mcap", tmp_path / "plan.toml"
    planned.write_text(PATIENT + "[link]\nloss_timeout = 3.0\n[recording]\npatience = 1.0\n")
    process = start("run", planned, "--duration", "60", "-o", path)
    numbers = crew(process)
    wait_for_ticks(path)
    os.kill(numbers["slave"], signal.SIGKILL)
    code, _, err = finish(process)
    assert code == 4, err
    assert "The slave was killed (signal 9)" in err.splitlines()[-1]
    recording = read(path)
    assert recording.finished
    assert recording.metadata["summary"]["outcome"] == "lost"
    assert recording.metadata["summary"]["cause"] == "The slave has been silent for 3 s."
    assert recording.ticks("master") >= recording.ticks("slave") + 300  # those until it was noticed
    assert recording.sequences["master"].tolist() == list(range(recording.ticks("master")))


@pytest.mark.slow
@LINUX
def test_a_run_with_a_slave_that_hangs_ends(tmp_path: Path) -> None:
    path, planned = tmp_path / "a.mcap", tmp_path / "plan.toml"
    planned.write_text(PATIENT + "[link]\nloss_timeout = 3.0\n[recording]\npatience = 1.0\n")
    process = start("run", planned, "--duration", "60", "-o", path)
    numbers = crew(process)
    wait_for_ticks(path)
    os.kill(numbers["slave"], signal.SIGSTOP)
    for _ in range(2):
        process.send_signal(signal.SIGINT)
        time.sleep(0.6)
    code, _, err = finish(process)  # the slave is not killed before its deadline for coming to rest
    assert code == 4, err
    assert "already stopping" in err
    assert "The slave did not come to rest and leave in time and was killed" in err.splitlines()[-1]
    assert all(map(gone, numbers.values()))


@pytest.fixture
def three(tmp_path: Path) -> Iterator[dict[str, subprocess.Popen[str]]]:
    """Master, slave and recorder, each started by hand, as on three machines."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    plan = plan_file(tmp_path, loss_timeout=0.5)
    words: list[str | Path] = [plan, "--duration", "60"]
    processes = {
        "slave": start(*words, "--connect", endpoint, module="slave"),
        "recorder": start(*words, "--connect", endpoint, "-o", tmp_path / "a.mcap", module="recorder"),
        "master": start(*words, "--listen", endpoint, module="master"),
    }
    yield processes
    for process in processes.values():
        process.kill()
        process.communicate()


@pytest.mark.slow
def test_a_killed_slave_ends_the_test_with_exit_code_4(three: dict[str, Any], tmp_path: Path) -> None:
    wait_for_ticks(tmp_path / "a.mcap")
    three["slave"].kill()
    code, _, err = finish(three["master"])
    assert code == 4
    assert "The slave has been silent for 0.5 s." in err
    code, _, err = finish(three["recorder"])
    assert code == 1  # the slave took its last rows with it
    assert "The end of the stream of the slave did not reach the recorder." in err
    assert read(tmp_path / "a.mcap").finished


@pytest.mark.slow
def test_a_killed_master_ends_the_slave_with_exit_code_4(three: dict[str, Any], tmp_path: Path) -> None:
    wait_for_ticks(tmp_path / "a.mcap")
    three["master"].kill()
    code, _, err = finish(three["slave"])
    assert code == 4
    assert "The master has been silent for 0.5 s." in err
    code, _, _ = finish(three["recorder"])
    assert code == 4
    assert read(tmp_path / "a.mcap").ticks("slave") > 0


@pytest.mark.slow
def test_a_killed_recorder_loses_at_most_one_second(three: dict[str, Any], tmp_path: Path) -> None:
    wait_for_ticks(tmp_path / "a.mcap", 1500)
    three["recorder"].kill()
    killed = time.time()
    three["recorder"].communicate()
    recording = read(tmp_path / "a.mcap")
    assert not recording.finished
    assert recording.metadata["plan"]["toml"]
    assert killed - recording.log_ns["master"][-1] * 1e-9 < 1.0
    assert recording.sequences["master"].tolist() == list(range(recording.ticks("master")))
    code, _, err = finish(three["master"])
    assert code == 4
    assert "recorder" in err


def test_plans_that_differ_are_refused_with_exit_code_2(tmp_path: Path) -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    plan = plan_file(tmp_path)
    slave = start(plan, "--scale", "0.2", "--connect", endpoint, module="slave")
    recorder = start(plan, "--connect", endpoint, "-o", tmp_path / "a.mcap", module="recorder")
    master = start(plan, "--listen", endpoint, module="master")
    results = {name: finish(process) for name, process in (("slave", slave), ("master", master))}
    recorder.terminate()
    recorder.communicate()
    for name, (code, _, err) in results.items():
        assert code == 2, name
        assert "plans differ" in err
        assert "Traceback" not in err


def test_a_missing_partner_gives_exit_code_4_within_the_connect_timeout(tmp_path: Path) -> None:
    plan = plan_file(tmp_path, connect_timeout=1.0)
    master = start(plan, "--listen", f"tcp/127.0.0.1:{free_port()}", module="master")
    slave = start(plan, "--connect", f"tcp/127.0.0.1:{free_port()}", module="slave")
    for process, sentence in ((master, "No slave joined"), (slave, "No master was reached")):
        code, _, err = finish(process)
        assert code == 4
        assert sentence in err
        assert "within 1 s: " in err
        assert "Traceback" not in err


@pytest.mark.slow
def test_ctrl_c_before_the_partner_is_there_ends_a_process_soon(tmp_path: Path) -> None:
    plan = plan_file(tmp_path)
    processes = [
        start(plan, "--listen", f"tcp/127.0.0.1:{free_port()}", module="master"),
        start(plan, "--connect", f"tcp/127.0.0.1:{free_port()}", module="slave"),
    ]
    time.sleep(3.0)  # until they wait for each other
    for process in processes:
        process.send_signal(signal.SIGINT)
    for process in processes:
        code, _, err = finish(process)
        assert code == 3, err
        assert "Traceback" not in err


def test_a_port_in_use_gives_exit_code_2(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        code, _, err = finish(start(plan_file(tmp_path), "--listen", endpoint, module="master"))
    assert code == 2
    assert f"Cannot listen on {endpoint}" in err
    assert "Traceback" not in err


def test_an_invalid_endpoint_gives_exit_code_2(tmp_path: Path) -> None:
    for module, option in (("master", "--listen"), ("slave", "--connect")):
        code, _, err = finish(start(plan_file(tmp_path), option, "nonsense", module=module))
        assert code == 2, err
        assert "nonsense" in err
        assert "Traceback" not in err


def test_a_folder_without_permission_gives_exit_code_2(tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("a file where the folder should be")
    code, _, err = finish(start("run", "--duration", "1", cwd=tmp_path))
    assert code == 2
    assert "Cannot create the folder runs" in err
    assert "Traceback" not in err


@pytest.mark.slow
def test_a_rig_that_cannot_be_constructed_leaves_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "none.mcap"
    (tmp_path / "lab.py").write_text(
        "class Lab:\n    def __init__(self, interval, seed):\n        raise RuntimeError('no card')\n"
        "    def arm(self): pass\n    def read(self): return 0.0, 0.0\n"
        "    def write(self, command): pass\n    def disarm(self): pass\n"
    )
    plan = tmp_path / "own.toml"
    plan.write_text('[test]\nname = "own"\n[slave]\nkind = "none"\n[master.rig]\nclass = "lab.py:Lab"\n')
    code, _, err = finish(start("run", plan, "--duration", "2", "-o", path))
    assert code == 2, err
    assert err.splitlines()[-1].endswith("RuntimeError: no card (lab.py, line 3).")
    assert not path.exists()
