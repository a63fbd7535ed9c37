"""Of descriptions that leave much of a gap, a simpler one that tells the strongest part of the motion from the weaker.

Under one motion a law with many parameters imitates a mechanism that it is not: it leaves less than a law with few that
is nearer to the truth, and holds nowhere else. What is fitted to a weaker motion and judged on a stronger one shows it,
as another recording would. Where a fit leaves little, its law is right and the fit decides.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from diagnosis.fits import fitting, worth
from diagnosis.fits.fitting import Fit, excess
from diagnosis.fits.hypothesis import Problem
from diagnosis.fits.laws import path
from diagnosis.fits.unexplained import remaining
from diagnosis.signals.mask import Mask

WEAKER = 0.7  # of the largest deformation: the motion until it is first exceeded is the weaker part
LEAST = (
    200  # averaged samples of the weaker part, 1.6 s: fewer do not hold the parameters of a law of yielding
)
MUCH = 0.05  # of the gap, from which on a fit leaves much: concrete that cracks, named as pinched yielding, left 0.13
CLEARLY = 0.8  # of what a fit misses in the strongest part: another one must miss less than this
TRIED = 3  # of such fits, best first
STEPS, ROUNDS = 8, 2  # of a fit to the weaker part


def holding(bare: Fit, chosen: Fit, others: Iterable[Fit]) -> Fit:
    """The chosen fit, or where that leaves much a simpler one that clearly tells the strongest part better."""
    if remaining(chosen) < worth.LOUD or excess(chosen) < MUCH * min(excess(bare), bare.data.energy):
        return chosen
    train = weaker(chosen)
    if train is None:
        return chosen
    rivals = {
        item.names: item for item in sorted(others, key=lambda item: -item.cost) if simpler(item, chosen)
    }
    leading = sorted(rivals.values(), key=lambda item: item.cost)[:TRIED]
    told = [(foretold(item, train), item) for item in leading]
    least, best = min(told, key=lambda item: item[0], default=(np.inf, chosen))
    return best if least < CLEARLY * foretold(chosen, train) else chosen


def simpler(fit: Fit, than: Fit) -> bool:
    """Whether a fit moves fewer parameters of effects than another one."""
    return len(Problem(fit.data, fit.values).frees) < len(Problem(than.data, than.values).frees)


def weaker(fit: Fit) -> Mask | None:
    """Averaged samples (groups,) before the motion first comes near its largest; None where that part is too short."""
    data = fit.data
    way = path(data.part)
    if way is None or way[0].size != len(data.part.measured):
        return None
    far = np.abs(way[0][: data.groups * data.group]).reshape(data.groups, data.group).max(axis=1)
    result = np.maximum.accumulate(far) < WEAKER * far.max()
    return result if LEAST <= np.sum(result) < data.groups else None


def foretold(fit: Fit, train: Mask) -> float:
    """What a fit misses beyond the samples `train` (groups,) once its parameters are fitted to these alone."""
    data = replace(fit.data, train=train)
    return fitting.fit(data, fit.values, fit.z, STEPS, rounds=ROUNDS).cost
