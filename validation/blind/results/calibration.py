"""Whether stated probabilities agree with observed frequencies."""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import betaincinv

from common.errors import InputError
from models.registry import Array


class Reliability(NamedTuple):
    """Stated and observed frequency per bin of the stated probability."""

    stated: Array  # (bins,) mean probability, nan where the bin is empty
    observed: Array  # (bins,) share that was correct, nan where the bin is empty
    cases: Array  # (bins,)


def wilson(successes: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Wilson score interval of a proportion.

    Source: Wilson, J. Am. Stat. Assoc. 22 (1927).

    Raises:
        InputError: no cases, or more successes than cases.
    """
    if n < 1 or not 0 <= successes <= n:
        raise InputError(f"{successes} successes of {n} cases are no proportion.")
    z = NormalDist().inv_cdf(0.5 + 0.5 * level)
    share, scale = successes / n, 1.0 + z * z / n
    centre = (share + z * z / (2 * n)) / scale
    half = z / scale * math.sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n))
    low = 0.0 if successes == 0 else centre - half
    high = 1.0 if successes == n else centre + half
    return low, high


def clopper_pearson(successes: int, n: int, level: float = 0.95) -> tuple[float, float]:
    """Exact interval of a proportion: it holds the true one at least as often as its level, however few the cases.

    Source: Clopper and Pearson, Biometrika 26 (1934).

    Raises:
        InputError: no cases, or more successes than cases.
    """
    if n < 1 or not 0 <= successes <= n:
        raise InputError(f"{successes} successes of {n} cases are no proportion.")
    tail = 0.5 * (1.0 - level)
    low = float(betaincinv(successes, n - successes + 1, tail)) if successes else 0.0
    high = float(betaincinv(successes + 1, n - successes, 1.0 - tail)) if successes < n else 1.0
    return low, high


def reliability(probabilities: Array, correct: ArrayLike, bins: int = 10) -> Reliability:
    """Stated probability and share correct in equal bins of the former.

    `probabilities` (n,) in 0…1, `correct` (n,) true or false.

    Raises:
        InputError: shapes do not fit, nothing given, or a value is no probability.
    """
    stated, came = paired(probabilities, correct)
    place = np.minimum((stated * bins).astype(np.int64), bins - 1)
    count = np.bincount(place, minlength=bins).astype(np.float64)
    with np.errstate(invalid="ignore"):
        means = np.bincount(place, stated, bins) / count
        shares = np.bincount(place, came, bins) / count
    return Reliability(means, shares, count)


def expected_calibration_error(probabilities: Array, correct: ArrayLike, bins: int = 10) -> float:
    """Mean distance of stated and observed frequency over the bins, weighted by their cases.

    Source: Naeini, Cooper and Hauskrecht, AAAI (2015).

    Raises:
        InputError: as `reliability`.
    """
    table = reliability(probabilities, correct, bins)
    held = table.cases > 0
    apart = np.abs(table.stated - table.observed)[held]
    return float(apart @ table.cases[held] / table.cases.sum())


def brier(probabilities: Array, correct: ArrayLike) -> float:
    """Mean squared distance of the stated probability from what came true.

    Source: Brier, Monthly Weather Review 78 (1950).

    Raises:
        InputError: as `reliability`.
    """
    stated, came = paired(probabilities, correct)
    return float(np.mean((stated - came) ** 2))


def paired(probabilities: Array, correct: ArrayLike) -> tuple[Array, Array]:
    """Both as floats, checked."""
    stated = np.asarray(probabilities, dtype=np.float64)
    came = np.asarray(correct, dtype=np.float64)
    if stated.ndim != 1 or stated.size == 0 or stated.shape != came.shape:
        raise InputError(f"Probabilities {stated.shape} and outcomes {came.shape} are no pairs.")
    if not np.all((stated >= 0.0) & (stated <= 1.0)):
        raise InputError("A probability lies outside 0 to 1.")
    return stated, came
