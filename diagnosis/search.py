"""Which effects of the catalogue explain a part's gap: forward selection, exchange, pruning.

Every effect is first laid over the present hypothesis at a few sizes, and what it could gain once the
nominal parameters give way is read off a linear projection; the most promising are then fitted in full.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from diagnosis import fitting
from diagnosis.fitting import Data, Fit, Values, excess
from diagnosis.scales import Scales
from models.effects.effect import Effect
from models.registry import Array

FITTED = 6  # candidates that are fitted in full at every step
MOST = 3  # effects of one part
WORKERS = 2
LEVELS = (1, 4, 16)  # how many averaged samples are taken together to see what is slow
MATERIAL = 0.12  # systematic residual over noise below which nobody would look for a cause
PRIOR_GAIN, DATA_GAIN = 6.25, 25.0  # what an effect must save: of tolerances, of residuals
REST = 0.85  # share of what is left that a further effect must explain,
TRACE = 2e-4  # and more than this share of the whole gap,
HALF, SHARE = 0.5, 0.03  # or this share of what is left and this of the whole gap
NEAR = 1.0  # tolerances from the nominal value where fits begin: what is further away stands in for an effect
STEPS = 6  # steps between two weightings of a further fit
ROUGH = 4  # steps of a first fit
LOST = 100.0  # mean square residual in σ² from which on fitted nominal parameters mean nothing
FINE = 3  # candidates fitted to their end,
HOPELESS = 30.0  # as long as they leave no more than this times what the best one leaves
TIED = 9.0  # cost by which hypotheses must differ to be told apart


class Gap(NamedTuple):
    """What is systematic in one signal's residual."""

    ratio: float  # rms of the systematic part over that of the noise
    significance: float  # standard deviations above white noise


def gap(reduced: Array, group: int) -> Gap:
    """Systematic part of averaged residuals (groups,) in σ: what their sums over time exceed noise by."""
    ratio, significance = 0.0, 0.0
    for level in LEVELS:
        count = reduced.size // level
        if count < 8:
            continue
        sums = reduced[: count * level].reshape(count, level).sum(axis=1) / math.sqrt(level)
        excess, error = float(np.mean(sums**2)) - 1.0, math.sqrt(2.0 / count)
        significance = max(significance, excess / error)
        ratio = max(ratio, math.sqrt(max(0.0, excess - 3.0 * error) / (level * group)))
    return Gap(ratio, significance)


def gaps(fit: Fit, group: int) -> list[Gap]:
    """Of every signal."""
    return [gap(column, group) for column in fit.reduced.T]


def remaining(fit: Fit) -> float:
    """Largest systematic residual over noise that a fit leaves."""
    return max((item.ratio for item in gaps(fit, fit.data.group)), default=0.0)


@dataclass(frozen=True)
class Candidate:
    """An effect at the size where it promises most, over a present hypothesis."""

    effect: Effect
    values: dict[str, float]
    gain: float


@dataclass(frozen=True)
class Search:
    """What was found in one part."""

    data: Data
    commissioned: Fit  # no effect, parameters inside their tolerances
    chosen: Fit
    alternatives: tuple[Fit, ...]  # one effect exchanged for another each, best first
    screened: tuple[Candidate, ...]  # over the commissioned part, best first

    @property
    def left(self) -> float:
        """Largest systematic residual over noise that the chosen effects leave."""
        return remaining(self.chosen)

    @property
    def explained(self) -> float:
        """Share of the gap's energy that the chosen effects explain."""
        before = excess(self.commissioned)
        return 1.0 - excess(self.chosen) / before if before > 0.0 else 0.0


class Plane:
    """A fit's residuals as a linear function of its parameters, the nominal ones inside their bounds."""

    def __init__(self, fit: Fit) -> None:
        self.fit = fit
        count, size = fit.z.size, fit.jacobian.shape[1]
        self._basis, self._slopes = np.linalg.qr(fit.jacobian)
        rest = fit.reduced.ravel()
        self._here = self._basis.T @ rest
        self._off = rest - self._basis @ self._here
        self._prior = np.eye(count, size)
        room = np.full(size, np.inf)
        room[:count] = fitting.TOLERANCES + 1e-6
        at = np.concatenate([fit.z, np.zeros(size - count)])
        self._low, self._high = -room - at, room - at
        self._alone = self._cost(np.zeros(size), 0.0, 0.0, (0.0, 1e-12))[0] if size else float(fit.cost)

    def gain(self, change: Array, stretch: tuple[float, float]) -> tuple[float, float]:
        """What residuals that move by a share of `change` (groups·signals,) gain at best, and that share."""
        inside = self._basis.T @ change
        outside = change - self._basis @ inside
        size = float(np.linalg.norm(outside))
        if size**2 < 1e-6 and float(inside @ inside) < 1e-6:
            return -math.inf, 0.0
        along = float(outside @ self._off) / size if size > 0.0 else 0.0
        cost, share = self._cost(inside, size, along, stretch)
        return self._alone - cost, share

    def _cost(
        self, inside: Array, size: float, along: float, stretch: tuple[float, float]
    ) -> tuple[float, float]:
        """Least cost over parameters and share, by a bounded linear fit of a few unknowns."""
        count = self.fit.z.size
        rows = [
            np.column_stack([self._slopes, inside]),
            np.append(np.zeros(inside.size), size)[None, :],
            np.column_stack([self._prior, np.zeros(count)]),
        ]
        rest = np.concatenate([self._here, [along], self.fit.z])
        low, high = np.append(self._low, stretch[0]), np.append(self._high, stretch[1])
        found = lsq_linear(np.concatenate(rows), -rest, bounds=(low, high), method="bvls")
        off = float(self._off @ self._off) - along**2
        return 2.0 * float(found.cost) + off, float(found.x[-1])


class Searcher:
    """The search in one part."""

    def __init__(self, data: Data, scales: Scales) -> None:
        self.data, self.scales = data, scales

    def run(self) -> Search:
        """Commission, select, exchange, prune, and fit what else might be."""
        commissioned = fitting.fit(self.data, {})
        if not self.is_gap(commissioned):
            return Search(self.data, commissioned, commissioned, (), ())
        screened = self.screen(commissioned, self.data.part.candidates)
        first = self.all_extended(commissioned, screened)
        chosen = commissioned
        while len(chosen.names) < MOST and self.is_gap(chosen):
            better = first[0] if chosen is commissioned else self.extended(chosen)
            if better is None or not self.worth(commissioned, chosen, better):
                break
            chosen = self.exchanged(better) if len(better.names) > 1 else better
        chosen = self.pruned(commissioned, chosen)
        return Search(self.data, commissioned, chosen, self.alternatives(chosen, first), tuple(screened))

    def is_gap(self, fit: Fit) -> bool:
        """Whether a fit leaves anything to explain: beyond noise, or beyond its tolerances."""
        found = gaps(fit, self.data.group)
        visible = any(item.ratio > MATERIAL and item.significance > 5.0 for item in found)
        return visible or float(np.max(np.abs(fit.z), initial=0.0)) > math.sqrt(PRIOR_GAIN)

    def worth(self, bare: Fit, before: Fit, after: Fit) -> bool:
        """Whether one more effect earns its place."""
        noise = max(1.0, after.chi() / after.reduced.size)
        prior, data = before.prior - after.prior, (before.chi() - after.chi()) / noise
        if max(prior, 0.0) / PRIOR_GAIN + max(data, 0.0) / DATA_GAIN < 1.0 or prior + data <= 0.0:
            return False
        if before is bare:
            return True
        if prior > PRIOR_GAIN and data > -1.0 and remaining(before) < MATERIAL:
            return True
        left, saved, whole = excess(before), excess(before) - excess(after), excess(bare)
        return (saved > REST * left and saved > TRACE * whole) or (
            saved > HALF * left and saved > SHARE * whole
        )

    def screen(self, fit: Fit, effects: Iterable[Effect]) -> list[Candidate]:
        """What each effect could gain over a fit, best first."""
        plane = Plane(self.near(fit))

        def look(effect: Effect) -> Candidate | None:
            return self.look(effect, plane)

        found = [item for item in self.spread(look, effects) if item is not None]
        return sorted(found, key=lambda item: -item.gain)

    def look(self, effect: Effect, plane: Plane) -> Candidate | None:
        """The size of one effect that promises most."""
        fit = plane.fit
        if effect.name in fit.names:
            return None
        best: Candidate | None = None
        for values in self.scales.starts(effect):
            moved = self.data.reduced(fitting.lay(self.data, fit.z, fit.values | {effect.name: values}))
            gain, share = plane.gain((moved - fit.reduced).ravel(), self.scales.stretch(effect))
            if best is None or gain > best.gain:
                best = Candidate(effect, self.scales.stretched(effect, values, share), gain)
        return best

    def spread(
        self, function: Callable[[Effect], Candidate | None], items: Iterable[Effect]
    ) -> list[Candidate | None]:
        """Apply over all items on a few threads: kernels release the interpreter's lock."""
        with ThreadPoolExecutor(WORKERS) as pool:
            return list(pool.map(function, items))

    def extended(self, fit: Fit, screened: list[Candidate] | None = None, count: int = FITTED) -> Fit | None:
        """The best fit with one effect more."""
        fits = self.all_extended(fit, screened, count)
        return fits[0] if fits else None

    def all_extended(
        self, fit: Fit, screened: list[Candidate] | None = None, count: int = FITTED
    ) -> list[Fit]:
        """Fits with one effect more, best first: all a few steps, the best of them to their end."""
        promising = (screened if screened is not None else self.screen(fit, self.data.part.candidates))[
            :count
        ]
        near = self.near(fit)
        slopes = near.jacobian[:, : fit.z.size]

        def rough(candidate: Candidate) -> Fit:
            start: Values = {**fit.values, candidate.effect.name: candidate.values}
            return fitting.fit(self.data, start, near.z, ROUGH, slopes, rounds=1)

        def fine(item: Fit) -> Fit:
            start = np.clip(item.z, -NEAR, NEAR)
            if self.data.part.exact:  # cheap, and free of noise: fits go to their end
                return fitting.fit(self.data, item.values, start)
            return fitting.fit(self.data, item.values, start, STEPS, rounds=2)

        with ThreadPoolExecutor(WORKERS) as pool:
            fits = sorted(pool.map(rough, promising), key=lambda item: item.cost)
            hopeful = [item for item in fits if excess(item) <= HOPELESS * excess(fits[0])][:FINE]
            fits = sorted([*pool.map(fine, hopeful), *fits[len(hopeful) :]], key=lambda item: item.cost)
        if fits and remaining(fits[0]) > MATERIAL:
            fits[0] = fitting.fit(self.data, fits[0].values, fits[0].z)
        return fits

    def near(self, fit: Fit) -> Fit:
        """A fit with its nominal parameters moved back where they stand in for an effect that is missing."""
        missed = float(np.max(np.mean(np.square(fit.reduced), axis=0)))
        z = np.zeros(fit.z.size) if missed > LOST else np.clip(fit.z, -NEAR, NEAR)
        return fitting.at(self.data, fit.values, z)

    def without(self, fit: Fit, name: str) -> Fit:
        """The fit again with one effect taken away."""
        return fitting.fit(self.data, {key: value for key, value in fit.values.items() if key != name}, fit.z)

    def exchanged(self, fit: Fit) -> Fit:
        """A better fit with one effect exchanged for another, if there is any."""
        for name in fit.names[:-1]:
            other = self.extended(self.without(fit, name), count=3)
            if other is not None and other.cost < fit.cost - TIED:
                fit = other
        return fit

    def pruned(self, bare: Fit, fit: Fit) -> Fit:
        """The fit without effects that do not pay."""
        for name in fit.names:
            if len(fit.names) < 2:
                break
            less = self.without(fit, name)
            if not self.worth(bare, less, fit):
                fit = less
        return fit

    def alternatives(self, fit: Fit, first: list[Fit]) -> tuple[Fit, ...]:
        """Fits in which one effect is exchanged for another, best first; `first` are those with one only."""
        if len(fit.names) < 2:
            return tuple(item for item in first if item.names != fit.names)
        result: list[Fit] = []
        for name in fit.names:
            base = self.without(fit, name)
            result += [other for other in self.all_extended(base) if set(other.names) != set(fit.names)]
        return tuple(sorted(result, key=lambda item: item.cost))


def tied(search: Search, other: Fit) -> bool:
    """Whether the data cannot tell another fit from the chosen one."""
    noise = max(1.0, search.chosen.chi() / search.chosen.reduced.size)
    return (other.cost - search.chosen.cost) / noise < TIED


def exchanged_pair(chosen: Fit, other: Fit) -> tuple[str, str] | None:
    """The effect that was taken away and the one that came for it."""
    gone, come = set(chosen.names) - set(other.names), set(other.names) - set(chosen.names)
    return (gone.pop(), come.pop()) if len(gone) == len(come) == 1 else None
