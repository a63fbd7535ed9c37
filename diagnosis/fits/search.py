"""The search for effects of the catalogue that explain a part's gap: forward selection, exchange, pruning.

Every effect is first laid over the present hypothesis at a few sizes, and what it could gain once the
nominal parameters give way is read off a linear projection; the most promising are then fitted in full.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from diagnosis.fits import contact, evidence, fitting, laws, sensor_noise
from diagnosis.fits.fitting import Data, Fit, Values, excess
from diagnosis.fits.scales import Scales
from diagnosis.fits.screening import WORKERS, ScreenedEffect, screen
from diagnosis.fits.sensor_noise import Foreseen, quieter
from diagnosis.signals.noise_model import NoiseModel
from models.registry import Array

# The figures below were set on draws of `rths blind --set tune` (docs/decisions/0012-diagnosis.md), as a compromise
# between effects that are overlooked and effects that are named without a cause. Further reasons stand beside them.

# Effort: a fit takes many predictions of the part, a projection few.
FITTED = 6  # candidates of the projection that are fitted at every step
FINE = 3  # of these, candidates that are fitted to their end,
HOPELESS = 30.0  # as long as they leave no more than this times what the best one leaves
MOST = 3  # effects of one part: more of them can imitate any residual
STEPS = 6  # steps between two weightings of a further fit
ROUGH = 4  # steps of a first fit
LAST = 5  # steps over the whole test after those over its beginning
MOSTLY = (
    0.7  # share of what a fit leaves that a beginning must hold, so that the rest of the test teaches little
)

# Whether there is a gap: in sums over averaged samples, because noise averages out and systematic errors do not.
LEVELS = (1, 4, 16)  # averaged samples in a sum, from fast to slow systematic errors
SLIGHT = 0.02  # of the same, below which one law of a mechanism is as good as another: it can hardly be seen
MATERIAL = 0.12  # systematic residual over noise below which a gap would interest nobody
SIGNIFICANT = (
    5.0  # standard deviations from which on it is no chance, with all signals and time scales looked at
)
PRIOR_GAIN, DATA_GAIN = 6.25, 25.0  # 2.5 tolerances squared; 5 standard deviations squared
LOUDEST = (
    10.0  # noise at its loudest frequency over that at the highest ones: pink noise of a whole test has less
)
SMALL = (
    0.05  # of a reading's rms that may be coloured noise where only the residual beside effects tells of it
)
UNEVEN = 3.0  # times what the energy of normal noise varies by: such noise comes and goes, as a motion does
FARTHEST = 30.0  # times what the best effect leaves: one that leaves more is under no law the right one
POLISHED = 12  # steps of a fit that leaves something, before that counts
HALVINGS = 20  # by which a value is found beyond which the system is the same
RIVALS = 3  # candidates of the projection that are fitted in the place of coloured noise
SETTLING = 4  # rounds in which a fit and the noise that it leaves are found in turn
SUSPICIOUS = 8.0  # of Σ z²: nominal parameters that are all off together imitate an effect
NEAR = 1.0  # tolerances within which fits begin: a parameter that is further away imitates an effect
LOST = 100.0  # mean square residual in σ² from which on fitted nominal parameters mean nothing

# Whether a further effect is worth its parameters: it explains
REST = 0.85  # this share of what is left,
TRACE = 2e-4  # and more than this share of the whole gap, which keeps out effects that fit the noise;
HALF, SHARE = 0.5, 0.03  # or this share of what is left and this of the whole gap;
LOUD, STEP_OF_REST, STEP_OF_WHOLE = (
    10.0,
    0.4,
    0.01,
)  # or these, where more than so many times the noise is left

# What is named.
SEEN = 0.3  # trace over noise that an effect must leave: a smaller one is not visible in a plot
CANCELLED = 4.0  # times the gap that one of several effects may make: beyond it effects undo each other
TIED = 9.0  # cost by which hypotheses differ that can be told apart: 3 standard deviations squared


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


@dataclass(frozen=True)
class Search:
    """What was found in one part."""

    data: Data
    commissioned: Fit  # no effect, parameters inside their tolerances
    chosen: Fit
    alternatives: tuple[Fit, ...]  # one effect exchanged for another each, best first

    @property
    def left(self) -> float:
        """Largest systematic residual over noise that the chosen effects leave."""
        return remaining(self.chosen)

    @property
    def explained(self) -> float:
        """Share of the gap's energy that the chosen effects explain."""
        before = excess(self.commissioned)
        return 1.0 - excess(self.chosen) / before if before > 0.0 else 0.0


class Searcher:
    """The search in one part."""

    def __init__(self, data: Data, scales: Scales) -> None:
        self.data, self.scales = data, scales

    def run(self) -> Search:
        """Commission, select, exchange, prune, and fit what else might be."""
        commissioned = self.settled(fitting.fit(self.data, {}))
        if self.is_gap(commissioned):
            first = self.in_best_laws(self.extended(commissioned))
        else:
            commissioned, first = self.instead_of_colour(commissioned)
        chosen, better = commissioned, first
        while better and self.worth(commissioned, chosen, better[0]):
            before = self.data
            chosen = self.settled(self.exchanged(better[0]) if len(better[0].names) > 1 else better[0])
            if self.data is not before:
                commissioned, *first = (self.again(fit) for fit in (commissioned, *first))
                if len(chosen.names) == 1 and not self.worth(commissioned, commissioned, chosen):
                    chosen = commissioned
                    break
            if len(chosen.names) >= MOST or self.enough(commissioned, chosen):
                break
            better = self.in_best_laws(self.extended(chosen))
        if not chosen.names:
            return Search(self.data, commissioned, chosen, ())
        chosen = self.pruned(commissioned, chosen)
        others = tuple(map(trimmed, self.alternatives(chosen, first)))
        return physical(Search(self.data, commissioned, trimmed(chosen), others))

    def instead_of_colour(self, bare: Fit) -> tuple[Fit, list[Fit]]:
        """The fit without effects, and those with one, best first, under the noise that the best of these leaves.

        What is taken for coloured noise may be an effect, at rest as in motion: effects are fitted under white noise,
        and the best is taken if the data are far more probable under it and the noise that it leaves. Without such an
        effect the list is empty.
        """
        if not sensor_noise.coloured(self.data):
            return bare, []
        fits = self.in_white_noise(bare)
        if not fits or not self.far_likelier(fits[0], bare):
            return bare, []
        self.data = fits[0].data
        best = self.settled(fits[0])
        return self.again(bare), [best, *map(self.again, fits[1:])]

    def in_white_noise(self, bare: Fit) -> list[Fit]:
        """Fits with one effect over a beginning under white noise, held against the whole test, best first."""
        white = fitting.at(sensor_noise.whitened(bare), {}, bare.z)
        near = self.start(white, white.data)
        slopes = near.jacobian[:, : bare.z.size]
        found = screen(near, self.data.part.candidates, self.scales)[:RIVALS]
        fits = [
            fitting.fit(near.data, {item.effect.name: item.values}, near.z, ROUGH, slopes, rounds=1)
            for item in found
        ]
        whole = [fitting.at(white.data, item.values, item.z) for item in fits]
        return sorted(whole, key=lambda item: item.cost)

    def far_likelier(self, fit: Fit, bare: Fit) -> bool:
        """Whether the data are far more probable under a fit and the noise that it leaves than without effects."""
        found = fitting.at(sensor_noise.remodelled(fit), fit.values, fit.z)
        return evidence.surprise(found) < evidence.surprise(bare) - evidence.BEYOND

    def settled(self, fit: Fit) -> Fit:
        """The fit under the noise that it leaves, which the search goes on with.

        Where much of what it leaves follows from the inputs, the quiet part holds a gap as well as noise: the noise is
        then taken to be white, of the level of the highest frequencies.
        """
        if self.data.part.exact:
            return fit
        found, data = fit, sensor_noise.remodelled(fit)
        for _ in range(SETTLING):
            if not sensor_noise.coloured(data):
                break
            found = self.again(found, data)
            better = sensor_noise.remodelled(found)
            if not quieter(better, data):
                break
            data = better
        else:
            found = self.again(found, data)
        if sensor_noise.coloured(data):
            if not hidden(found):
                self.data = data
                return found
            data = sensor_noise.remodelled(fit)
            data = replace(data, noise=(), lines=None, spikes=None)
        return self.white(found, data)

    def white(self, fit: Fit, data: Data) -> Fit:
        """The fit under white noise: that of before where it is no lower."""
        changed = bool(self.data.noise) or data.lines is not None or data.spikes is not None
        self.data = data if changed or quieter(data, self.data) else replace(self.data, related=data.related)
        found = fitting.at(self.data, fit.values, fit.z)
        return self.polished(found) if found.names and leaves(found) else found

    def polished(self, fit: Fit) -> Fit:
        """A fit that leaves something moved on to its end, from where it is and with its laws in their usual shape."""
        usual = {
            name: values
            | {item.name: item.default for item in fit.data.catalogue[name].parameters if item.default}
            for name, values in fit.values.items()
        }
        starts = [fit.values, usual] if usual != fit.values else [fit.values]
        fits = [fitting.fit(self.data, values, fit.z, POLISHED, rounds=3) for values in starts]
        return min([fit, *fits], key=lambda item: item.cost)

    def again(self, fit: Fit, data: Data | None = None) -> Fit:
        """A fit moved to the best parameters under another noise, that of the search where none is given."""
        data = data or self.data
        if sensor_noise.coloured(data):
            return fitting.fit(data, fit.values, fit.z, STEPS, rounds=1)
        return fitting.at(data, fit.values, fit.z)

    def enough(self, bare: Fit, fit: Fit) -> bool:
        """Whether the residual is too small for a further effect to be worth it."""
        return not self.is_gap(fit) or (excess(fit) < TRACE * excess(bare) and fit.prior <= SUSPICIOUS)

    def is_gap(self, fit: Fit) -> bool:
        """Whether a fit leaves anything to explain: beyond noise, or beyond its tolerances."""
        far = float(np.max(np.abs(fit.z), initial=0.0)) ** 2 > PRIOR_GAIN
        return leaves(fit) or fit.prior > SUSPICIOUS or far

    def worth(self, bare: Fit, before: Fit, after: Fit) -> bool:
        """Whether one more effect is worth its parameters."""
        noise = max(1.0, after.chi / after.reduced.size)
        prior, data = before.prior - after.prior, (before.chi - after.chi) / noise
        if max(prior, 0.0) / PRIOR_GAIN + max(data, 0.0) / DATA_GAIN < 1.0 or prior + data <= 0.0:
            return False
        if before is bare or self.idle(after):
            return not self.idle(after)
        if prior > PRIOR_GAIN and data > -1.0 and remaining(before) < MATERIAL:
            return True
        return not self.cancelling(bare, after) and refines(bare, before, after)

    def idle(self, fit: Fit) -> bool:
        """Whether an effect of a fit has no visible influence."""
        return any(float(np.max(size)) < SEEN**2 * self.data.group for size in self.changes(fit))

    def changes(self, fit: Fit) -> list[Array]:
        """Mean square change (signals,) of the residuals without each effect, the rest as it is."""
        result = []
        for name in fit.names:
            rest = {key: values for key, values in fit.values.items() if key != name}
            change = fitting.at(self.data, rest, fit.z).reduced - fit.reduced
            result.append(np.mean(np.square(change), axis=0))
        return result

    def cancelling(self, bare: Fit, fit: Fit) -> bool:
        """Whether effects of a fit do far more than the gap they explain, and undo each other."""
        gap = max(float(np.max(np.mean(np.square(bare.reduced), axis=0))), 1.0)
        return any(float(np.max(size)) > CANCELLED**2 * gap for size in self.changes(fit))

    def start(self, fit: Fit, data: Data | None = None) -> Fit:
        """A fit over the beginning of the test that holds most of what it leaves, nominal parameters moved back.

        Parameters that are far away stand in for an effect that is missing.
        """
        missed = float(np.max(np.mean(np.square(fit.reduced), axis=0)))
        z = np.zeros(fit.z.size) if missed > LOST else np.clip(fit.z, -NEAR, NEAR)
        return fitting.at(fitting.beginning(data or self.data, fit, MOSTLY), fit.values, z)

    def extended(self, fit: Fit, count: int = FITTED) -> list[Fit]:
        """Fits with one effect more, best first: all a few steps over a beginning, the best of them to their end."""
        near = self.start(fit)
        promising = screen(near, self.data.part.candidates, self.scales)[:count]
        slopes = near.jacobian[:, : fit.z.size]

        def rough(candidate: ScreenedEffect) -> Fit:
            start: Values = {**fit.values, candidate.effect.name: candidate.values}
            return fitting.fit(near.data, start, near.z, ROUGH, slopes, rounds=1)

        def fine(item: Fit) -> Fit:
            z = np.clip(item.z, -NEAR, NEAR)
            if self.data.part.exact:  # cheap, and free of noise: fits go to their end
                return fitting.fit(self.data, item.values, z, rounds=8)
            better = fitting.fit(near.data, item.values, z, STEPS, rounds=2)
            return fitting.fit(self.data, better.values, better.z, LAST, rounds=1)

        with ThreadPoolExecutor(WORKERS) as pool:
            fits = sorted(pool.map(rough, promising), key=lambda item: item.cost)
            hopeful = [item for item in fits if excess(item) <= HOPELESS * excess(fits[0])][:FINE]
            hopeful = fits if self.data.part.exact else hopeful
            rest = [fitting.at(self.data, item.values, item.z) for item in fits[len(hopeful) :]]
            fits = sorted([*pool.map(fine, hopeful), *rest], key=lambda item: item.cost)
        if fits and remaining(fits[0]) > MATERIAL:
            fits[0] = fitting.fit(self.data, fits[0].values, fits[0].z, STEPS, rounds=3)
        return self.with_stop(fit, fits)

    def in_best_laws(self, fits: list[Fit]) -> list[Fit]:
        """The fits, best first, with effects under other laws where the best leaves a gap and these leave less.

        The best one is first fitted to its end under its own law: another law would else explain what that fit has
        not reached yet.
        """
        if not fits or remaining(fits[0]) < SLIGHT:
            return fits
        if len(fits[0].data.catalogue[fits[0].names[-1]].laws) > 1:
            fits = sorted([self.polished(fits[0]), *fits[1:]], key=lambda item: item.cost)
            if remaining(fits[0]) < SLIGHT:
                return fits
        least = excess(fits[0])
        better = [laws.in_best_law(item) if excess(item) <= FARTHEST * least else item for item in fits]
        return sorted(better, key=lambda item: item.cost)

    def with_stop(self, fit: Fit, fits: list[Fit]) -> list[Fit]:
        """The fits, and one with an end stop where all the others leave a large residual."""
        stops = [effect for effect in self.data.part.candidates if effect.contact]
        if not fits or not stops or remaining(fits[0]) < LOUD or stops[0].name in fit.names:
            return fits
        found = contact.stopped(self.data, fit, stops[0])
        rest = [item for item in fits if stops[0].name not in item.names]
        if found is None or found.cost > min(item.cost for item in fits):
            return fits
        return sorted([found, *rest], key=lambda item: item.cost)

    def without(self, fit: Fit, name: str) -> Fit:
        """The fit again with one effect taken away."""
        return fitting.fit(self.data, {key: value for key, value in fit.values.items() if key != name}, fit.z)

    def exchanged(self, fit: Fit) -> Fit:
        """A better fit with one effect exchanged for another, if there is any."""
        for name in fit.names[:-1]:
            others = self.extended(self.without(fit, name), count=3)
            if others and others[0].cost < fit.cost - TIED:
                fit = others[0]
        return fit

    def pruned(self, bare: Fit, fit: Fit) -> Fit:
        """The fit without effects that explain too little."""
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
            result += [other for other in self.extended(base) if set(other.names) != set(fit.names)]
        return tuple(sorted(result, key=lambda item: item.cost))


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
    return any(item.ratio > limit and item.significance > SIGNIFICANT for item, limit in found)


def hidden(fit: Fit) -> bool:
    """Whether the noise that a fit is measured by may hold a gap.

    Something is left beside that noise, and either the inputs foresee it or the noise is far louder at some frequency
    than at the highest ones, as the noise of no sensor is; or it comes and goes, or what effects leave would be a
    large share of a reading.
    """
    if fit.names and sensor_noise.share(fit.data) > SMALL:
        return True
    seen = any(
        item.ratio > MATERIAL and item.significance > SIGNIFICANT for item in sensor_noise.foreseen(fit)
    )
    loud = sensor_noise.loudest(fit) > LOUDEST
    uneven = np.array([item.tails > UNEVEN for item in fit.data.noise])
    return seen or bool(np.any(loud & uneven)) or (bool(np.any(loud)) and leaves(fit))


def trimmed(fit: Fit) -> Fit:
    """A fit whose effects are no larger than what changes the system: no more delay taken away than there is."""
    values = {name: dict(given) for name, given in fit.values.items()}
    for name, given in values.items():
        effect = fit.data.catalogue[name]
        system = fitting.lay(fit.data, fit.z, {key: item for key, item in fit.values.items() if key != name})
        for item in effect.parameters:
            if item.shape or not math.isfinite(item.null) or given[item.name] == item.null:
                continue
            whole, least, most = effect.apply(system, **given), 0.0, 1.0
            for _ in range(HALVINGS):
                share = 0.5 * (least + most)
                moved = given | {item.name: item.null + share * (given[item.name] - item.null)}
                least, most = (least, share) if effect.apply(system, **moved) == whole else (share, most)
            if most < 1.0:
                given[item.name] = item.null + most * (given[item.name] - item.null)
    return replace(fit, values=values) if values != fit.values else fit


def refines(bare: Fit, before: Fit, after: Fit) -> bool:
    """Whether a further effect takes away enough of what is left, and of the whole gap."""
    left, saved, whole = excess(before), excess(before) - excess(after), excess(bare)
    if remaining(before) > LOUD:  # far from any noise a model may well be refined in small steps
        return saved > STEP_OF_REST * left and saved > STEP_OF_WHOLE * whole
    return (saved > REST * left and saved > TRACE * whole) or (saved > HALF * left and saved > SHARE * whole)


def tied(search: Search, other: Fit) -> bool:
    """Whether the data cannot tell another fit from the chosen one."""
    noise = max(1.0, search.chosen.chi / search.chosen.reduced.size)
    return (other.cost - search.chosen.cost) / noise < TIED


def physical(search: Search) -> Search:
    """The search with a machine's effect in front where the data cannot tell it from a sensor's."""
    catalogue = search.data.catalogue
    measured = sum(catalogue[name].kind == "measurement" for name in search.chosen.names)
    for other in search.alternatives:
        artefacts = sum(catalogue[name].kind == "measurement" for name in other.names)
        if artefacts < measured and len(other.names) == len(search.chosen.names) and tied(search, other):
            rest = [search.chosen, *(item for item in search.alternatives if item is not other)]
            return replace(search, chosen=other, alternatives=tuple(rest))
    return search


def exchanged_pair(chosen: Fit, other: Fit) -> tuple[str, str] | None:
    """The effect that was taken away and the one that came for it."""
    gone, come = set(chosen.names) - set(other.names), set(other.names) - set(chosen.names)
    return (gone.pop(), come.pop()) if len(gone) == len(come) == 1 else None
