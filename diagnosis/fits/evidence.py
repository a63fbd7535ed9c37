"""Which of two hypotheses explains a residual better where each has a noise of its own: effects, or coloured noise.

Both are weighed by Whittle's likelihood and Schwarz's criterion, −2·log of the probability of the data:

    Σ (residual/σ)² + Σ log(density) + Σ z² + k·log(N)

over the lines of the spectrum of each signal, with k parameters of effects and noise and N averaged samples.

Source: P. Whittle, Arkiv för Matematik 2 (1953); G. Schwarz, Annals of Statistics 6 (1978).
"""

from __future__ import annotations

import math

import numpy as np

from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Problem
from diagnosis.signals.noise import colour
from diagnosis.signals.noise.model import NoiseModel

OF_LINE = 3  # parameters of a narrow line: frequency, amplitude and phase


def surprise(fit: Fit) -> float:
    """−2·log of how probable the data are under a fit and the noise that it is measured by, up to a constant."""
    data = fit.data
    volume = 2.0 * data.groups * float(np.sum(np.log(data.sigma)))
    if data.factors is not None:
        volume -= 2.0 * float(np.sum(np.log(data.factors)))
    for known in (data.resting, data.louder):
        volume += 0.0 if known is None else 2.0 * float(np.sum(np.log(known)))
    models = data.noise or (None,) * data.sigma.size
    free = len(Problem(data, fit.values).frees) + sum(map(parameters, models))
    return float(np.sum(fit.reduced**2)) + volume + fit.prior + free * math.log(data.groups)


def parameters(noise: NoiseModel | None) -> int:
    """How many numbers a noise model was given by the residual."""
    if noise is None:
        return 1
    coloured = noise.order + colour.SLOW_MOST + 1 if noise.density is not None else 0
    return 1 + coloured + OF_LINE * len(noise.lines)
