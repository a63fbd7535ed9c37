"""Steps of a sensor that noise was added to: what looks like noise of a reading follows from steps of its prediction.

A reading that was rounded before a logger added noise has no levels any more, but its error is still that of rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.findings.readings import SensorFinding, effect_on
from diagnosis.fits import hypothesis
from diagnosis.fits.search import Search
from diagnosis.recorded.record import Record
from models.registry import Array

# Steps that are tried, over the one whose error is as large as the noise: it is a part of it.
LEAST, MOST = 0.5, 1.3
# Share of a step by which the outermost level of two steps tried may differ, and most steps that are tried.
APART, TRIED = 0.1, 4000
HALF = 0.5  # share of the noise that steps must explain; those of another size explain less than nothing


@dataclass(frozen=True)
class Stairs:
    """A step with the range in which it lies; all in the reading's unit."""

    step: float
    low: float
    high: float


def told(found: Sequence[SensorFinding], searches: Sequence[Search], record: Record) -> list[SensorFinding]:
    """The findings on sensors, with steps in the place of noise that follows from steps of the prediction."""
    result = list(found)
    for search in searches:
        fit, part = search.chosen, search.data.part
        predicted = residual = None
        for place, name in enumerate(part.signals):
            noisy = [item for item in result if item.effect == effect_of(record, name, "noise")]
            if not noisy:
                continue
            if predicted is None or residual is None:
                system = hypothesis.lay(search.data, fit.z, fit.values)
                predicted, residual = part.predict(system), search.data.residual(system)
            there = search.data.there[:, place] & np.isfinite(predicted[:, place])
            stairs = staircase(predicted[there, place], residual[there, place])
            if stairs is not None:
                effect = effect_on(record, name, "quantization")
                bounds = (stairs.low, stairs.high)
                result[result.index(noisy[0])] = SensorFinding(
                    effect, "step", stairs.step, bounds, noisy[0].ratio
                )
    return result


def effect_of(record: Record, name: str, fault: str) -> str:
    """The effect of a fault on a reading, empty where no laboratory measures it."""
    measured = any(name in lab.measured for lab in record.labs)
    return effect_on(record, name, fault) if measured else ""


def staircase(predicted: Array, residual: Array) -> Stairs | None:
    """The step to which a reading was rounded before noise was added; None where rounding does not explain it.

    `predicted` and `residual` (ticks,) are the reading without steps and what was measured beyond it.
    """
    usual = math.sqrt(12.0) * float(np.std(residual))
    reach = float(np.max(np.abs(predicted), initial=0.0))
    if usual == 0.0 or reach == 0.0:
        return None
    count = min(TRIED, 16 + math.ceil(math.log(MOST / LEAST) * reach / (LEAST * usual * APART)))
    steps = usual * np.geomspace(LEAST, MOST, count)
    left = np.array([np.var(residual - error(predicted, step)) for step in steps])
    best = int(np.argmin(left))
    if left[best] > (1.0 - HALF) * np.var(residual):
        return None
    near = np.linspace(steps[max(best - 1, 0)], steps[min(best + 1, count - 1)], count)
    left = np.array([np.var(residual - error(predicted, step)) for step in near])
    step = float(near[np.argmin(left)])
    # the place of the outermost level is known as well as the reading there
    half = step * math.sqrt(float(np.min(left))) / reach + float(near[1] - near[0])
    return Stairs(step, step - half, step + half)


def error(predicted: Array, step: float) -> Array:
    """What rounding to a step adds to a reading (ticks,)."""
    return np.asarray(step * np.round(predicted / step) - predicted)
