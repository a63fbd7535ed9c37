"""The whole system on real processes, sockets, signals and files."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
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
from tests.processes import environment, tied

RTHS = [sys.executable, "-m", "rths"]
TIMES = ("wake_lateness", "compute_time", "clock_offset", "clock_offset_bound")


def start(*words: str | Path, module: str = "rths", **options: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        tied(sys.executable, "-m", module, *words),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
        **options,
    )


def finish(process: subprocess.Popen[str], seconds: float = 60.0) -> tuple[int, str, str]:
    out, err = process.communicate(timeout=seconds)
    return process.returncode, out, err


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def plan_file(folder: Path, **link: float) -> Path:
    path = folder / "plan.toml"
    keys = "\n".join(f"{name} = {value}" for name, value in link.items())
    path.write_text(
        f"[test]\nname = 'trial'\nduration = 4.0\n[recording]\npatience = 1.0\n{PATIENT}[link]\n{keys}\n"
    )
    return path


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


def test_a_real_test_replays_to_the_last_bit_late_messages_or_not(
    real_run: tuple[dict[str, Any], Run],
) -> None:
    code, out, err = finish(start("replay", real_run[1].path))
    assert code == 0, out + err


def test_the_accounts_of_latency_add_up(real_run: tuple[dict[str, Any], Run]) -> None:
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


def test_ctrl_c_stops_in_order_and_keeps_the_recording(tmp_path: Path) -> None:
    path = tmp_path / "stopped.mcap"
    process = start("run", patient(path.parent), "--duration", "60", "-o", path)
    wait_for_ticks(path)
    process.send_signal(signal.SIGINT)
    code, out, err = finish(process, 20.0)
    assert code == 3, err
    assert "stopped by the user" in err
    assert "Traceback" not in out + err
    recording = read(path)
    assert recording.finished
    assert 0 < recording.ticks("master") < 30_000
    assert recording.ticks("slave") == pytest.approx(recording.ticks("master"), abs=200)
    assert "stopped by the user" in recording.metadata["summary"]["cause"]


def test_a_killed_front_door_ends_the_test_in_order(tmp_path: Path) -> None:
    path = tmp_path / "orphan.mcap"
    process = start("run", patient(path.parent), "--duration", "60", "-o", path)
    wait_for_ticks(path)
    process.kill()
    process.communicate()
    deadline = time.monotonic() + 15.0
    while not read(path).finished and time.monotonic() < deadline:
        time.sleep(0.2)
    recording = read(path)
    assert recording.finished
    assert "stopped by the user" in recording.metadata["summary"]["cause"]


def crew(process: subprocess.Popen[str]) -> dict[str, int]:
    """Process numbers of master, slave and recorder of a run, as soon as all are there."""
    deadline = time.monotonic() + 20.0
    found: dict[str, int] = {}
    while set(found) != {"master", "slave", "recorder"}:
        assert time.monotonic() < deadline, found
        time.sleep(0.02)
        found = {}
        for children in Path(f"/proc/{process.pid}/task").glob("*/children"):
            with contextlib.suppress(OSError):  # a thread that has ended meanwhile
                found |= {module(child): int(child) for child in children.read_text().split()}
    return found


def module(number: str) -> str:
    """What a process runs with `python -m`."""
    words = Path(f"/proc/{number}/cmdline").read_text().split("\0")
    return words[words.index("-m") + 1] if "-m" in words else ""


def gone(number: int) -> bool:
    """Whether a process has ended."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


LINUX = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


@pytest.mark.slow
@LINUX
@pytest.mark.parametrize("seconds", [0.0, 0.7])
def test_ctrl_c_in_the_first_moments_ends_soon(seconds: float, tmp_path: Path) -> None:
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
def test_a_front_door_killed_in_the_first_moments_leaves_nobody(seconds: float, tmp_path: Path) -> None:
    process = start("run", patient(tmp_path), "--duration", "60", "-o", tmp_path / "a.mcap")
    numbers = crew(process).values()
    time.sleep(seconds)
    process.kill()
    process.communicate()
    deadline = time.monotonic() + 30.0
    while not all(map(gone, numbers)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert all(map(gone, numbers))


@LINUX
def test_a_killed_slave_is_noticed_by_the_master_and_named(tmp_path: Path) -> None:
    path, planned = tmp_path / "a.mcap", tmp_path / "plan.toml"
    planned.write_text(PATIENT + "[link]\nloss_timeout = 1.0\n[recording]\npatience = 1.0\n")
    process = start("run", planned, "--duration", "60", "-o", path)
    numbers = crew(process)
    wait_for_ticks(path)
    os.kill(numbers["slave"], signal.SIGKILL)
    code, _, err = finish(process, 20.0)
    assert code == 4, err
    assert "The slave was killed (signal 9)" in err.splitlines()[-1]
    recording = read(path)
    assert recording.finished
    assert recording.metadata["summary"]["outcome"] == "lost"
    assert recording.metadata["summary"]["cause"] == "The slave has been silent for 1 s."
    assert recording.ticks("master") >= recording.ticks("slave") + 300  # those until it was noticed
    assert recording.sequences["master"].tolist() == list(range(recording.ticks("master")))


@pytest.mark.slow
@LINUX
def test_a_run_with_a_slave_that_hangs_ends_all_the_same(tmp_path: Path) -> None:
    path, planned = tmp_path / "a.mcap", tmp_path / "plan.toml"
    planned.write_text(PATIENT + "[link]\nloss_timeout = 1.0\n[recording]\npatience = 1.0\n")
    process = start("run", planned, "--duration", "60", "-o", path)
    numbers = crew(process)
    wait_for_ticks(path)
    os.kill(numbers["slave"], signal.SIGSTOP)
    for _ in range(2):
        process.send_signal(signal.SIGINT)
        time.sleep(0.6)
    code, _, err = finish(process, 60.0)  # the slave is not killed before its deadline for coming to rest
    assert code == 4, err
    assert "already stopping" in err
    assert "The slave did not come to rest and leave in time and was killed" in err.splitlines()[-1]
    assert all(map(gone, numbers.values()))


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
def test_a_rig_that_prints_holds_nobody_up(tmp_path: Path) -> None:
    (tmp_path / "loud.py").write_text(LOUD)
    plan = tmp_path / "loud.toml"
    plan.write_text(f"[test]\nduration = 1.0\n{PATIENT}[master.rig]\nclass = 'loud.py:Loud'\n")
    code, _, err = finish(start("run", plan, "-o", tmp_path / "a.mcap"), 30.0)
    assert code == 0, err[-1000:]
    assert "master: valve 9999\n" in err
    assert err.count("reading 4\n") >= 500  # and on the ramp to rest
    assert "master: completed\n" in err


def wait_for_ticks(path: Path, ticks: int = 200, seconds: float = 30.0) -> None:
    """Until a recording that is being written holds some ticks."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if path.exists() and path.stat().st_size > 10_000:
            try:
                if read(path).ticks("master") >= ticks:
                    return
            except Exception:
                continue
        time.sleep(0.1)
    raise AssertionError(f"no {ticks} ticks in {path} after {seconds} s")


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
    code, _, err = finish(three["master"], 20.0)
    assert code == 4
    assert "The slave has been silent for 0.5 s." in err
    code, _, err = finish(three["recorder"], 20.0)
    assert code == 1  # the slave took its last rows with it
    assert "The end of the stream of the slave did not reach the recorder." in err
    assert read(tmp_path / "a.mcap").finished


@pytest.mark.slow
def test_a_killed_master_ends_the_slave_with_exit_code_4(three: dict[str, Any], tmp_path: Path) -> None:
    wait_for_ticks(tmp_path / "a.mcap")
    three["master"].kill()
    code, _, err = finish(three["slave"], 20.0)
    assert code == 4
    assert "The master has been silent for 0.5 s." in err
    code, _, _ = finish(three["recorder"], 20.0)
    assert code == 4
    assert read(tmp_path / "a.mcap").ticks("slave") > 0


@pytest.mark.slow
def test_a_killed_recorder_loses_a_second_at_most(three: dict[str, Any], tmp_path: Path) -> None:
    wait_for_ticks(tmp_path / "a.mcap", 1500)
    three["recorder"].kill()
    killed = time.time()
    three["recorder"].communicate()
    recording = read(tmp_path / "a.mcap")
    assert not recording.finished
    assert recording.metadata["plan"]["toml"]
    assert killed - recording.log_ns["master"][-1] * 1e-9 < 1.0
    assert recording.sequences["master"].tolist() == list(range(recording.ticks("master")))
    code, _, err = finish(three["master"], 20.0)
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


def test_nobody_there_is_exit_code_4_in_the_time_the_plan_allows(tmp_path: Path) -> None:
    plan = plan_file(tmp_path, connect_timeout=1.0)
    began = time.monotonic()
    master = start(plan, "--listen", f"tcp/127.0.0.1:{free_port()}", module="master")
    slave = start(plan, "--connect", f"tcp/127.0.0.1:{free_port()}", module="slave")
    for process, sentence in ((master, "No slave joined"), (slave, "No master was reached")):
        code, _, err = finish(process, 20.0)
        assert code == 4
        assert sentence in err
        assert "Traceback" not in err
    assert time.monotonic() - began < 15.0


@pytest.mark.slow
def test_ctrl_c_before_the_other_is_there_ends_soon(tmp_path: Path) -> None:
    plan = plan_file(tmp_path)
    processes = [
        start(plan, "--listen", f"tcp/127.0.0.1:{free_port()}", module="master"),
        start(plan, "--connect", f"tcp/127.0.0.1:{free_port()}", module="slave"),
    ]
    time.sleep(3.0)  # until they wait for each other
    for process in processes:
        process.send_signal(signal.SIGINT)
    for process in processes:
        code, _, err = finish(process, 20.0)
        assert code == 3, err
        assert "Traceback" not in err


def test_a_port_in_use_is_exit_code_2(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        code, _, err = finish(start(plan_file(tmp_path), "--listen", endpoint, module="master"))
    assert code == 2
    assert f"Cannot listen on {endpoint}" in err
    assert "Traceback" not in err


def test_an_endpoint_that_is_none_is_exit_code_2(tmp_path: Path) -> None:
    for module, option in (("master", "--listen"), ("slave", "--connect")):
        code, _, err = finish(start(plan_file(tmp_path), option, "nonsense", module=module))
        assert code == 2, err
        assert "nonsense" in err
        assert "Traceback" not in err


def test_a_folder_without_permission_is_exit_code_2(tmp_path: Path) -> None:
    (tmp_path / "runs").write_text("a file where the folder should be")
    code, _, err = finish(start("run", "--duration", "1", cwd=tmp_path))
    assert code == 2
    assert "Cannot create the folder runs" in err
    assert "Traceback" not in err
