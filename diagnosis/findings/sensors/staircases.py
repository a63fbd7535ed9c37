"""Steps of a sensor that noise was added to: what looks like noise of a reading follows from steps of its prediction.

A reading that was rounded before a logger added noise has no levels any more, but its error is still that of rounding.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
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
# Share of the noise that steps must explain: what a prediction errs blurs them, and those of another size explain less
# than nothing.
SHARE = 0.25
PART = 0.1  # of a step, that a reading moves on from one sample that is looked at to the next
ENOUGH = 200  # such samples, without which nothing is said of steps
AT_ONCE = 100_000  # samples of residuals that are looked at side by side
COARSEST = 0.5  # of the largest reading, above which steps look like a bend of the scale


@dataclass(frozen=True)
class Stairs:
    """A step with the range in which it lies; all in the reading's unit."""

    step: float
    low: float
    high: float


def hidden(search: Search, record: Record) -> dict[str, Stairs]:
    """Steps of a part's readings that noise hides, by signal: of readings that err far more than their sensors' noise.

    Both what the effects found predict and what the plan predicts inside its tolerances may show them.
    """
    read, data, found = readings.read_by(record), search.data, {}
    planned = record.planned_noise
    for fit in (search.commissioned, search.chosen):
        system = hypothesis.lay(data, fit.z, fit.values)
        predicted, residual = data.part.predict(system), data.residual(system)
        for place, name in enumerate(data.part.signals):
            there = data.there[:, place] & np.isfinite(predicted[:, place])
            if name not in read or name in found or not there.any():
                continue
            usual = max(planned.get(name, 0.0), float(data.rounded[place]))
            if float(np.std(residual[there, place])) < readings.LOUDER * usual:
                continue
            if stairs := staircase(predicted[there, place], residual[there, place]):
                found[name] = stairs
    return found


def findings(hidden: Mapping[str, Stairs], record: Record, *, logged: bool) -> list[readings.SensorFinding]:
    """Sensors that round to `hidden` steps; of a recording that was logged (`logged`), its converter made fine ones."""
    planned = record.planned_noise
    result = []
    for name, stairs in hidden.items():
        noise, usual = stairs.step / math.sqrt(12.0), planned.get(name, 0.0)
        if logged and noise < readings.CONVERTER * float(np.max(np.abs(record.signals[name]))):
            continue
        effect, bounds = readings.effect_on(record, name, "quantization"), (stairs.low, stairs.high)
        ratio = noise / usual if usual > 0.0 else 0.0
        result.append(readings.SensorFinding(effect, "step", stairs.step, bounds, ratio))
    return result


def staircase(predicted: Array, residual: Array) -> Stairs | None:
    """The step to which a reading was rounded before noise was added; None where rounding does not explain it.

    `predicted` and `residual` (ticks,) are the reading without steps and what was measured beyond it. They are looked
    at where the reading has moved on by a part of a step, because where it rests any error is that of some step.
    """
    usual = math.sqrt(12.0) * float(np.std(residual))
    if usual == 0.0:
        return None
    moved = np.cumsum(np.abs(np.diff(predicted, prepend=predicted[0]))) // (PART * usual)
    on_way = np.flatnonzero(np.diff(moved, prepend=0.0))
    if on_way.size < ENOUGH:
        return None
    predicted, residual = predicted[on_way], residual[on_way]
    reach = float(np.max(np.abs(predicted)))
    count = min(TRIED, 16 + math.ceil(math.log(MOST / LEAST) * reach / (LEAST * usual * APART)))
    steps = usual * np.geomspace(LEAST, MOST, count)
    steps = steps[steps < COARSEST * reach]
    left = variances(predicted, residual, steps)
    best = int(np.argmin(left)) if steps.size else 0
    if not steps.size or left[best] > (1.0 - SHARE) * np.var(residual):
        return None
    near = np.linspace(steps[max(best - 1, 0)], steps[min(best + 1, steps.size - 1)], count)
    left = variances(predicted, residual, near)
    step = float(near[np.argmin(left)])
    # the place of the outermost level is known as well as the reading there
    half = step * math.sqrt(float(np.min(left))) / reach + float(near[1] - near[0])
    return Stairs(step, step - half, step + half)


def variances(predicted: Array, residual: Array, steps: Array) -> Array:
    """Variance of a residual (ticks,) once the rounding of a reading (ticks,) to each step is taken away, (steps,)."""
    several = max(1, AT_ONCE // predicted.size)
    parts = np.array_split(steps, math.ceil(steps.size / several)) if steps.size else []
    rounded = (part[:, None] * np.round(predicted / part[:, None]) for part in parts)
    whole = predicted + residual
    return np.concatenate([np.zeros(0), *(np.var(whole - error, axis=1) for error in rounded)])
