"""Whether a further effect is worth its parameters: it must be visible, explain enough, and not undo another one."""

from __future__ import annotations

import numpy as np
from scipy import special

from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit, excess
from diagnosis.fits.hypothesis import TOLERANCES
from diagnosis.fits.unexplained import MATERIAL, leaves, remaining
from diagnosis.signals.mask import Mask
from models.registry import Array

# Of what chance does to nominal parameters (docs/decisions/0060-rare-parameters.md).
PRIOR_GAIN = 9.0  # three tolerances squared, beyond which no parameter is moved
PINNED = 1e-3  # tolerances from a bound within which a parameter is at it
BY_CHANCE = 0.02  # share of laboratories in which Σ z² of a part is larger by chance

# The figures below were set on draws of `rths blind --set tune` (docs/decisions/0012-diagnosis.md), as a compromise
# between effects that are overlooked and effects that are named without a cause.
DATA_GAIN = 25.0  # 5 standard deviations squared

# What a further effect must explain: shares of what is left, and of the whole gap. The second of the first pair keeps
# out effects that fit the noise.
NEARLY_ALL, TRACE = 0.85, 2e-4
HALF, SHARE = 0.5, 0.03
FREED = 0.3  # of what is left, where no nominal parameter stays at the bound of its range: noise may be most of it
# The same far from any noise, where more than LOUD times it is left: a model may well be refined in small steps there.
LOUD, STEP_OF_REST, STEP_OF_WHOLE = 10.0, 0.4, 0.01

SEEN = 0.3  # trace over noise that an effect must leave: a smaller one is not visible in a plot
CANCELLED = 4.0  # times the gap that one of several effects may make: beyond it effects undo each other


def is_gap(fit: Fit) -> bool:
    """Whether a fit leaves anything to explain: beyond noise, or beyond its tolerances."""
    return leaves(fit) or strained(fit)


def strained(fit: Fit) -> bool:
    """Whether nominal parameters have moved too far: all of them together, or one to the bound of its range."""
    return fit.prior > usual(fit) or bool(np.any(at_bound(fit)))


def at_bound(fit: Fit) -> Mask:
    """Which nominal parameters (nuisances,) a fit leaves at the bound of their range."""
    return np.asarray(np.abs(fit.z) > TOLERANCES - PINNED)


def usual(fit: Fit) -> float:
    """Most that Σ z² of nominal parameters is by chance: what one alone may be off, or what χ² says of all of them."""
    return max(PRIOR_GAIN, float(special.chdtri(max(fit.z.size, 1), BY_CHANCE)))


def enough(bare: Fit, fit: Fit) -> bool:
    """Whether the residual is too small for a further effect to be worth it."""
    return not is_gap(fit) or (
        excess(fit) < TRACE * min(moving(bare), bare.data.energy) and not strained(fit)
    )


def is_worth(bare: Fit, before: Fit, after: Fit) -> bool:
    """Whether the fit `after` with one effect more is worth its parameters; `bare` is the fit without effects."""
    prior, data = gained(before, after)
    if not pays(prior, data):
        return False
    sizes = changes(after)
    if before is bare or idle(after, sizes):
        return not idle(after, sizes)
    if prior > PRIOR_GAIN and data > -1.0 and remaining(before) < MATERIAL:
        return True
    # an effect that brings nominal parameters back as well needs to explain less: two signs of one cause
    freed = bool(np.any(at_bound(before))) and not np.any(at_bound(after))
    least = (FREED if freed else HALF) * excess(before)
    freeing = prior > PRIOR_GAIN and excess(before) - excess(after) > least
    return not cancelling(bare, after, sizes) and (freeing or refines(bare, before, after))


def gained(before: Fit, after: Fit) -> tuple[float, float]:
    """By how much the prior's part of the cost falls, and that of the data, in units of the noise that is left."""
    noise = max(1.0, after.chi / after.data.size)
    return before.prior - after.prior, (before.chi - after.chi) / noise


def pays(prior: float, data: float) -> bool:
    """Whether what a fit with one effect more gains is more than chance gives."""
    return max(prior, 0.0) / PRIOR_GAIN + max(data, 0.0) / DATA_GAIN >= 1.0 and prior + data > 0.0


def moving(fit: Fit) -> float:
    """What a fit costs beyond noise, readings that are off by a constant aside."""
    held = fit.reduced[fit.data.judging]
    constant = float(np.sum(np.square(held.mean(axis=0)))) * len(fit.reduced)
    return max(0.0, excess(fit) - constant)


def idle(fit: Fit, sizes: list[Array]) -> bool:
    """Whether an effect of a fit has no visible influence; `sizes` as `changes` gives them."""
    return any(float(np.max(size)) < SEEN**2 * fit.data.group for size in sizes)


def changes(fit: Fit) -> list[Array]:
    """Mean square change (signals,) of the residuals without each effect, the rest as it is."""
    result = []
    for name in fit.names:
        rest = {key: values for key, values in fit.values.items() if key != name}
        change = fitting.at(fit.data, rest, fit.z).reduced - fit.reduced
        result.append(np.mean(np.square(change), axis=0))
    return result


def cancelling(bare: Fit, fit: Fit, sizes: list[Array]) -> bool:
    """Whether effects of a fit do far more than the gap they explain, and undo each other; `sizes` as `changes` gives.

    Such an effect does far more both beside the others and by itself. One that keeps a motion small does so only beside
    a law that is steep farther out, and what nominal parameters within their tolerances do as well is no more than they
    had taken over.
    """
    gap = max(float(np.max(np.mean(np.square(bare.reduced), axis=0))), 1.0)
    large = [
        name for name, size in zip(fit.names, sizes, strict=True) if float(np.max(size)) > CANCELLED**2 * gap
    ]
    without = fitting.at(fit.data, {}, fit.z) if large else fit
    for name in large:
        rest = {key: values for key, values in fit.values.items() if key != name}
        beside = fitting.at(fit.data, rest, fit.z).reduced - fit.reduced
        alone = without.reduced - fitting.at(fit.data, {name: fit.values[name]}, fit.z).reduced
        if all(mean_square(beyond_nominal(fit, one)) > CANCELLED**2 * gap for one in (beside, alone)):
            return True
    return False


def mean_square(change: Array) -> float:
    """The largest mean square of a change of the residuals (groups, signals) over the signals."""
    return float(np.max(np.mean(np.square(change), axis=0)))


def beyond_nominal(fit: Fit, change: Array) -> Array:
    """A change of the residuals (groups, signals) less what nominal parameters do as well, each at its tolerance."""
    slopes = fit.jacobian[:, : fit.z.size]
    moved = np.linalg.solve(slopes.T @ slopes + np.eye(fit.z.size), slopes.T @ change.ravel())
    return np.asarray(change - (slopes @ moved).reshape(change.shape))


def refines(bare: Fit, before: Fit, after: Fit) -> bool:
    """Whether a further effect takes away enough of what is left, and of the whole gap.

    A gap that is larger than the readings themselves counts as these: a nominal stiffness that means nothing must not
    hide what a specimen does. Nor must the bias of a sensor, which is no motion.
    """
    left, saved = excess(before), excess(before) - excess(after)
    whole = min(moving(bare), bare.data.energy)
    steps = saved > STEP_OF_REST * left and saved > STEP_OF_WHOLE * whole and remaining(before) > LOUD
    return (
        steps
        or (saved > NEARLY_ALL * left and saved > TRACE * whole)
        or (saved > HALF * left and saved > SHARE * whole)
    )
