"""Fragility: the chance that a limit is passed, as a function of a motion's intensity.

The curve is the lognormal distribution `P(x) = Φ(ln(x/θ)/β)`, fitted by maximum likelihood to how many tests passed
the limit at each intensity: J. W. Baker, Efficient analytical fragility function fitting using dynamic structural
analysis, Earthquake Spectra 31 (2015) 579-599.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from models.registry import Array

Passed = NDArray[np.bool_]

Z_90 = 1.6448536269514722  # the normal distribution's 95 % point: both ends of an interval of 90 %
STEPS = 100  # of Fisher's scoring; it needs about ten, because the likelihood is concave
LEAST = 0.5  # fewest expected tests on either side of a level whose share is judged
SMALL = 1e-10  # of a step, in units of ln(intensity)


class Fragility(NamedTuple):
    """A lognormal curve with intervals of 90 %; median and dispersion are NaN where no curve can be fitted."""

    median: float  # θ, the intensity at which the chance is one half
    dispersion: float  # β, standard deviation of the logarithm
    median_interval: tuple[float, float]
    dispersion_interval: tuple[float, float]
    tests: int
    passed: int
    why_not: str = ""  # a sentence where no curve can be fitted
    agreement: float = math.nan  # probability that shares of tests on the curve lie as far from it as these

    @property
    def fitted(self) -> bool:
        """Whether there is a curve."""
        return not self.why_not


class Stripe(NamedTuple):
    """The tests at one intensity."""

    intensity: float
    tests: int
    passed: int

    @property
    def share(self) -> float:
        """The share of tests that passed the limit."""
        return self.passed / self.tests


def stripes(intensity: Array, passed: Passed) -> list[Stripe]:
    """The tests (n,) grouped by their intensity, the lowest first."""
    levels, place = np.unique(intensity, return_inverse=True)
    tests, over = np.bincount(place), np.bincount(place, weights=passed)
    return [Stripe(float(x), int(n), int(k)) for x, n, k in zip(levels, tests, over, strict=True)]


def chance(curve: Fragility, intensity: Array) -> Array:
    """The chance that the limit is passed at intensities (n,) above 0."""
    return np.asarray(special.ndtr(np.log(intensity / curve.median) / curve.dispersion))


def fit(intensity: Array, passed: Passed) -> Fragility:
    """The curve of greatest likelihood for tests (n,) at intensities above 0, each of which passed the limit or not.

    With `a + b·ln x` for `ln(x/θ)/β` this is a probit regression, whose likelihood is concave; it has a maximum unless
    an intensity separates the tests that pass from those that do not (A. Albert, J. A. Anderson, On the existence of
    maximum likelihood estimates in logistic regression models, Biometrika 71 (1984)). Intervals follow from Fisher's
    information for independent tests.
    """
    found = stripes(intensity, passed)
    tests, over = intensity.size, int(np.count_nonzero(passed))
    if why := no_maximum(found):
        return Fragility(math.nan, math.nan, NEITHER, NEITHER, tests, over, why)
    x = np.log([one.intensity for one in found])
    n, k = (np.array([one[place] for one in found], dtype=np.float64) for place in (1, 2))
    a, b, covariance = probit(x, n, k)
    if b <= 0.0:
        why = "the chance does not grow with the intensity"
        return Fragility(math.nan, math.nan, NEITHER, NEITHER, tests, over, why)
    median, dispersion = math.exp(-a / b), 1.0 / b
    slope = np.array([-1.0 / b, a / b**2])  # of ln θ by a and b
    wide = Z_90 * math.sqrt(float(slope @ covariance @ slope))
    spread = Z_90 * math.sqrt(covariance[1, 1]) / b  # of ln β
    return Fragility(
        median,
        dispersion,
        (median * math.exp(-wide), median * math.exp(wide)),
        (dispersion * math.exp(-spread), dispersion * math.exp(spread)),
        tests,
        over,
        agreement=agreement(a + b * x, n, k),
    )


NEITHER = (math.nan, math.nan)


def no_maximum(found: list[Stripe]) -> str:
    """Why the likelihood has no maximum, empty where it has one."""
    over = [one.intensity for one in found if one.passed]
    under = [one.intensity for one in found if one.passed < one.tests]
    if not over:
        return "the limit is passed in no test"
    if not under:
        return "the limit is passed in every test"
    if max(under) <= min(over):
        return f"the limit is passed from {min(over):.4g} on and nowhere below {max(under):.4g}: the curve is a step"
    return ""


def probit(x: Array, n: Array, k: Array) -> tuple[float, float, Array]:
    """The coefficients a, b of `Φ(a + b·x)` and their covariance (2, 2), for k of n tests that passed at x (m,).

    Fisher's scoring with halved steps where the likelihood would fall.
    """
    design = np.stack([np.ones_like(x), x])
    share = np.clip(k / n, 0.5 / n, 1.0 - 0.5 / n)
    found = np.array(np.polyfit(x, special.ndtri(share), 1, w=np.sqrt(n))[::-1])
    before = likelihood(found @ design, n, k)
    for _ in range(STEPS):
        score, information = at(found @ design, n, k, design)
        step = np.linalg.solve(information, score)
        while (now := likelihood((found + step) @ design, n, k)) < before and np.max(np.abs(step)) > SMALL:
            step = 0.5 * step
        found, before = found + step, now
        if np.max(np.abs(step)) <= SMALL * max(1.0, float(np.max(np.abs(found)))):
            break
    covariance = np.asarray(np.linalg.inv(at(found @ design, n, k, design)[1]), dtype=np.float64)
    return float(found[0]), float(found[1]), covariance


def agreement(eta: Array, n: Array, k: Array) -> float:
    """Probability of a deviance as large as that of k of n tests from the chances Φ(η), 1 where two levels fix both.

    Levels at which less than `LEAST` tests are expected on one side carry no information; they are left out.
    """
    p = special.ndtr(eta)
    telling = (n * np.minimum(p, 1.0 - p) >= LEAST) | (k != np.round(n * p))
    n, k, p = n[telling], k[telling], p[telling]
    if n.size <= 2:
        return 1.0
    deviance = 2.0 * np.sum(special.xlogy(k, k / (n * p)) + special.xlogy(n - k, (n - k) / (n * (1.0 - p))))
    return float(special.chdtrc(n.size - 2, deviance))


def likelihood(eta: Array, n: Array, k: Array) -> float:
    """Logarithm of the likelihood of k of n tests with chances Φ(η)."""
    return float(k @ special.log_ndtr(eta) + (n - k) @ special.log_ndtr(-eta))


def at(eta: Array, n: Array, k: Array, design: Array) -> tuple[Array, Array]:
    """Gradient (2,) and Fisher's information (2, 2) of the likelihood."""
    density = -0.5 * eta**2 - 0.5 * math.log(2.0 * math.pi)
    above, below = (np.exp(density - special.log_ndtr(sign * eta)) for sign in (1.0, -1.0))
    weight = n * above * below
    return design @ (k * above - (n - k) * below), (design * weight) @ design.T
