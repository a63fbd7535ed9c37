"""Functions that several tests use."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from common.plan import read as plans
from common.plan.plan import Plan
from common.reality.reality import as_planned
from simulation import virtual
from simulation.virtual import VirtualTest

ROOT = Path(__file__).resolve().parent.parent

# no limit on how far a rig may jump after a pause
JUMPS = """
[limits]
actuator_velocity = inf
actuator_acceleration = inf
actuator_step = inf
table_velocity = inf
table_step = inf
damper_step = inf
table_acceleration = 1000.0
damper_stroke = 10.0
"""

# for tests of something else on machines that are shared: a laboratory that is held up goes on, though its rig jumps
PATIENT = (
    """
[safety]
hold_after = 60000
ramp_after = 70000
overrun = 60000
[preflight]
lost = 1000
late_share = 1.0
"""
    + JUMPS
)

# a heavy building that sways so slowly that an interval of 40 ms computes it well: no machine is held up for as long
SLOW = """
[test]
name = "slow"
duration = 8.0
interval = 0.04
[ground_motion]
scale = 0.01
[structure]
mass = 16e6
damping = 2e6
"""
SLOW_TOWER = (
    SLOW.replace("16e6", "[16e6, 16e6, 16e6]").replace("2e6", "[1e7, 1e7, 1e7]")
    + """stiffness = [126e6, 126e6, 126e6]
[column]
stiffness = 63e6
"""
)

# a structure whose stiffness is a full matrix, with a specimen that has a mass, on servo-hydraulics
SERVO_PLAN = """
[test]
name = "servo"
duration = 2.5
interval = 0.000244140625
[ground_motion]
scale = 0.4
[structure]
mass = [1000.0, 1000.0, 1000.0]
stiffness = [
    [26.0549e6, -23.1339e6, 5.9370e6],
    [-23.1339e6, 32.5608e6, -14.4200e6],
    [5.9370e6, -14.4200e6, 9.2673e6],
]
damping_ratio = 0.05
integrator = "rk4"
[structure.experimental]
mass = 29.13
stiffness = 1.19e6
damping = 114.6
[column]
stiffness = 1.19e6
mass = 29.13
damping = 114.6
columns_per_storey = 1
deformation_ratio = 1.0
[actuator]
model = "servo_hydraulic"
command = "held"
[compensator]
kind = "pid"
proportional = 2.0
integral = 95.0
derivative = 0.0
[compensator.force]
unit_delay = true
[control]
amd = false
[sensors]
column_displacement = 1.6e-5
column_force = 2.2
[limits]
actuator_velocity = 5.0
actuator_acceleration = inf
[recording]
required = false
"""


def with_table(base: Plan, table: str, **values: object) -> Plan:
    """A plan with some keys of one table changed."""
    tables = base.tables()
    tables[table] |= values
    return plans.from_tables(tables, base.base)


def without_recorder(base: Plan) -> Plan:
    """A plan that runs without a recorder."""
    return dataclasses.replace(base, recording=dataclasses.replace(base.recording, required=False))


def largest(values: object) -> float:
    """Largest magnitude of an array."""
    return float(np.max(np.abs(np.asarray(values))))


def patient(folder: Path) -> Path:
    """A file with the default test and limits that a paused machine does not exceed."""
    path = folder / "patient.toml"
    path.write_text(
        PATIENT + "[link]\nconnect_timeout = 150.0\nloss_timeout = 60.0\n[recording]\npatience = 100.0\n"
    )
    return path


def running(test: Plan, ticks: int) -> VirtualTest:
    """A test in virtual time that stops after this many ticks of all laboratories."""
    bench = virtual.assemble(test, as_planned(test), None)
    virtual.play(bench, pause=lambda: all(loop.ticks >= ticks for loop in bench.loops.values()))
    return bench
