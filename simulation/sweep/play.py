"""The tests of a sweep, many in a task."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from common.errors import InputError, PlanError
from common.plan.plan import Plan
from common.reality.reality import from_reality
from common.roles import MASTER
from loop.closed_loop import Rollout, simulate
from loop.of_reality import refuse_plugins, rolled_out
from loop.realised import true_slaves, true_system
from loop.substructure import ground_rows
from models.ground_motion import GroundMotion
from models.ground_motion.motions import load
from models.registry import Array
from simulation.sweep import luggage, measures, rows
from simulation.sweep.definition import Sweep
from simulation.sweep.intensity import spectral_acceleration
from simulation.sweep.luggage import Luggage
from simulation.sweep.rows import Row
from simulation.workers.batch import Batch
from simulation.workers.threads import one_thread
from simulation.workers.versions import versions

SIZE = 64  # tests in a task: a quarter of a second of 40 s tests, so that sending them costs about 1 %

MOST_STAGES = 4  # of a worker of a cluster, which serves one sweep after the other; each may hold 10 MB


class Task(NamedTuple):
    """The tests `number · SIZE` and following of a sweep."""

    luggage: Luggage
    digest: str  # of all that the rows depend on; a worker recognizes the luggage by it
    number: int


class Excitation(NamedTuple):
    """A ground motion as a test of the sweep uses it, and its intensity."""

    rows: Array  # (2, ticks + 1), of `loop.substructure.ground_rows`
    acceleration: float  # m/s², peak
    spectral: float  # m/s², 0 where no period is given


class SweepStage:
    """What the tests of a sweep share on one machine."""

    def __init__(self, given: Luggage) -> None:
        self.sweep: Sweep = luggage.unpacked(given)
        self.reality: Mapping[str, Any] = given.reality
        self.motions: dict[int, GroundMotion] = {}
        self.excitation = lru_cache(maxsize=32)(self._excitation)

    def motion(self, place: int) -> GroundMotion:
        """The record at this place of the sweep's list, unscaled; raises InputError where it cannot be read."""
        if place not in self.motions:
            one = self.sweep.motions[place]
            given = one.ground_motion
            self.motions[place] = load(given["record"], one.base, given["dt"], given["unit"])
        return self.motions[place]

    def _excitation(self, place: int, scale: float, interval: float, duration: float) -> Excitation:
        plan = self.sweep.plan
        test = replace(plan.test, interval=interval, duration=duration)
        scaled = replace(plan, test=test, ground_motion=replace(plan.ground_motion, scale=scale))
        ground = ground_rows(scaled, self.motion(place))
        given = self.sweep.intensity
        strong = (
            spectral_acceleration(ground[0], interval, given.period, given.damping_ratio)
            if given.period
            else 0.0
        )
        return Excitation(ground, float(np.max(np.abs(ground[0]))), strong)


@lru_cache(maxsize=1)
def stages() -> dict[str, SweepStage]:
    """The stages that this process has made, by the digest of their tasks."""
    return {}


def batch(task: Task) -> Batch:
    """Compute the tests of a task.

    Raises:
        InputError: a test cannot be computed; the sentence names it.
    """
    kept = stages()
    if task.digest not in kept:
        while len(kept) >= MOST_STAGES:
            kept.pop(next(iter(kept)), None)
        kept[task.digest] = SweepStage(task.luggage)
    stage = kept.get(task.digest) or SweepStage(task.luggage)  # another thread may have taken it out
    first = task.number * SIZE
    numbers = range(first, min(first + SIZE, stage.sweep.rows))
    with one_thread():
        found = [test(stage, rows.row(stage.sweep, number)) for number in numbers]
    return Batch(task.number, {name: [one[name] for one in found] for name in found[0]})


def test(stage: SweepStage, one: Row) -> dict[str, Any]:
    """A row of the table."""
    sweep = stage.sweep
    try:
        plan = rows.plan_of(sweep, one)
        strong = stage.excitation(one.motion, one.scale, plan.test.interval, plan.test.duration)
        found = measures.measured(plan, rollout(stage, plan, one, strong))
    except InputError as error:
        raise type(error)(f"Test {one.number} of the sweep: {error}") from None
    motion = stage.motion(one.motion)
    return {
        "row": one.number,
        "compensator": sweep.compensators[one.compensator].name,
        **{name: as_cell(value) for name, value in rows.values(sweep, one).items()},
        "motion": sweep.motions[one.motion].ground_motion["record"],
        "scale": one.scale,
        "draw": one.draw,
        "pga": strong.acceleration,
        **({"sa": strong.spectral} if sweep.intensity.period else {}),
        **found,
        "plan": plan.digest(),
        "seed": plan.test.seed,
        "record": motion.version,
        "versions": versions(),
    }


def rollout(stage: SweepStage, plan: Plan, one: Row, strong: Excitation) -> Rollout:
    """The closed loop of a test: of nominal models, or of the laboratories of the reality."""
    noise = stage.sweep.head.noise
    if not stage.reality:
        return simulate(plan, strong.rows, seed=plan.test.seed if noise else None)
    try:
        truth = replace(from_reality(dict(stage.reality), plan, stage.sweep.base), seed=plan.test.seed)
    except PlanError as error:
        raise PlanError(f"The reality {stage.sweep.head.reality}: {error}") from None
    refuse_plugins(truth)
    systems = {MASTER: true_system(truth)} | true_slaves(truth)
    return rolled_out(truth, systems, stage.motion(one.motion), noise=noise)


def as_cell(value: object) -> object:
    """A value of the plan as a cell of the table: a number, text or truth value; others as JSON."""
    return value if isinstance(value, str | bool | int | float) else json.dumps(value)
