"""Whether the whole simulated loop is stable, judged by its free motion after one pulse of the ground.

Everything takes part that is in the test: integration, both laboratories, compensators, the damper's control. Sensors
are free of noise and the pulse is small, so that a specimen keeps its first stiffness.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from common.plan.plan import Plan
from common.plan.tables import SensorsTable
from laboratories.kinds import kinds_of
from loop.closed_loop import by_role, simulate
from loop.nominal.partition import matrices
from models.indicators.growth import grows
from models.registry import Array
from models.structures import shear_building

PERIODS = (
    40  # of the first mode that are watched: a loop of −0.05 % of damping or less then grows by what counts
)
PULSE = 0.1  # of the first period: its spectrum reaches to about ten times the first frequency
PUSH = 1e-3  # m/s², of the pulse: so small that a specimen keeps its first stiffness
MOST_TICKS = 200_000  # of the watched motion: 400 s at 2 ms, computed in some hundredths of a second
METRES = "m"
SILENT = SensorsTable(*[0.0] * len(SensorsTable.__dataclass_fields__))


def unstable(plan: Plan) -> bool:
    """Whether the free motion of the nominal loop grows; raises InputError where a model or parameter cannot be."""
    period, interval = float(shear_building.modes(*matrices(plan)).periods[0]), plan.test.interval
    ticks = min(math.ceil(PERIODS * period / interval), MOST_TICKS)
    free = replace(plan.with_ticks(ticks), sensors=SILENT)
    pushed = max(round(PULSE * period / interval), 2)
    ground = np.zeros((2, ticks + 1))
    ground[0, : pushed + 1] = PUSH * np.sin(np.pi * np.arange(pushed + 1) / pushed)
    return any(grows(values[pushed:]) for values in moved(free, ground))


def moved(plan: Plan, ground: Array) -> list[Array]:
    """What moves in the loop, by tick; a single row that is not finite where the loop diverges."""
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
