"""The closed loop of a plan without slaves: the building and laboratory A alone, for sweeps of many tests.

It is `closed_loop` without what concerns laboratory B, by the same kernels: of a building that carries no damper the
numbers are the same to the last bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from models.compiled import jit
from models.labs import column_lab, readings
from models.labs.column_lab import ColumnLab
from models.labs.readings import Readings
from models.loop import substructure
from models.loop.closed_loop import MEASURED_A, build_a, noise_a
from models.loop.substructure import ACTUATOR_COMMAND, COLUMN_TARGET, TABLE_TARGET, Substructure
from models.registry import Array
from models.system import Effects, System

FARTHEST = 1e6  # m, command from which on the loop has diverged: no laboratory is as large


class Loop(NamedTuple):
    """Everything that moves in the loop, at rest."""

    building: Substructure
    lab: ColumnLab
    sensors: Readings


class ColumnRollout(NamedTuple):
    """What a rollout gives, one row per tick; the rows from where the loop diverged are zero."""

    target: Array  # (ticks,) deformation wanted at the tick, m
    command: Array  # (ticks,) written at the tick, m
    displacement: Array  # (ticks,) measured, m
    force: Array  # (ticks,) measured, N
    floors: Array  # (ticks, n) displacements relative to the ground, m
    finite: bool  # False where the loop diverged
    ticks: int  # rows filled


def simulate(
    plan: Plan,
    ground: Array,
    *,
    effects: Effects | None = None,
    seed: int | None = None,
    noise: Array | None = None,
    farthest: float = FARTHEST,
) -> ColumnRollout:
    """Closed loop of a plan whose building carries no damper, with effects laid over its models where given.

    `ground` (2, ticks + 1) as `substructure.ground_rows` gives it. With a `seed` the sensors read what the emulated
    laboratory reads under that seed, with `noise` (ticks, 2) those rows in m and N are what errs in them; without
    either they are free of noise. A command that is not finite or beyond `farthest` (m) ends the loop.

    Raises:
        InputError: the plan has a damper or names its slaves, both a seed and noise are given, the noise has another
            shape, or a model, method or parameter is unknown to the registries.
    """
    if plan.control.amd or plan.slaves:
        raise InputError("The loop of laboratory A alone knows no damper: set amd in [control] to false.")
    system = System(plan, effects or Effects())
    errors = rows(system, seed, noise)
    loop = Loop(
        substructure.build(plan, ground, system.effects.p_delta, slaves=False),
        build_a(system),
        readings.build(plan.test.interval, MEASURED_A, system.effects.sensors),
    )
    ticks = plan.ticks
    motion, floors = np.zeros((ticks, 4)), np.zeros((ticks, plan.storeys))
    filled = roll(loop, errors, farthest, motion, floors)
    target, command, displacement, force = np.ascontiguousarray(motion.T)
    return ColumnRollout(target, command, displacement, force, floors, filled == ticks, filled)


def rows(system: System, seed: int | None, noise: Array | None) -> Array:
    """Noise of the readings, (ticks, 2)."""
    if noise is None:
        return noise_a(system, seed)
    if seed is not None:
        raise InputError("The noise is given twice, as rows and by a seed: leave one of them out.")
    if noise.shape != (system.plan.ticks, len(MEASURED_A)):
        raise InputError(
            f"The noise has the shape {noise.shape}: give one row per tick, {system.plan.ticks}, with displacement m "
            "and force N."
        )
    return np.ascontiguousarray(noise, dtype=np.float64)


@jit
def roll(loop: Loop, noise: Array, farthest: float, motion: Array, floors: Array) -> int:
    """Fill `motion` (ticks, 4) and `floors` (ticks, n) tick by tick; return how many ticks stayed finite."""
    building, sensors = loop.building, loop.sensors
    displacement, force = 0.0, 0.0
    interval = building.scalars[substructure.INTERVAL]
    for tick in range(motion.shape[0]):
        t = tick * interval
        measured = readings.step(sensors, 0, displacement, noise[tick, 0], t)
        felt = readings.step(sensors, 1, force, noise[tick, 1], t)
        substructure.advance(building, tick, measured, felt)
        command = building.output[ACTUATOR_COMMAND]
        if not abs(command) <= farthest:
            return tick
        motion[tick, 0] = building.output[COLUMN_TARGET]
        motion[tick, 1] = command
        motion[tick, 2] = measured
        motion[tick, 3] = felt
        for floor in range(floors.shape[1]):
            floors[tick, floor] = building.output[TABLE_TARGET + floor]
        displacement, force = column_lab.advance(loop.lab, command)
    return motion.shape[0]
