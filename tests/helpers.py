"""What several tests use."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from common import plan
from common.plan import Plan

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
"""

# for tests of something else on machines that are shared: a laboratory that is held up goes on, though its rig jumps
PATIENT = (
    """
[safety]
hold_after = 3000
ramp_after = 5000
overrun = 5000
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


def with_table(base: Plan, table: str, **values: object) -> Plan:
    """A plan with some keys of one table changed."""
    tables = base.tables()
    tables[table] |= values
    return plan.from_tables(tables, base.base)


def without_recorder(base: Plan) -> Plan:
    """A plan that runs without a recorder."""
    return dataclasses.replace(base, recording=dataclasses.replace(base.recording, required=False))


def largest(values: object) -> float:
    """Largest magnitude of an array."""
    return float(np.max(np.abs(np.asarray(values))))


def patient(folder: Path) -> Path:
    """A file with the default test, which no machine that is held up ends."""
    path = folder / "patient.toml"
    path.write_text(PATIENT)
    return path
