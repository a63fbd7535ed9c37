"""What a fit leaves unexplained: what is systematic in its residuals, and whether that is more than noise.

It is judged by sums over averaged samples, because noise averages out and systematic errors do not.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from diagnosis.fits import fitting, hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.noise import inputs, sensor_noise
from diagnosis.fits.noise.remainder import remainder
from diagnosis.fits.noise.sensor_noise import Foreseen
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.signals.noise.model import NoiseModel
from diagnosis.signals.predictors.ceiling import Crosswise
from diagnosis.signals.predictors.resonances import Resonances
from models.registry import Array

# The figures below were set on draws of `rths blind --set tune` (docs/decisions/0012-diagnosis.md), as a compromise
# between effects that are overlooked and effects that are named without a cause.
LEVELS = (1, 4, 16)  # averaged samples in a sum, from fast to slow systematic errors
MATERIAL = 0.12  # systematic residual over noise below which a gap would interest nobody
# The same of what follows from the inputs, where nothing larger is left: it is no noise whose level is known badly. Of
# 75 clean laboratories through loggers and in other code the largest that was sure was 0.075, beside pink noise.
FORESEEN = 0.085
# Standard deviations from which on it is no chance, with all signals and time scales looked at.
SIGNIFICANT = 5.0

BOTH = 2.0  # solutions with an error of their own: the laboratory's and the replay's


class SystematicGap(NamedTuple):
    """What is systematic in one signal's residual."""

    ratio: float  # rms of the systematic part over that of the noise
    significance: float  # standard deviations above white noise


def gap(reduced: Array, group: int, noise: NoiseModel | None = None) -> SystematicGap:
    """Systematic part of averaged residuals (groups,) in σ: what their sums over time exceed noise by.

    How well the noise itself is known, and how heavy its tails are, goes into the standard error.
    """
    known, tails = (noise.samples, noise.tails) if noise else (math.inf, 1.0)
    ratio, significance = 0.0, 0.0
    for level in LEVELS:
        count = reduced.size // level
        if count < 8:
            continue
        sums = reduced[: count * level].reshape(count, level).sum(axis=1) / math.sqrt(level)
        excess = float(np.mean(sums**2)) - 1.0
        error = math.sqrt(2.0 * tails**2 / count + 2.0 * tails**2 * level / known)
        significance = max(significance, excess / error)
        ratio = max(ratio, math.sqrt(max(0.0, excess - 3.0 * error) / (level * group)))
    return SystematicGap(ratio, significance)


def gaps(fit: Fit, group: int) -> list[SystematicGap]:
    """The systematic part of the residual of every signal."""
    noises = fit.data.noise or (None,) * fit.reduced.shape[1]
    return [gap(column, group, noise) for column, noise in zip(fit.reduced.T, noises, strict=True)]


def remaining(fit: Fit) -> float:
    """Largest systematic residual over noise that a fit leaves."""
    return max((item.ratio for item in gaps(fit, fit.data.group)), default=0.0)


def model_error(fit: Fit) -> Array:
    """What two good solutions of one model may differ by, (signals,) over σ; zero where the part is exact."""
    if fit.data.part.exact:
        return np.zeros(fit.data.sigma.size)
    return np.asarray(BOTH * fit.data.good / fit.data.sigma)


def leaves(fit: Fit, allowed: Array | None = None) -> bool:
    """Whether a fit leaves more than noise: the test of a residual that is white, of unit variance, where it is noise.

    Its sums over time must not exceed noise, and where the noise is coloured nothing of it may follow from the inputs.
    What is `allowed` in each signal (signals,), over σ, does not count.
    """
    least = np.maximum(MATERIAL, np.zeros(fit.data.sigma.size) if allowed is None else allowed)
    found: list[tuple[SystematicGap | Foreseen, float]] = [
        *zip(gaps(fit, fit.data.group), least, strict=True)
    ]
    if sensor_noise.coloured(fit.data):
        found += zip(sensor_noise.foreseen(fit), least, strict=True)
    return any(exceeds(item, limit) for item, limit in found)


def exceeds(found: SystematicGap | Foreseen, limit: float) -> bool:
    """Whether what is systematic in a signal is larger than a limit, over noise, and no chance."""
    return found.ratio > limit and found.significance > SIGNIFICANT


def foresees(fit: Fit, allowed: Array) -> bool:
    """Whether more of a residual follows from the inputs than is allowed in its signal (signals,), over σ.

    So small a gap is found sooner by what causes it than by its energy, which must exceed that of the noise. It
    does not count in a building whose forces a logger recorded, as their delay is known to a part of an interval only.
    """
    if isinstance(fit.data.part, LoggedBuilding):
        return False
    return is_foreseen(sensor_noise.foreseen(fit), allowed)


def is_foreseen(found: list[Foreseen], allowed: Array) -> bool:
    """Whether what inputs say of the residual of any signal is more than is allowed in it (signals,), over σ."""
    least = np.maximum(FORESEEN, allowed)
    return any(exceeds(item, limit) for item, limit in zip(found, least, strict=True))


def resonant(fit: Fit) -> Crosswise | None:
    """What may follow from a part's inputs with the resonance that its residual shows; None where it shows none.

    The resonance is looked for in the residual as it is, and taken away from what counts as noise. Then it must be
    foreseen of a residual that is whitened with this noise, stretch by stretch from frequencies and sizes that are
    found elsewhere, by more than two good solutions of one model may differ by.
    """
    data, part = fit.data, fit.data.part
    if part.exact or isinstance(part, LoggedBuilding) or data.related is None:
        return None
    system = hypothesis.lay(data, fit.z, fit.values)
    given = data.averaged(inputs.inputs(part, system))
    if data.related.count != len(given):
        return None
    resonances = Resonances(given, data.system.plan.test.interval * data.group)
    left = remainder(data, system).noise / data.sigma
    related = data.related.beside(resonances.columns(left))
    beside = fitting.at(sensor_noise.modelled(replace(data, related=related), system), fit.values, fit.z)
    found = sensor_noise.told(beside, resonances.predict(beside.reduced))
    return related if is_foreseen(found, model_error(beside)) else None
