"""The hypotheses that tests so far leave open, with their probabilities."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from common.roles import MASTER
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.verdict import DOUBT, PartVerdict
from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.residuals import Data
from laboratories.effects.effect import Parameter
from models.registry import Array
from simulation.campaign.information import odds

# Probability below which a candidate cannot be what a campaign ends with, so that no test is chosen for its sake.
NEGLIGIBLE = 1e-3
# Probability, before any test, that laboratories differ from their plan by an effect of the catalogue at all.
DIFFERENT = 0.5


@dataclass(frozen=True)
class PartCauses:
    """The causes that may explain the gap of one part, the most probable one first; `weights` (n,) sum to 1."""

    role: str
    title: str
    fits: tuple[Fit, ...]
    weights: Array
    sure: float  # probability that the true cause is among them

    @property
    def data(self) -> Data:
        """All recordings of the part."""
        return self.fits[0].data

    @cached_property
    def known(self) -> tuple[Array, ...]:
        """For each cause the information (p, p) that the tests so far hold on its parameters."""
        return tuple(map(information, self.fits))


def information(fit: Fit) -> Array:
    """The information (p, p) that a fit's recordings and the tolerances hold on all that it moved."""
    slopes = fit.seen_slopes
    found = slopes.T @ slopes
    found[: fit.z.size, : fit.z.size] += np.eye(fit.z.size)
    return np.asarray(found)


@dataclass(frozen=True)
class HiddenCause:
    """An effect at a size at which the tests so far may not have shown it."""

    part: int
    values: Values

    @property
    def name(self) -> str:
        """The effect."""
        return next(iter(self.values))


@dataclass(frozen=True)
class HiddenCauses:
    """What may still be there where the tests showed no gap: `weights` (1 + n,) of nothing and of each cause."""

    roles: tuple[str, ...]  # of the slave whose diagnosis judged each part
    fits: tuple[Fit, ...]  # of the parts, without effects
    causes: tuple[HiddenCause, ...]  # part by part
    sights: tuple[Sight, ...]  # of the causes of each part in the tests so far
    weights: Array
    sure: float = (
        1.0  # probability that the truth is among them: small where a gap is left that no effect explains
    )


def verdicts(found: Mapping[str, Diagnosis]) -> Iterator[tuple[str, PartVerdict]]:
    """The verdicts of the diagnoses of one test, by role of the slave; the master's parts are those of the first."""
    for place, (role, one) in enumerate(found.items()):
        for verdict in one.verdicts:
            owner = verdict.search.data.part.role
            if owner == role or (place == 0 and owner == MASTER):
                yield role, verdict


def open_parts(found: Mapping[str, Diagnosis]) -> list[PartCauses]:
    """The parts whose gap the diagnoses name causes for, or look for one in vain."""
    parts = (causes_of(role, verdict) for role, verdict in verdicts(found))
    return [one for one in parts if one is not None]


def causes_of(role: str, verdict: PartVerdict) -> PartCauses | None:
    """The causes of one part's gap; None where it has none. No effects are the cause where none comes near."""
    search = verdict.joined or verdict.search
    if verdict.outcome == "unknown":
        near = [(fit, chance) for fit, chance in verdict.others if fit.names] or [(search.commissioned, 1.0)]
        joint = {fit.names: fit for fit in search.alternatives}
        fits = [joint.get(fit.names, fit) for fit, _ in near]
        return weighed(role, verdict, fits, np.array([chance for _, chance in near]), 1.0 - DOUBT["unknown"])
    if not verdict.effects:
        return None
    fits = distinct([search.chosen, *search.alternatives])
    noise = max(1.0, search.chosen.chi / search.chosen.reduced.size)
    weights = odds(np.array([fit.cost - search.chosen.cost for fit in fits]) / noise)
    weights /= weights.sum()
    named = sum(w for fit, w in zip(fits, weights, strict=True) if fit.names in tied_names(verdict))
    sure = 1.0 - DOUBT[verdict.outcome]
    there = min(1.0, verdict.probability / (sure * float(named)))  # that there is an effect at all
    weights = np.append(there * weights, 1.0 - there)
    return weighed(role, verdict, [*fits, search.commissioned], weights, sure)


def tied_names(verdict: PartVerdict) -> set[tuple[str, ...]]:
    """The names of the effects whose probability the verdict's is: those chosen, and those tied with them."""
    others = {fit.names for fit, _ in verdict.others}
    tied = {fit.names for fit in verdict.search.alternatives if fit.names not in others}
    return {verdict.search.chosen.names, *tied}


def distinct(fits: Sequence[Fit]) -> list[Fit]:
    """The first fit of each set of effects; several laws of one effect are one cause."""
    kept: dict[frozenset[str], Fit] = {}
    for fit in fits:
        kept.setdefault(frozenset(fit.names), fit)
    return list(kept.values())


def weighed(role: str, verdict: PartVerdict, fits: Sequence[Fit], weights: Array, sure: float) -> PartCauses:
    """The causes with probabilities, the most probable first, without negligible ones."""
    shares = weights / weights.sum()
    order = sorted(range(len(fits)), key=lambda place: (-shares[place], place))
    kept = [place for place in order if shares[place] > NEGLIGIBLE] or order[:1]
    chosen = shares[kept] / shares[kept].sum()
    part = verdict.search.data.part
    return PartCauses(role, part.name, tuple(fits[place] for place in kept), chosen, min(1.0, sure))


def hidden(found: Mapping[str, Diagnosis]) -> HiddenCauses:
    """The effects that the tests so far may not have shown, where no part has a gap.

    Each effect is as likely as the others, at each of the catalogue's sizes; what a size would have changed beyond
    what the nominal parameters can imitate lowers its probability.
    """
    searches = [(role, verdict.joined or verdict.search) for role, verdict in verdicts(found)]
    sure = float(np.prod([one.sure for one in open_parts(found)]))
    return replace(hiding([(role, one.chosen) for role, one in searches], played=True), sure=sure)


def hiding(fits_: Sequence[tuple[str, Fit]], *, played: bool) -> HiddenCauses:
    """The effects that fits without effects, by role of the slave, leave possible; all of them before any test."""
    kept = [(role, fit) for role, fit in fits_ if not fit.data.part.exact]
    roles, fits = tuple(role for role, _ in kept), tuple(fit for _, fit in kept)
    causes = [[*sized(place, fit)] for place, fit in enumerate(fits)]
    sights = [seen(fit, own) if played else unseen(fit, own) for fit, own in zip(fits, causes, strict=True)]
    shown = [np.diag(one.left()) for one in sights]
    each = DIFFERENT / max(1, sum(map(len, causes)))
    weights = np.concatenate([[1.0 - DIFFERENT], each * odds(np.concatenate([np.zeros(0), *shown]))])
    flat = tuple(one for own in causes for one in own)
    return HiddenCauses(roles, fits, flat, tuple(sights), weights / weights.sum())


def sized(place: int, fit: Fit) -> Iterator[HiddenCause]:
    """The effects that a part can have, each at a weak, a middle and a strong size of the catalogue."""
    for effect in fit.data.part.candidates:
        strength = [item for item in effect.parameters if not item.shape]
        shapes = {item.name: item.default for item in effect.parameters if item.default is not None}
        for level in (0.0, 0.5, 1.0):
            values = {
                item.name: by_strength(item)[round(level * (len(item.sizes) - 1))]
                for item in strength
                if item.sizes
            }
            if len(values) == len(strength):
                yield HiddenCause(place, {effect.name: {**shapes, **values}})


def by_strength(item: Parameter) -> list[float]:
    """The sizes of a parameter, the weakest first; the catalogue lists those on both sides of a null value by value."""
    if not np.isfinite(item.null):
        return list(item.sizes)
    return sorted(item.sizes, key=lambda size: abs(size - item.null))


class Sight(NamedTuple):
    """What the causes of a part change in recordings, and how far nominal parameters can imitate it."""

    squares: Array  # (causes, causes) sums of products of the changes, in σ²
    slopes: Array  # (nuisances, causes) slopes of the nominal parameters times the changes
    known: Array  # (nuisances, nuisances) information on the nominal parameters

    def beside(self, other: Sight) -> Sight:
        """Both recordings together."""
        return Sight(self.squares + other.squares, self.slopes + other.slopes, self.known + other.known)

    def left(self) -> Array:
        """What remains of `squares` once the nominal parameters are fitted within their tolerances."""
        least = np.eye(len(self.known))
        return np.asarray(self.squares - self.slopes.T @ np.linalg.solve(self.known + least, self.slopes))


def sight(changes: Array, slopes: Array) -> Sight:
    """The sight of changes (m, causes), with slopes (m, nuisances) of the nominal parameters."""
    return Sight(changes.T @ changes, slopes.T @ changes, slopes.T @ slopes)


def seen(fit: Fit, causes: Sequence[HiddenCause]) -> Sight:
    """What effects would have changed in the recordings of a fit without effects."""
    changes = [(fitting.at(fit.data, one.values, fit.z).reduced - fit.reduced).ravel() for one in causes]
    return sight(np.stack(changes, axis=1) if changes else np.zeros((fit.reduced.size, 0)), fit.jacobian)


def unseen(fit: Fit, causes: Sequence[HiddenCause]) -> Sight:
    """The sight of causes that no test could show yet."""
    return sight(np.zeros((0, len(causes))), np.zeros((0, fit.z.size)))
