"""Judges the stability of the whole simulated loop by its free motion after a pulse of the ground.

The simulation includes all that the test has: integration, laboratories, compensators, the damper's control. The
sensors have no noise, and the pulse is small, so that a specimen keeps its initial stiffness.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from common.plan.plan import Plan
from common.plan.tables import SensorsTable
from laboratories.kinds import kinds_of
from loop.closed_loop import simulate
from loop.nominal.partition import matrices
from loop.signals import by_role
from models.indicators.growth import grows
from models.registry import Array
from models.structures import shear_building

# Periods of the first mode that are simulated. `grows` compares quarters of ten periods: a damping ratio of −0.05 %
# gives a growth by exp(2π·10·0.0005) = 1.03, above the ratio that counts.
PERIODS = 40
PULSE = (
    0.1  # length of the pulse over the first period: its spectrum reaches about ten times the first frequency
)
PUSH = 1e-3  # m/s², peak of the pulse: so small that a specimen keeps its initial stiffness
MOST_TICKS = 200_000  # of the simulated motion: 400 s at 2 ms, which take some hundredths of a second
METRES = "m"
SILENT = SensorsTable(*[0.0] * len(SensorsTable.__dataclass_fields__))


def unstable(plan: Plan) -> bool:
    """Whether the free motion of the nominal loop grows; raises InputError where a model or parameter is not valid."""
    period, interval = float(shear_building.modes(*matrices(plan)).periods[0]), plan.test.interval
    ticks = min(math.ceil(PERIODS * period / interval), MOST_TICKS)
    free = replace(plan.with_ticks(ticks), sensors=SILENT)
    pushed = max(round(PULSE * period / interval), 2)
    ground = np.zeros((2, ticks + 1))
    ground[0, : pushed + 1] = PUSH * np.sin(np.pi * np.arange(pushed + 1) / pushed)
    return any(grows(values[pushed:]) for values in moved(free, ground))


def moved(plan: Plan, ground: Array) -> list[Array]:
    """The motions (ticks, n) of the loop; a single one that is not finite where the loop diverges."""
    rollout = simulate(plan, ground)
    if not rollout.finite:
        return [np.full((plan.ticks, 1), math.nan)]
    found = [rollout.master["displacement"]]
    columns = by_role(plan, rollout)
    for role, kind in kinds_of(plan).items():
        channels = kind.channels
        moving = [
            row.name for row in channels.measured if row.unit == METRES and row.name != channels.position
        ]
        names = (channels.target.name, channels.command.name, *moving)
        found += [columns[role][name] for name in names]
    return found
