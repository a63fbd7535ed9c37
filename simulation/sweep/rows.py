"""The tests of a sweep by their number, and the plan of each."""

from __future__ import annotations

import zlib
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from common.plan import read as plans
from common.plan.plan import Plan
from simulation.sweep.definition import DrawnTable, Sweep, changed, value_at


class Row(NamedTuple):
    """One test of a sweep; `combination`, `compensator` and `motion` are places in the sweep's lists."""

    number: int
    compensator: int
    combination: int
    motion: int
    scale: float
    draw: int


def row(sweep: Sweep, number: int) -> Row:
    """The test of this number, from 0."""
    rest, draw = divmod(number, sweep.head.draws)
    rest, point = divmod(rest, sweep.points)
    compensator, combination = divmod(rest, sweep.combinations)
    motion = 0
    while point >= len(sweep.motions[motion].scales):
        point -= len(sweep.motions[motion].scales)
        motion += 1
    return Row(number, compensator, combination, motion, sweep.motions[motion].scales[point], draw)


def combination(sweep: Sweep, place: int) -> dict[str, Any]:
    """The values of the parameters in the combination at this place, by the key of the plan."""
    found: dict[str, Any] = {}
    for name, values in reversed(list(sweep.parameters.items())):  # the last one changes fastest
        place, at = divmod(place, len(values))
        found[name] = values[at]
    return dict(reversed(list(found.items())))


def draw(sweep: Sweep, number: int) -> dict[str, float]:
    """The factors on the drawn parameters of one laboratory, by the key of the plan.

    A draw is the same in every combination, and does not depend on which other parameters are drawn.
    """
    return {
        name: factor(one, (sweep.head.seed, number, zlib.crc32(name.encode())))
        for name, one in sweep.drawn.items()
    }


def factor(drawn: DrawnTable, seed: tuple[int, ...]) -> float:
    """A factor on a parameter's value, drawn under a seed: lognormal of median 1, normal or uniform of mean 1."""
    random = np.random.default_rng(seed)
    if drawn.distribution == "uniform":
        return float(random.uniform(1.0 - drawn.dispersion, 1.0 + drawn.dispersion))
    unit = float(random.standard_normal())
    return (
        float(np.exp(drawn.dispersion * unit))
        if drawn.distribution == "lognormal"
        else 1.0 + drawn.dispersion * unit
    )


def plan_of(sweep: Sweep, one: Row) -> Plan:
    """The plan of a test, checked like that of a file.

    Raises:
        PlanError: a value is out of its range, or does not fit another one.
    """
    tables = dict(sweep.written)
    compensator = sweep.compensators[one.compensator]
    if compensator.keys:
        tables["compensator"] = {"force": tables["compensator"]["force"], **compensator.keys}
    for name, value in values(sweep, one).items():
        changed(tables, name, value)
    motion = sweep.motions[one.motion]
    tables["ground_motion"] = tables["ground_motion"] | dict(motion.ground_motion) | {"scale": one.scale}
    tables["test"] = tables["test"] | {"seed": sweep.plan.test.seed + one.draw}
    found = plans.from_tables(tables, sweep.plan.base)
    return replace(found, follows_in=sweep.plan.follows_in)


def values(sweep: Sweep, one: Row) -> dict[str, Any]:
    """The values that a test has for the parameters and the drawn parameters, by the key of the plan."""
    found = combination(sweep, one.combination)
    for name, by in draw(sweep, one.draw).items():
        value = value_at(name, sweep.written)
        found[name] = [by * item for item in value] if isinstance(value, list) else by * value
    return found
