"""How fast the clock of readings runs against that of the commands, and readings put onto the commands' clock.

A reading of a clock that is fast by ε is the true one at t·(1 + ε): y + ε·t·ẏ. Of effects in a laboratory none moves
all readings of all laboratories like that.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from diagnosis.signals.mask import Mask
from models.registry import Array

BLOCKS = 12  # of a recording, by which the error of a rate is told
SURE, ALONE = 6.0, 4.0  # standard errors of a common rate, and of the rate that each laboratory says
USUALLY_SURE, USUALLY_ALONE = 4.0, 2.0  # the same of a rate up to `QUARTZ`, which needs less to be believed
QUARTZ = 6e-5  # of a rate: what a quartz errs by at most as a rule
AT_LEAST = 2  # readings of a laboratory by itself
MOST = 1e-3  # of a rate: a quartz errs by less than a tenth of it
TAPS = 16  # samples on each side of an interpolation
KAISER = 8.0  # shape of its window: errors below 1e-4 up to three quarters of the highest frequency


class Rate(NamedTuple):
    """By how much a clock is fast, with its standard error."""

    fast: float
    error: float


def rate(measured: Array, predicted: Array, there: Mask, interval: float) -> Rate | None:
    """The rate that one reading (ticks,) says, where `there`; None for one that does not move.

    Least squares of measured − predicted on t·ẏ, ẏ, y and one, which a delay, a gain and an offset go into; the error
    is that of a jackknife over blocks of time.
    """
    size = float(np.std(predicted))
    if size == 0.0 or np.count_nonzero(there) < there.size / 2:
        return None
    t = interval * np.arange(predicted.size)
    change = np.gradient(predicted, interval)
    columns = np.column_stack([t * change, change, predicted, np.ones_like(t)])[there]
    scale = np.sqrt(np.mean(np.square(columns), axis=0))
    columns, rest = columns / scale, (measured - predicted)[there]
    pieces = list(zip(np.array_split(columns, BLOCKS), np.array_split(rest, BLOCKS), strict=True))
    squares = np.array([x.T @ x for x, _ in pieces])
    sides = np.array([x.T @ y for x, y in pieces])
    left_out = [
        np.linalg.lstsq(squares.sum(0) - s, sides.sum(0) - v)[0][0]
        for s, v in zip(squares, sides, strict=True)
    ]
    every = np.linalg.lstsq(squares.sum(0), sides.sum(0))[0][0]
    error = np.sqrt((BLOCKS - 1) * np.mean(np.square(np.array(left_out) - np.mean(left_out))))
    return Rate(float(every / scale[0]), float(error / scale[0]))


def common(laboratories: Sequence[Sequence[Rate]]) -> float:
    """The rate that the readings of several laboratories agree on, 0 where they do not, or say nothing for sure.

    Those of one laboratory by itself, of which there must be several, tell no more than the rate of a quartz: no
    machine slows down so little and so evenly, and if one did it would be within its tolerances.

    A nominal model that errs moves each reading's rate by more than its blocks of time show. So where rates scatter by
    more than their errors, all errors are larger by as much, as in R. T. Birge, Physical Review 40 (1932), 207-227.
    """
    there = [rates for rates in laboratories if rates]
    single = there[0] if len(there) == 1 else []
    if not there or (single and len(single) < AT_LEAST):
        return 0.0
    larger = scatter([one for rates in laboratories for one in rates])
    known = [[Rate(one.fast, larger * one.error) for one in rates] for rates in laboratories if rates]
    said = [together(rates) for rates in known]
    every = [one for rates in known for one in rates]
    found = together(every)
    usual = abs(found.fast) < QUARTZ
    least, least_alone = (USUALLY_SURE, USUALLY_ALONE) if usual and not single else (SURE, ALONE)
    if single and not (usual and all(one.fast * found.fast > 0.0 for one in known[0])):
        return 0.0
    sure = abs(found.fast) > least * found.error and abs(found.fast) < MOST
    alone = all(one.fast * found.fast > 0.0 and abs(one.fast) > least_alone * one.error for one in said)
    agree = all(abs(one.fast - found.fast) < ALONE * np.hypot(one.error, found.error) for one in every)
    return found.fast if sure and alone and agree else 0.0


def scatter(rates: Sequence[Rate]) -> float:
    """By how much rates scatter about their mean over what their errors say, one at least."""
    mean = together(rates).fast
    square = sum(((one.fast - mean) / max(one.error, 1e-15)) ** 2 for one in rates)
    return max(1.0, float(np.sqrt(square / max(1, len(rates) - 1))))


def together(rates: Sequence[Rate]) -> Rate:
    """The mean of rates, each weighted by its error."""
    weights = np.array([1.0 / max(one.error, 1e-15) ** 2 for one in rates])
    mean = float(weights @ np.array([one.fast for one in rates]) / weights.sum())
    return Rate(mean, float(1.0 / np.sqrt(weights.sum())))


def put_right(x: Array, fast: float, *, stepped: bool, early: float = 0.0) -> Array:
    """A reading (ticks,) of a clock that is fast by a rate, or `early` by so many ticks, on the clock of the ticks.

    By a windowed sinc, which leaves white noise its level up to 2 %; on straight lines where the reading is `stepped`,
    so that its steps remain where neighbours are equal.
    """
    places = (np.arange(x.size) - early) / (1.0 + fast)
    if stepped:
        return np.asarray(np.interp(places, np.arange(x.size), x))
    whole = np.floor(places).astype(np.int64)
    offsets = np.arange(1 - TAPS, TAPS + 1)
    apart = (places - whole)[:, None] - offsets
    window = np.i0(KAISER * np.sqrt(np.maximum(1.0 - (apart / TAPS) ** 2, 0.0)))
    weights = np.sinc(apart) * window
    weights /= weights.sum(axis=1)[:, None]
    around = np.clip(whole[:, None] + offsets, 0, x.size - 1)
    return np.asarray(np.sum(weights * x[around], axis=1))
