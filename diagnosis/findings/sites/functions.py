"""Whether what a reading shows is a function of what it reads, as an error of its sensor, or a force of its machine.

Both may change the same reading alone. A sensor errs by a function of the value that it reads and of what that was
before, or by a zero that drifts; a machine by a force that depends on its motion and speed. The force reaches the
reading through the machine's own dynamics: that of a damper moves a mass on a spring. Ridge regressions on either
predict stretches of time that they have not seen, and the likelihoods of these predictions tell the two apart.

More functions predict worse where few would do. So the few that both have are asked by themselves as well: a specimen
without mass and damping whose law bends is, to the last digit, a load cell whose scale bends, and neither is likelier.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from diagnosis.findings.sites.signatures import Signature, signatures
from diagnosis.fits import hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.noise import inputs
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals.noise import colour
from diagnosis.signals.predictors.ceiling import Crosswise
from diagnosis.signals.predictors.features import aged, bent, lagged, mixed, plays, scaled, slow, standardised
from diagnosis.signals.systematic import samples_per_sample
from models.registry import Array

# Share of a residual's energy beyond noise that functions must predict: slow noise looks a little like slow functions.
HALF = 0.5


def lead(fit: Fit, part: LaboratoryPart, sensor: str, machine: str) -> float:
    """Nats by which the residuals of a sensor's reading are likelier functions of it than forces at a machine.

    Zero where the machine has none that depends on a motion, and where what is left is a function of neither. If the
    machine errs, its true motion is what was read, or what was predicted, which has less noise, where it errs little.
    If the sensor errs, and where the machine's force moves nothing, it is what was predicted.
    """
    data, place = fit.data, [part.lab.sensor(name) for name in part.signals].index(sensor)
    interval = data.system.plan.test.interval * data.group
    system = hypothesis.lay(data, fit.z, fit.values)
    frequencies: Array = np.asarray(np.fft.rfftfreq(2 * data.groups, interval), dtype=np.float64)
    given = data.averaged(inputs.dependencies(data.part, system))
    others = np.delete(given, given.shape[1] - len(part.signals) + place, axis=1)
    said = np.nan_to_num(data.part.predict(system))
    read = said + data.residual(system)
    forced = [
        through(columns, way, place)
        for way in signatures(part, system, frequencies)
        if way.site == machine and way.motion is not None and np.any(way.readings[:, place])
        for motion in ((said, read) if np.any(way.readings[:, way.motion]) else (said,))
        for columns in of_motion(data.averaged(motion[:, way.motion]), others, interval)
    ]
    if not forced:
        return 0.0
    own = least(fit, place, of_reading(data.averaged(said[:, place])))
    other = least(fit, place, forced)
    whole = float(np.mean(np.square(fit.reduced[:, place])))
    left = min(float(np.mean(np.square(one))) for one in (own, other))
    return nats(own, other) if whole - left > HALF * (whole - 1.0) else 0.0


def nats(own: Array, other: Array) -> float:
    """Nats by which what is left (n,) is likelier noise than another that is (n,), both in σ.

    The noise is as loud as the quieter of the two, but at least of one σ: residuals are measured by what a model may
    err by as well, which must not be credited. Of noise that remembers fewer samples count.
    """
    one, two = float(np.mean(np.square(own))), float(np.mean(np.square(other)))
    likelier = own if one < two else other
    apart = abs(two - one) / max(1.0, min(one, two))
    return math.copysign(0.5 * own.size / samples_per_sample(likelier) * math.log1p(apart), two - one)


def of_reading(read: Array) -> Iterator[Array]:
    """Functions (n, …) of what is read (n,) and of what that was before, and these with slow ones of time."""
    simple = of_value(around(read[:, None]))
    yield simple
    yield np.hstack([simple, slow(read.size)])


def of_motion(motion: Array, others: Array, interval: float) -> Iterator[Array]:
    """The same functions (n, …) of a motion (n,), and these with ones of its speed, and of `others` (n, m) as well.

    These are what the laboratory was told and how its other readings change: what a mass or a motor makes of them. What
    is linear in all of them and in their past is asked by itself: a belt of the motor is no more.
    """
    value, beside = around(motion[:, None]), around(others)
    simple, speed = of_value(value), scaled(np.gradient(value, axis=0))
    linear = lagged(np.hstack([value, beside]), interval)
    yield simple
    yield linear
    own = [bent(speed), mixed(value, speed), aged(value, speed)]
    bend = scaled(np.gradient(speed, axis=0))
    yield np.hstack([simple, speed, bend, *own, bent(beside), linear])


def of_value(value: Array) -> Array:
    """Functions (n, …) of a value (n, 1), and of what that was before."""
    return np.hstack([value, bent(value), plays(value)])


def around(values: Array) -> Array:
    """Values (n, m) from their first ones, over their deviation."""
    return np.asarray((values - values[0]) / np.maximum(np.std(values, axis=0), 1e-300))


def through(forces: Array, way: Signature, place: int) -> Array:
    """What forces (n, m), zero before the first sample, do to the reading at a place: (n, m)."""
    count = len(forces)
    spectrum = np.fft.rfft(forces - forces[0], 2 * count, axis=0)
    response = way.readings[:, place] * (1.0 if way.receptance is None else way.receptance)
    return np.asarray(np.fft.irfft(spectrum * response[:, None], 2 * count, axis=0)[:count])


def least(fit: Fit, place: int, families: Iterable[Array]) -> Array:
    """What the best of several families of functions, each (n, …), leaves of a reading's residuals (n,)."""
    return min((remainder(fit, place, one) for one in families), key=lambda left: float(left @ left))


def remainder(fit: Fit, place: int, columns: Array) -> Array:
    """What functions (n, m), beside nominal parameters, leave of a reading's residuals (n,) that they have not seen."""
    if fit.data.factors is not None:
        factors = np.repeat(fit.data.factors[:, [place]], columns.shape[1], axis=1)
        columns = colour.whitened(columns, factors)
    left = fit.reduced[:, [place]]
    moved = fit.jacobian.reshape(*fit.reduced.shape, -1)[:, place, : fit.z.size]
    whole = standardised(np.hstack([columns, moved]), np.ones(len(columns), dtype=bool))
    return np.asarray((left - Crosswise(whole).predict(left))[:, 0])
