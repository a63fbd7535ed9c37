"""`rths serve` as a user starts it, in real time, with a client that ends well and one that is killed."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from common.recording.reader import read
from tests.helpers import PATIENT, ROOT
from tests.processes import HANG_S
from tests.serve.client import free_port

CLIENT = ROOT / "benchmarks" / "opensees" / "client.py"
PLAN = '[test]\nname = "served"\n[slave]\nkind = "none"\n[compensator]\nkind = "none"\n' + PATIENT
STEPS = 500


def started(folder: Path, steps: int) -> tuple[subprocess.Popen[str], subprocess.Popen[str]]:
    """The server and its client."""
    (folder / "served.toml").write_text(PLAN)
    port = free_port()
    command = [sys.executable, "-m", "rths", "serve", str(folder / "served.toml"), "--beside"]
    command += ["--opensees", f"127.0.0.1:{port}", "-o", str(folder / "test.mcap")]
    server = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    client = subprocess.Popen(
        [sys.executable, str(CLIENT), str(port), str(steps)], stdout=subprocess.PIPE, text=True
    )
    return server, client


@pytest.mark.slow
def test_a_test_in_real_time_ends_with_its_client(tmp_path: Path) -> None:
    server, client = started(tmp_path, STEPS)
    with server, client:
        said, complaint = server.communicate(timeout=HANG_S)
        assert client.wait(timeout=HANG_S) == 0
    assert server.returncode == 0, complaint
    assert "outcome: completed" in said
    of = read(tmp_path / "test.mcap").columns["master"]
    assert of["client_step"][-1] == STEPS
    assert np.count_nonzero(np.isfinite(of["client_force"])) >= STEPS - 1


@pytest.mark.slow
def test_a_client_that_is_killed_in_real_time_is_reported_in_one_sentence(tmp_path: Path) -> None:
    server, client = started(tmp_path, 100_000)
    with server, client:
        assert server.stderr is not None
        for line in server.stderr:
            if line.startswith("t "):  # it runs
                break
        client.send_signal(signal.SIGKILL)
        said, complaint = server.communicate(timeout=HANG_S)
    assert server.returncode == 4
    last = complaint.strip().splitlines()[-1]
    assert last.startswith("rths: The client at 127.0.0.1:")
    assert " is lost: " in last  # closed, or reset where something was still on its way
    assert last.endswith(".")
    run = read(tmp_path / "test.mcap")
    assert run.finished
    assert run.ramps["master"]["mode"][-1] == "safe"
    assert "missing" in said
