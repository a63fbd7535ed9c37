"""The closed loop of a test with several slaves: compiled kernels, stepped one tick after the other."""

from __future__ import annotations

import math
from operator import add
from typing import Any

import numpy as np

from common.plan.plan import MOST_SLAVES, Plan
from models import compensators
from models.compiled import plain
from models.labs import column_lab, noise, table_lab
from models.loop import substructure
from models.loop.closed_loop import MEASURED_A, MEASURED_B, build_a, build_b
from models.loop.substructure import ACTUATOR_COMMAND, SENT, TABLE_TARGET
from models.registry import Array
from models.system import System

SENT_NAMES = (
    "table_target",
    "damper_command",
    "table_target_velocity",
    "table_target_acceleration",
    "table_target_jerk",
)
DAMPER_FORCE = MEASURED_B.index("damper_force")
PLACES = range(TABLE_TARGET, TABLE_TARGET + SENT * MOST_SLAVES, SENT)  # of what is sent, in the output row


class Slave:
    """Laboratory B of one slave with its table's compensator, from rest."""

    def __init__(self, plan: Plan, place: int, seed: int) -> None:
        chosen, self._interval = plan.table.compensator, plan.test.interval
        follow = compensators.build(chosen.kind, chosen.parameters, self._interval, plan.follows_in)
        self._follow, self._lab = plain(follow), plain(build_b(System(plan)))
        levels = noise.levels_b(plan.sensors)
        self._noise = noise.Noise(noise.lab_seed(seed, noise.LAB_B + place), levels)
        self._target, self._true = 0.0, (0.0,) * len(MEASURED_B)

    def tick(self, sent: list[float]) -> list[float]:
        """Readings at a tick and the table's command for its end; `sent` in its message's order."""
        measured = list(map(add, self._true, self._noise.row()))
        target, motor, velocity, acceleration, jerk = sent
        wanted = target, velocity, acceleration, jerk, self._target, measured[0]
        written = compensators.enter(self._follow, *wanted, self._interval)
        self._target = target
        self._true = table_lab.enter(self._lab, written, motor)
        return [*measured, written]


def simulate(plan: Plan, ground: Array, seed: int) -> dict[str, Array]:
    """Signals of a plan with several slaves by name: (ticks,), per storey (ticks, n), per slave (ticks, slaves).

    `ground` as `substructure.ground_rows` gives it; sensors read what the emulated laboratories read under the seed.
    Where the loop diverges the signals end before the first command that is not finite.
    """
    master, lab = substructure.build(plan, ground), plain(build_a(System(plan)))
    building = plain(master)
    slaves = [Slave(plan.of(role), place, seed) for place, role in enumerate(plan.roles)]
    errors = noise.Noise(noise.lab_seed(seed, noise.LAB_A), noise.levels_a(plan.sensors))
    true, used = (0.0,) * len(MEASURED_A), master.dampers[substructure.FORCE_USED]
    outputs, read_a, rows_b = [], [], []
    for tick in range(plan.ticks):
        measured = list(map(add, true, errors.row()))
        substructure.enter(building, tick, *measured)
        output = master.output.tolist()
        if not math.isfinite(output[ACTUATOR_COMMAND]):
            break
        true = column_lab.enter(lab, output[ACTUATOR_COMMAND])
        rows = [
            slave.tick(output[place : place + SENT]) for place, slave in zip(PLACES, slaves, strict=False)
        ]
        for place, row in enumerate(rows):
            used[place] = row[DAMPER_FORCE]
        outputs.append(output)
        read_a.append(measured)
        rows_b.append(rows)
    shape = (len(outputs), len(slaves), len(MEASURED_B) + 1)
    named = zip((*MEASURED_B, "table_command"), np.moveaxis(np.reshape(rows_b, shape), 2, 0), strict=True)
    found = signals(plan, np.reshape(outputs, (len(outputs), master.output.size)))
    return found | dict(zip(MEASURED_A, np.reshape(read_a, (-1, 2)).T, strict=True)) | dict(named)


def signals(plan: Plan, outputs: Array) -> dict[str, Any]:
    """The master's outputs by name."""
    storeys = TABLE_TARGET + SENT * len(plan.roles)
    found = {
        "ground_acceleration": outputs[:, substructure.GROUND_ACCELERATION],
        "column_target": outputs[:, substructure.COLUMN_TARGET],
        "actuator_command": outputs[:, substructure.ACTUATOR_COMMAND],
    }
    for place, name in enumerate(SENT_NAMES):
        found[name] = outputs[:, TABLE_TARGET + place : storeys : SENT]
    for place, name in enumerate(substructure.STOREY_ROWS):
        start = storeys + place * plan.storeys
        found[name] = outputs[:, start : start + plan.storeys]
    return found
