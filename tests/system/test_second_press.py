"""Ctrl-C twice in mid-motion, with real processes: the ramp to rest goes on to its end, and is recorded."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from common.recording.reader import read
from tests.processes import HANG_S, environment, tied

LAB = """
import json, pathlib

STIFFNESS = 12.5e6

class Column:
    def __init__(self, interval, seed, folder):
        self.folder, self.at = pathlib.Path(folder), 0.0
    def arm(self): pass
    def read(self): return self.at, STIFFNESS * self.at
    def write(self, command):
        self.at = command.actuator_command
        if abs(self.at) > 1.5e-3: (self.folder / "moving").touch()
    def disarm(self):
        (self.folder / "disarmed").write_text(json.dumps(STIFFNESS * self.at))

class Table:
    def __init__(self, interval, seed):
        self.at = 0.0
    def arm(self): pass
    def read(self): return self.at, 0.0, 0.0, 0.0
    def write(self, command): self.at = command.table_command
    def disarm(self): pass
"""
# Whatever the host does, nothing but the user may end this test; unloading takes two seconds and more.
PLAN = """
[test]
name = "pressed"
duration = 600.0
interval = 0.01
[compensator]
lead = 0.0
proportional = 0.0
integral = 0.0
derivative = 0.0
[safety]
hold_after = 50_000
ramp_after = 100_000
overrun = 100_000
velocity = 0.0007
[link]
connect_timeout = 150.0
loss_timeout = 60.0
[recording]
patience = 100.0
[preflight]
exchanges = 50
lost = 50
late_share = 1.0
[sensors]
column_displacement = 0.0
column_force = 0.0
table_displacement = 0.0
[limits]
actuator_velocity = inf
actuator_acceleration = inf
actuator_step = 1.0
table_velocity = inf
table_step = 1.0
column_error = inf
table_error = inf
error_energy = inf
numerical_drift = inf
damper_step = 1e5
[master.rig]
class = "lab.py:Column"
options = {{ folder = "{folder}" }}
[slave.rig]
class = "lab.py:Table"
"""


def appeared(path: Path, process: subprocess.Popen[str], seconds: float) -> None:
    """Wait for a file of the rig's."""
    deadline = time.monotonic() + seconds
    while not path.exists():
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.timeout(180)
def test_after_a_second_ctrl_c_the_specimen_is_unloaded_the_rig_disarmed_the_recording_complete(
    tmp_path: Path,
) -> None:
    (tmp_path / "lab.py").write_text(LAB)
    (tmp_path / "plan.toml").write_text(PLAN.format(folder=tmp_path))
    recording = tmp_path / "a.mcap"
    accepted = [word for risk in ("partition", "peaks") for word in ("--accept-risk", risk)]
    words = ["run", str(tmp_path / "plan.toml"), "-o", str(recording), "--rt", "off", *accepted]
    with subprocess.Popen(
        tied(sys.executable, "-m", "rths", *words),
        env=environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        appeared(tmp_path / "moving", process, 120.0)
        process.send_signal(signal.SIGINT)
        time.sleep(0.15)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=HANG_S)
    assert process.returncode == 3, err
    assert "already stopping; no laboratory is killed while it arms or is on its ramp to rest" in err
    assert err.rstrip().endswith("stopped by the user (SIGINT).")
    assert abs(json.loads((tmp_path / "disarmed").read_text())) < 300.0
    run = read(recording)
    assert run.metadata["summary"]["outcome"] == "stop"
    force = run.ramps["master"]["column_force"]
    assert abs(force[0]) > 3_000.0
    assert abs(force[-1]) < 300.0
