"""Master and slave in two network namespaces joined by a virtual cable, as on two machines."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.cable import ADDRESSES, NoCableError, cable, ip
from common.recording.reader import read
from tests.helpers import PATIENT, ROOT, patient
from tests.processes import HANG_S, environment, tied

pytestmark = pytest.mark.slow

ADDRESS_A, ADDRESS_B = ADDRESSES


@pytest.fixture
def machines() -> Iterator[tuple[str, str]]:
    """Two namespaces, `ADDRESS_A` in the first and `ADDRESS_B` in the second."""
    try:
        with cable() as names:
            yield names
    except NoCableError as reason:
        pytest.skip(str(reason))


def start(machine: str, *words: str | Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        tied("ip", "netns", "exec", machine, sys.executable, "-m", "rths", *words),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
    )


def await_all(processes: dict[str, subprocess.Popen[str]]) -> None:
    """All end, and with 0."""
    try:
        for name, process in processes.items():
            _, err = process.communicate(timeout=HANG_S)
            assert process.returncode == 0, f"{name}: {err}"
    finally:
        for process in processes.values():
            process.kill()
            process.communicate()


def test_a_test_on_two_machines_is_recorded_completely(machines: tuple[str, str], tmp_path: Path) -> None:
    first, second = machines
    path = tmp_path / "two.mcap"
    words = (patient(tmp_path), "--duration", "4")
    endpoint = f"tcp/{ADDRESS_A}:7447"
    processes = {
        "slave": start(second, "slave", *words, "--connect", endpoint),
        "recorder": start(second, "record", *words, "--connect", endpoint, "-o", path),
        "master": start(first, "master", *words, "--listen", "tcp/0.0.0.0:7447"),
    }
    await_all(processes)
    recording = read(path)
    assert recording.finished
    for topic in ("master", "slave", "latency"):
        assert recording.sequences[topic].tolist() == list(range(2000))


def test_two_slaves_run_beside_the_master_and_across_the_cable(
    machines: tuple[str, str], tmp_path: Path
) -> None:
    first, second = machines
    path = tmp_path / "slaves.mcap"
    plan = tmp_path / "plan.toml"
    plan.write_text((ROOT / "rths/plans/two_dampers.toml").read_text() + PATIENT)
    words = (plan, "--duration", "3")
    here, there = "tcp/127.0.0.1:7447", f"tcp/{ADDRESS_A}:7447"
    processes = {
        "roof": start(first, "slave", *words, "--name", "roof", "--connect", here),
        "middle": start(second, "slave", *words, "--name", "middle", "--connect", there),
        "recorder": start(second, "record", *words, "--connect", there, "-o", path),
        "master": start(first, "master", *words, "--listen", "tcp/0.0.0.0:7447"),
    }
    await_all(processes)
    recording = read(path)
    for topic in ("master", "slave.roof", "slave.middle", "latency.roof", "latency.middle"):
        assert recording.sequences[topic].tolist() == list(range(1500))


def test_after_the_cable_is_pulled_both_end_with_exit_code_4(
    machines: tuple[str, str], tmp_path: Path
) -> None:
    first, second = machines
    plan = tmp_path / "plan.toml"
    plan.write_text(
        PATIENT
        + "[test]\nname = 'cable'\nduration = 60.0\n[link]\nloss_timeout = 0.3\n[recording]\nrequired = false\n"
    )
    slave = start(second, "slave", plan, "--connect", f"tcp/{ADDRESS_A}:7447")
    master = start(first, "master", plan, "--listen", "tcp/0.0.0.0:7447")
    try:
        for line in iter(master.stderr.readline, ""):  # type: ignore[union-attr]
            if re.match(r"t +0\.", line):
                break
        ip("-n", second, "link", "set", f"rvb{os.getpid()}", "down")
        for process, who in ((master, "The slave"), (slave, "The master")):
            _, err = process.communicate(timeout=HANG_S)
            assert process.returncode == 4, err
            assert f"{who} has been silent for 0.3 s." in err
            assert "Traceback" not in err
    finally:
        for process in (master, slave):
            process.kill()
            process.communicate()
