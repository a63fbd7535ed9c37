"""Bands of the predicted signals and of their peaks, and the chance that a limit is passed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from common.roles import MASTER
from common.terminal.telling import Tell, untold
from laboratories import kinds
from loop.closed_loop import Rollout
from loop.nominal import limited, partition
from loop.signals import by_role, signals
from models.ground_motion import GroundMotion
from models.registry import Array
from simulation.prediction import rest
from simulation.prediction.draws import Ensemble, FoundLaboratories, ensemble, has_random_links
from simulation.prediction.rest import RangeSeen

HELD = 0.9  # share of the time for which a signal should lie within its band
LOW, HIGH = 0.5 * (1.0 - HELD), 0.5 * (1.0 + HELD)
DRAWS = 64  # three draws beyond each end of the band; with the default test they take a few seconds
# Fewest draws with which both ends of a band of 90 % lie between the smallest and the largest draw: (n + 1)·0.05 must
# be at least 1.
LEAST = 20


class PeakBand(NamedTuple):
    """The largest magnitude of a quantity over the test: low, median and high of the draws."""

    low: float
    median: float
    high: float
    unit: str


class LimitChance(NamedTuple):
    """How close a quantity comes to a limit of the plan, and in how many draws it passes the limit."""

    peak: PeakBand
    limit: float
    passed: int


@dataclass(frozen=True)
class Prediction:
    """The predicted test: ends and median of the band of every signal, its peaks and its limits."""

    plan: Plan
    low: Rollout
    # Of the laboratories as found, without noise; the median of those drawn where links are random, or where the test
    # of the laboratories as found is unstable.
    middle: Rollout
    high: Rollout
    peaks: dict[str, PeakBand]  # by signal as recordings name them
    drifts: dict[int, PeakBand]  # by storey that a laboratory follows
    limits: dict[str, LimitChance]
    reaches: dict[str, RangeSeen]  # by role
    draws: int
    diverged: int
    sentences: tuple[str, ...]
    motion: GroundMotion


def predict(found: FoundLaboratories, plan: Plan, count: int = DRAWS, tell: Tell = untold) -> Prediction:
    """The test of a plan in laboratories as found, from `count` of them drawn under the plan's seed.

    Raises:
        InputError: too few of them reach the end of the test for a band.
    """
    if count < LEAST:
        raise InputError(f"{count} laboratories are too few for a band: draw at least {LEAST}.")
    drawn = ensemble(found, count, tell)
    if len(drawn.drawn) < LEAST:
        raise InputError(
            f"No prediction is possible, because the test is unstable in {drawn.diverged} of the {count} laboratories "
            "drawn: choose another compensator or a weaker motion."
        )
    as_found = drawn.central.finite and not has_random_links(found.truth)
    middle = drawn.central if as_found else quantile(drawn.drawn, 0.5)
    reach = rest.reaches(plan, middle, found.spread)
    rollouts = erring(found, plan, drawn, reach)
    low, high = (quantile(rollouts, level) for level in (LOW, HIGH))
    return Prediction(
        plan,
        low,
        middle,
        high,
        peaks(plan, rollouts),
        drifts(plan, rollouts),
        chances(plan, rollouts, drawn.diverged),
        reach,
        count,
        drawn.diverged,
        (*about(found, drawn, count), *rest.sentences(reach, plan.test.interval)),
        drawn.motion,
    )


def about(found: FoundLaboratories, drawn: Ensemble, count: int) -> list[str]:
    """What was left out, and what diverged, in sentences."""
    result = []
    if found.left_out:
        result.append(
            f"{', '.join(found.left_out)} belongs to another building than this plan's and is left out."
        )
    if not drawn.central.finite:
        result.append(
            "In the laboratories as found the test is unstable: the middle of the band is the median of those drawn."
        )
    if drawn.diverged:
        result.append(f"The test is unstable in {drawn.diverged} of the {count} laboratories drawn.")
    if not found.spread.rest:
        result.append(
            "The diagnosed recording holds no response of the building, so the band does not include the part of the "
            "gap that is unexplained."
        )
    return result


def erring(
    found: FoundLaboratories, plan: Plan, drawn: Ensemble, reach: Mapping[str, RangeSeen]
) -> list[Rollout]:
    """The rollouts with an error added to each signal, for the part of the gap that the diagnosis left unexplained."""
    random = np.random.default_rng([plan.test.seed, 1])
    tolerance = plan.tolerances.default

    def wrong(role: str, name: str, series: Array) -> Array:
        if not np.any(series) or (role == MASTER and name == "ground_acceleration"):
            return series
        factor, more = rest.growth(reach, role, tolerance)
        share = np.hypot(rest.share_of(found.spread, role, name) * np.asarray(factor), more)
        return series + rest.errors(series, share if np.ndim(share) else float(share), random)

    stacked = mapped(drawn.drawn, wrong)
    return [taken(one, stacked, place) for place, one in enumerate(drawn.drawn)]


Stacked = tuple[dict[str, Array], dict[str, dict[str, Array]]]  # of the master and of the slaves by role


def mapped(rollouts: Sequence[Rollout], change: Callable[[str, str, Array], Array]) -> Stacked:
    """Every signal of all rollouts in one array (draws, ticks, …), changed by a function of role, name and array."""
    first = rollouts[0]
    master = {
        name: change(MASTER, name, np.stack([one.master[name] for one in rollouts])) for name in first.master
    }
    slaves = {
        role: {
            name: change(role, name, np.stack([one.slaves[role][name] for one in rollouts])) for name in own
        }
        for role, own in first.slaves.items()
    }
    return master, slaves


def taken(like: Rollout, stacked: Stacked, place: int) -> Rollout:
    """One rollout from stacked signals."""
    master, slaves = stacked
    return like._replace(
        master={name: values[place] for name, values in master.items()},
        slaves={role: {name: values[place] for name, values in own.items()} for role, own in slaves.items()},
    )


def quantile(rollouts: Sequence[Rollout], level: float) -> Rollout:
    """The quantile of the draws at a level (0 to 1), tick by tick.

    With Weibull's plotting positions, (n + 1)·level, one more draw lies below it with the probability `level`.
    """

    def of_draws(_role: str, _name: str, series: Array) -> Array:
        return np.asarray(np.quantile(series, level, axis=0, method="weibull"))[None]

    return taken(rollouts[0], mapped(rollouts, of_draws), 0)


def band(values: Sequence[float], unit: str) -> PeakBand:
    """Low, median and high of the draws of one number."""
    low, median, high = np.quantile(np.asarray(values), (LOW, 0.5, HIGH), method="weibull")
    return PeakBand(float(low), float(median), float(high), unit)


def peaks(plan: Plan, rollouts: Sequence[Rollout]) -> dict[str, PeakBand]:
    """Bands of the largest magnitude of every signal."""
    rows = {row.name: row for topic in reversed(kinds.topics(plan).values()) for row in topic}
    every = [signals(plan, one) for one in rollouts]
    result = {}
    for name in every[0]:
        unit = rows[name.rpartition(".")[2]].unit
        if unit not in ("", "s"):
            result[name] = band([float(np.max(np.abs(one[name]))) for one in every], unit)
    return result


def drifts(plan: Plan, rollouts: Sequence[Rollout]) -> dict[int, PeakBand]:
    """Bands of the largest drift of every storey that a laboratory follows."""
    result = {}
    for role, coupling in partition.drifts(plan).items():
        direction = partition.drift_direction(plan, role)
        tops = [
            float(np.max(np.abs(one.master["displacement"].reshape(one.ticks, plan.storeys) @ direction)))
            for one in rollouts
        ]
        result[coupling.place] = band(tops, "m")
    return result


def chances(plan: Plan, rollouts: Sequence[Rollout], diverged: int) -> dict[str, LimitChance]:
    """How close the draws come to the limits of the plan; a draw that diverges counts as beyond every limit."""
    most = limited.most(plan)
    tops: dict[str, list[float]] = {}
    for one in rollouts:
        for name, values in limited.magnitudes(plan, by_role(plan, one)).items():
            tops.setdefault(name, []).append(float(np.max(values, initial=0.0)))
    return {
        name: LimitChance(
            band(values, limited.unit_of(plan, name)),
            most[name],
            diverged + sum(not value <= most[name] for value in values),
        )
        for name, values in tops.items()
    }


def plain(found: Prediction) -> dict[str, Any]:
    """The prediction's figures as plain values for JSON."""
    limits = {
        name: one.peak._asdict() | {"limit": one.limit, "passed_in": one.passed, "draws": found.draws}
        for name, one in found.limits.items()
        if math.isfinite(one.limit)
    }
    return {
        "test": found.plan.test.name,
        "ground_motion": found.motion.describe(),
        "scale": found.plan.ground_motion.scale,
        "ticks": found.plan.ticks,
        "band": HELD,
        "draws": found.draws,
        "diverged": found.diverged,
        "peaks": {name: one._asdict() for name, one in found.peaks.items()},
        "peak_drifts": {str(storey): one._asdict() for storey, one in found.drifts.items()},
        "limits": limits,
        "beyond_seen": {
            role: {
                "signal": one.signal,
                "ratio": one.ratio,
                "since": one.since(found.plan.test.interval),
                "energy_outside": one.outside,
            }
            for role, one in found.reaches.items()
        },
        "readings": {role: list(kind.channels.names) for role, kind in kinds.kinds_of(found.plan).items()},
        "sentences": list(found.sentences),
    }
