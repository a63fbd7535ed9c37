"""Steps of a sensor that noise was added to: what looks like noise of a reading follows from steps of its prediction.

A reading that was rounded before a logger added noise has no levels any more, but its error is still that of rounding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.findings.sensors import readings
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


def told(
    named: Sequence[readings.SensorFinding],
    noisy: Sequence[readings.SensorFinding],
    searches: Sequence[Search],
    record: Record,
) -> list[readings.SensorFinding]:
    """The findings `named`, with steps in the place of noise that follows from steps of the prediction.

    `noisy` are findings of noise of any colour, which what no effect explains may be as well.
    """
    noises = {item.effect: item for item in (*named, *noisy) if item.effect.endswith(".noise")}
    steps = {}
    for search in searches:
        rows = [
            (
                place,
                readings.effect_on(record, name, "noise"),
                readings.effect_on(record, name, "quantization"),
            )
            for place, name in enumerate(search.data.part.signals)
            if name in readings.read_by(record)
        ]
        rows = [row for row in rows if row[1] in noises]
        if not rows:
            continue
        system = hypothesis.lay(search.data, search.chosen.z, search.chosen.values)
        predicted, residual = search.data.part.predict(system), search.data.residual(system)
        for place, noise, quantization in rows:
            there = search.data.there[:, place] & np.isfinite(predicted[:, place])
            if stairs := staircase(predicted[there, place], residual[there, place]):
                bounds = (stairs.low, stairs.high)
                ratio = noises[noise].ratio
                steps[noise] = readings.SensorFinding(quantization, "step", stairs.step, bounds, ratio)
    kept = [item for item in named if item.effect not in steps]
    return [*kept, *steps.values()]


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
