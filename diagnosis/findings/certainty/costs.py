"""Probabilities from what fits cost: of alternatives, and of effects beside nominal parameters that are far off.

The figures were set on draws of `rths blind --set tune` (docs/decisions/0012-diagnosis.md).
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from diagnosis.fits.fitting import Fit
from diagnosis.fits.search import Search
from diagnosis.fits.worth import DATA_GAIN, PRIOR_GAIN

TEMPERATURE = 3.0  # by which differences of cost are divided, since what a model leaves is not quite white
# Standard deviations of Σ z² above its mean from which on the nominal parameters speak against the effects beside them.
STRAINED = 3.0
# Stand-ins per true name among the verdicts that leave nothing: 5 of 78 were wrong (ADR 0052).
FALSE = 0.06


def odds(search: Search) -> list[float]:
    """How probable each alternative is, over the chosen effects."""
    chosen = search.chosen
    noise = max(1.0, chosen.chi / chosen.data.size)
    return over((other.cost for other in search.alternatives), chosen.cost, noise)


def over(costs: Iterable[float], cost: float, noise: float) -> list[float]:
    """How probable fits of some costs are, over one of a `cost` and none more than that.

    `noise` is the mean square of what is left, in σ².
    """
    worse = (max((one - cost) / noise, 0.0) for one in costs)
    return [math.exp(-min(one / (2.0 * TEMPERATURE), 700.0)) for one in worse]


def certainty(search: Search) -> float:
    """Probability that there is an effect at all: 0.5 at the limit of the search, towards one far above it.

    It is smaller where nominal parameters that are all far off beside the effects imitate another one.
    """
    before, after = search.commissioned, search.chosen
    margin = max(before.prior - after.prior, 0.0) / PRIOR_GAIN + max(before.chi - after.chi, 0.0) / DATA_GAIN
    return (1.0 - 0.5 * math.exp(-(margin - 1.0))) * strain(search) * farthest(after)


def strain(search: Search) -> float:
    """Factor on the probability of effects, which falls as the nominal parameters beside them move further off."""
    z = search.chosen.z
    usual = z.size + STRAINED * math.sqrt(2.0 * z.size)
    return math.exp(-max(search.chosen.prior - usual, 0.0) / (2.0 * TEMPERATURE))


def farthest(fit: Fit) -> float:
    """Factor on the probability of effects beside which one nominal parameter is far off, 1 where none is.

    By Bayes: the share of laboratories that have a parameter as far off, over that share and `FALSE`, as a stand-in may
    push a parameter anywhere.
    """
    usual = math.erf(float(np.max(np.abs(fit.z), initial=0.0)) / math.sqrt(2.0))
    chance = 1.0 - usual**fit.z.size
    return (1.0 + FALSE) * chance / (chance + FALSE) if fit.z.size else 1.0
