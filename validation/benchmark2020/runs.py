"""One test of the benchmark: a setting on a case, a motion and a plant."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from common.plan.plan import Plan
from common.roles import MASTER
from laboratories.column import specimen
from laboratories.column.kind import COLUMN
from laboratories.sensors import noise
from loop import substructure
from loop.closed_loop import Rollout, simulate
from loop.nominal import response
from models import indicators
from models.registry import Array
from models.system import ColumnEffects, Effects
from validation.benchmark2020.criteria import Criteria, criteria, near, peak, rms
from validation.benchmark2020.problem import (
    EL_CENTRO,
    Motion,
    PartitionCase,
    draw,
    planned,
    with_plant,
)

# Times the reference's peak: larger targets and commands belong to unstable loops (ADR 0026). A stable loop's target is
# near the reference; its commands may be far larger, because compensators amplify noise.
RUNAWAY, ASTRAY = 10.0, 100.0
NOMINAL = 0  # the plant of the plan; 1, 2, … are drawn about it
LEAD_MOST = 0.05  # s, largest two-sided delay: twice that of the uncompensated transfer system


class Stage(NamedTuple):
    """Data that all tests of one case under one motion share."""

    case: PartitionCase
    motion: Motion
    plants: Sequence[Plan]  # the nominal one first; with the sample controller
    ground: Array
    reference: Array  # (ticks, floors) m: response of the whole building, computed
    noise: Array  # (ticks, 2) of the readings
    needed: Sequence[float]  # N, largest force of each plant's specimen under the reference's motion


class CellResult(NamedTuple):
    """Errors of one test against the reference, and the peaks that have limits; inf where the loop is unstable."""

    setting: str
    case: int
    motion: str
    plant: int
    stable: bool
    j4: float  # rms error of floor 1 as measured, over the reference's rms
    found: Criteria | None  # of stable tests on the nominal plant
    two_sided: float  # s, delay by correlation with either sign; nan without `found`
    noise_floor: float  # J2 of the displacement sensor's noise alone; nan without `found`
    force: float  # N, largest
    stroke: float  # m, largest


def stage(case: PartitionCase, motion: Motion, plants: int, seed: int) -> Stage:
    """Compute the reference of a case under a motion, and draw its plants and its noise."""
    plan = planned(case, motion)
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    levels = COLUMN.noise(plan)
    rows = noise.Noise(noise.lab_seed(plan.test.seed, noise.LAB_A), levels).rows(plan.ticks)
    others = [with_plant(plan, plant) for plant in draw(plan, plants, seed)]
    reference = response.response(plan, ground)
    first = reference[:, plan.column.storey - 1]
    all_plants = [plan, *others]
    needed = [peak(specimen_force(one, first)) for one in all_plants]
    return Stage(case, motion, all_plants, ground, reference, rows, needed)


def specimen_force(plan: Plan, displacement: Array) -> Array:
    """Force (n,) N of the linear specimen under a displacement (n,) m, by central differences."""
    column = plan.column
    elastic = column.stiffness * displacement
    return specimen.with_rates(column, ColumnEffects(), elastic, displacement, plan.test.interval)


def play(
    on: Stage, setting: str, chosen: Plan, plant: int = NOMINAL, effects: Effects | None = None
) -> tuple[CellResult, Rollout]:
    """One test on a stage, with the plan that has its plant and compensator."""
    first = on.reference[:, chosen.column.storey - 1]
    rollout = simulate(
        chosen, on.ground, effects=effects, slaves={}, noise={MASTER: on.noise}, farthest=ASTRAY * peak(first)
    )
    signals = {name: np.ascontiguousarray(values) for name, values in rollout.master.items()}
    target, measured = signals["column_target"], signals["column_displacement"]
    if not rollout.finite or peak(target) > RUNAWAY * peak(first):
        return unstable(on, setting, plant), rollout
    nominal, interval = plant == NOMINAL, chosen.test.interval
    result = CellResult(
        setting,
        on.case.number,
        on.motion.title,
        plant,
        True,
        near(measured, first),
        criteria(target, measured, signals["displacement"], on.reference, interval) if nominal else None,
        indicators.correlation_delay(target, measured, interval, LEAD_MOST) if nominal else math.nan,
        chosen.sensors.column_displacement / rms(target) if nominal else math.nan,
        peak(signals["column_force"]),
        peak(measured),
    )
    return result, rollout


def unstable(on: Stage, setting: str, plant: int) -> CellResult:
    """The result of an unstable loop."""
    none, worst = math.nan, math.inf
    return CellResult(
        setting,
        on.case.number,
        on.motion.title,
        plant,
        False,
        worst,
        None,
        none,
        none,
        worst,
        worst,
    )


def on_el_centro(results: Iterable[CellResult], setting: str) -> list[CellResult]:
    """The nominal tests of a setting under the motion of Table 3, by case."""
    return sorted(
        (
            item
            for item in results
            if (item.setting, item.motion, item.plant) == (setting, EL_CENTRO.title, NOMINAL)
        ),
        key=lambda item: item.case,
    )
