"""What an effect could gain over a hypothesis, read off a bounded linear projection, before anything is fitted."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from diagnosis.fits import hypothesis
from diagnosis.fits.fitting import NEAR, Fit
from diagnosis.fits.laws.specimen import within
from diagnosis.fits.scales import LARGEST_START, Scales
from diagnosis.fits.threads import each
from laboratories.effects.effect import Effect, Parameter
from models.registry import Array

# Of a start whose size must stay as it is: about as much as a fit then moves its shape.
UNSTRETCHED = (0.5, 1.5)
# How often a start that promises most at the end of its stretch is moved there and looked at again, and the share of
# what a fit costs that it must promise for that.
FARTHER, MUCH = 3, 0.02


@dataclass(frozen=True)
class ScreenedEffect:
    """An effect at the size where it promises most, over a present hypothesis."""

    effect: Effect
    values: dict[str, float]
    z: Array  # (nuisances,) where the nominal parameters go with it, no further than fits begin
    gain: float


class Plane:
    """A fit's residuals as a linear function of its parameters, the nominal ones inside their bounds.

    `alone` is what the fit costs at best without any further effect.
    """

    def __init__(self, fit: Fit) -> None:
        self.fit = fit
        count, size = fit.z.size, fit.jacobian.shape[1]
        self._basis, self._slopes = np.linalg.qr(fit.jacobian)
        rest = fit.reduced.ravel()
        self._here = self._basis.T @ rest
        self._off = rest - self._basis @ self._here
        self._prior = np.eye(count, size)
        room = np.full(size, np.inf)
        room[:count] = hypothesis.TOLERANCES + 1e-6
        at = np.concatenate([fit.z, np.zeros(size - count)])
        self._low, self._high = -room - at, room - at
        self.alone = self._cost(np.zeros(size), 0.0, 0.0, (0.0, 1e-12))[0] if size else float(fit.cost)

    def gain(self, change: Array, stretch: tuple[float, float]) -> tuple[float, float, Array]:
        """What residuals that move by a share of `change` (groups·signals,) gain at best, that share, and z there."""
        inside = self._basis.T @ change
        outside = change - self._basis @ inside
        size = float(np.linalg.norm(outside))
        if size**2 < 1e-6 and float(inside @ inside) < 1e-6:
            return -math.inf, 0.0, self.fit.z
        along = float(outside @ self._off) / size if size > 0.0 else 0.0
        cost, share, moves = self._cost(inside, size, along, stretch)
        return self.alone - cost, share, np.clip(self.fit.z + moves, -NEAR, NEAR)

    def _cost(
        self, inside: Array, size: float, along: float, stretch: tuple[float, float]
    ) -> tuple[float, float, Array]:
        """Least cost over parameters and share, that share, and how z moves, by a bounded linear fit."""
        count = self.fit.z.size
        rows = [
            np.column_stack([self._slopes, inside]),
            np.append(np.zeros(inside.size), size)[None, :],
            np.column_stack([self._prior, np.zeros(count)]),
        ]
        whole = np.concatenate(rows)
        rest = np.concatenate([self._here, [along], self.fit.z])
        low, high = np.append(self._low, stretch[0]), np.append(self._high, stretch[1])
        found = within_bounds(whole, -rest, low, high)
        missed = whole @ found + rest
        off = float(self._off @ self._off) - along**2
        return float(missed @ missed) + off, float(found[-1]), found[:count]


def within_bounds(rows: Array, wanted: Array, low: Array, high: Array) -> Array:
    """The x (n,) between bounds that `rows` (m, n) takes nearest to what is `wanted` (m,), by least squares.

    Mostly it is the one without bounds, for which SciPy's function for bounds takes ten times as long.
    """
    found = np.asarray(np.linalg.lstsq(rows, wanted, rcond=None)[0], dtype=np.float64)
    if np.all(found >= low) and np.all(found <= high):
        return found
    return np.asarray(lsq_linear(rows, wanted, bounds=(low, high), method="bvls").x)


def screen(fit: Fit, effects: Iterable[Effect], scales: Scales) -> list[ScreenedEffect]:
    """What each effect could gain over a fit, best first."""
    plane = Plane(fit)
    found = [item for items in each(lambda effect: look(effect, plane, scales), effects) for item in items]
    return sorted(found, key=lambda item: -item.gain)


def look(effect: Effect, plane: Plane, scales: Scales) -> list[ScreenedEffect]:
    """For every form of an effect the size with the largest expected gain; effects already laid are left out."""
    if effect.name in plane.fit.names:
        return []
    best: dict[tuple[float, ...], tuple[ScreenedEffect, bool]] = {}
    for form, values in scales.starts(effect):
        found = look_from(effect, values, plane, scales)
        if form not in best or found[0].gain > best[form][0].gain:
            best[form] = found
    kept = [look_farther(*found, plane, scales) for found in best.values()]
    return [*kept, *at_rest(effect, plane, scales), *slightly_bent(effect, plane, scales)]


def look_from(
    effect: Effect, values: dict[str, float], plane: Plane, scales: Scales
) -> tuple[ScreenedEffect, bool]:
    """The size along the line through a start that promises most, and whether it is as far as a start is stretched."""
    fit = plane.fit
    moved = fit.data.reduced(hypothesis.lay(fit.data, fit.z, fit.values | {effect.name: values}))
    gain, share, z = plane.gain((moved - fit.reduced).ravel(), scales.stretch(effect))
    return ScreenedEffect(effect, scales.stretched(effect, values, share), z, gain), abs(
        share
    ) == LARGEST_START


def look_farther(item: ScreenedEffect, at_end: bool, plane: Plane, scales: Scales) -> ScreenedEffect:
    """The effect at a larger size, where it promises much and promises most at the end of its stretch.

    A force that stands still, as an offset, may be many times what a reading of forces shows of the motion.
    """
    for _ in range(FARTHER):
        if not at_end or item.gain < MUCH * plane.alone:
            break
        further, at_end = look_from(item.effect, item.values, plane, scales)
        item = max(item, further, key=lambda one: one.gain)
    return item


def at_rest(effect: Effect, plane: Plane, scales: Scales) -> list[ScreenedEffect]:
    """For an effect that is a play the most promising one of those inside which the part rests, as it is."""
    fit, found = plane.fit, []
    for values in scales.resting(effect):
        moved = fit.data.reduced(hypothesis.lay(fit.data, fit.z, fit.values | {effect.name: values}))
        gain, _, z = plane.gain((moved - fit.reduced).ravel(), UNSTRETCHED)
        found.append(ScreenedEffect(effect, values, z, gain))
    return sorted(found, key=lambda item: -item.gain)[:1]


def slightly_bent(effect: Effect, plane: Plane, scales: Scales) -> list[ScreenedEffect]:
    """For an effect that bends a signal near its level the most promising sharpness, where it does what is left.

    Far below the level a signal x lacks x·(x/level)ⁿ/n, so that fine sensors show levels of many times what is reached,
    and no straight line leads there from usual ones.
    """
    fit, found = plane.fit, []
    left = float(np.linalg.norm(fit.reduced))
    for level in effect.parameters if left else ():
        sizes = scales.sizes(effect, level) if level.bends_by else []
        for start in bent_starts(effect, level, max(sizes)) if sizes else ():
            moved = fit.data.reduced(hypothesis.lay(fit.data, fit.z, fit.values | {effect.name: start}))
            farther = float(np.linalg.norm(moved - fit.reduced)) / left
            if farther > 0.0:
                start[level.name] = within(level, max(sizes) * farther ** (1.0 / start[level.bends_by]))
                found.append(look_from(effect, start, plane, scales)[0])
    return sorted(found, key=lambda item: -item.gain)[:1]


def bent_starts(effect: Effect, level: Parameter, size: float) -> list[dict[str, float]]:
    """Parameters of an effect at a size of its level with each sharpness, under the first law that has one."""
    shape = next(item for item in effect.every if item.name == level.bends_by)
    places = [place for place, law in enumerate(effect.laws) if level.bends_by in law.shapes]
    base = effect.values({level.name: size})
    base = effect.under(places[0], base) if places else base
    return [base | {shape.name: sharpness} for sharpness in shape.sizes]
