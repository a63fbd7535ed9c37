"""Hypotheses with one effect more, or with one effect exchanged for another.

Every effect is first laid over the present hypothesis at a few sizes, and what it could gain once the nominal
parameters give way is read off a linear projection; the most promising are then fitted, the best of these to their end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.fits import contact, fitting
from diagnosis.fits.fitting import TIED, Fit, everywhere, excess
from diagnosis.fits.hypothesis import Values, values_of_plan
from diagnosis.fits.laws.best import as_specimens, begun, descended, in_best_laws, raced
from diagnosis.fits.laws.loop import single
from diagnosis.fits.laws.unlike_first import unlike_first
from diagnosis.fits.scales import Scales
from diagnosis.fits.screening import ScreenedEffect, screen
from diagnosis.fits.threads import each
from diagnosis.fits.unexplained import MATERIAL, leaves, remaining
from diagnosis.fits.worth import LOUD, is_gap

# Of what a fit leaves: an effect that promises more is near the cause. Of two tables with play behind their loop the
# best other effect promised 2 and 5 %, play before the loop at most 0.2 %, and play behind it 5 and 33 %.
LITTLE = 0.5
# Times what the first law promises: a law that differs from it in detail only, as friction by direction and speed,
# promises no more.
FAR_MORE = 2.0
# Share of what effects leave that a further one must explain under the law that promises most, for its other laws to be
# fitted. To be worth it, these would have to explain four tenths.
BARELY = 0.05
# Effort: a fit takes many predictions of the part, a projection few.
FITTED = 6  # candidates of the projection that are fitted at every step
FINE = 3  # of these, candidates that are fitted to their end,
HOPELESS = 30.0  # as long as they leave no more than this times what the best one leaves
ROUGH = 4  # steps of a first fit
STEPS = 6  # steps between two weightings of a further fit
# Share of what is left without an effect that a fit on its way leaves: a stiffness, which a nominal parameter and a
# friction follow, left 2 %.
VALLEY = 0.05
LAST = 5  # steps over the whole test after those over its beginning


def extended(fit: Fit, scales: Scales, count: int = FITTED, known: Fit | None = None) -> list[Fit]:
    """Fits with one effect more, best first: all a few steps over a beginning, the best of them to their end.

    Those that leave far more than the best, or than a fit that is `known`, stay as they are after a few steps. Beside a
    known fit effects are looked at under their first laws only: those under others are too far away to come near it.
    """
    data, near = fit.data, fitting.begun(fit)
    promising = (promised(near, scales) if known is None else screened(near, scales))[:count]
    slopes = near.jacobian[:, : fit.z.size]

    def rough(candidate: ScreenedEffect) -> Fit:
        start: Values = {**fit.values, candidate.effect.name: candidate.values}
        return fitting.fit(near.data, start, candidate.z, ROUGH, slopes, rounds=1)

    def fine(item: Fit) -> Fit:
        z = np.clip(item.z, -fitting.NEAR, fitting.NEAR)
        if data.part.exact:  # cheap, and free of noise: fits go to their end
            return fitting.fit(data, item.values, z, rounds=8)
        better = fitting.fit(near.data, item.values, z, STEPS, rounds=2)
        return fitting.fit(data, better.values, better.z, LAST, rounds=1)

    fits = sorted(each(rough, promising), key=everywhere)
    least = min((everywhere(item) for item in fits), default=0.0)
    if known is not None:
        least = min(least, max(everywhere(known), TIED))
    hopeful = [item for item in fits if everywhere(item) <= HOPELESS * least][:FINE]
    hopeful = fits if data.part.exact else hopeful
    rest = [fitting.at(data, item.values, item.z) for item in fits[len(hopeful) :]]
    fits = sorted([*each(fine, hopeful), *rest], key=lambda item: item.cost)
    others = [item for item in fits if known is None or set(item.names) != set(known.names)]
    best = others[0] if others else None
    if best and remaining(best) > MATERIAL and (known is None or comes_near(best, fit, known)):
        done = fitting.fit(data, best.values, best.z, STEPS, rounds=3)
        fits = sorted([done, *(item for item in fits if item is not best)], key=lambda item: item.cost)
    return fits


def comes_near(found: Fit, without: Fit, known: Fit) -> bool:
    """Whether a fit with an effect that others lack may come as near as a known one in further steps.

    It also does where it explains nearly all that they leave: on the way down a narrow valley it has found the cause,
    and not yet its size.
    """
    return fitting.near(found, known) or excess(found) < VALLEY * excess(without)


def screened(near: Fit, scales: Scales) -> list[ScreenedEffect]:
    """What all effects promise over a fit under their first laws, best first."""
    return screen(near, near.data.part.candidates, scales)


def promised(near: Fit, scales: Scales) -> list[ScreenedEffect]:
    """What effects promise over a fit, best first: each under its first law, or another one that promises far more.

    Other laws are looked at only where no effect promises much under its first.
    """
    found = screened(near, scales)
    most = max((item.gain for item in found), default=0.0)
    if most > LITTLE * excess(near):
        return found
    under_first = {item.effect.name: item.gain for item in reversed(found)}
    better: dict[str, ScreenedEffect] = {}
    for item in unlike_first(near, scales):
        name = item.effect.name
        if item.gain > max(most, FAR_MORE * under_first.get(name, 0.0)):
            better.setdefault(name, item)
    others = [item for item in found if item.effect.name not in better]
    return sorted([*better.values(), *others], key=lambda item: -item.gain)


def with_stop(fit: Fit, fits: list[Fit]) -> list[Fit]:
    """The fits, and one with an end stop where all the others leave something."""
    stops = [effect for effect in fit.data.part.candidates if effect.contact]
    if not fits or not stops or stops[0].name in fit.names or not leaves(fits[0]):
        return fits
    loud = remaining(fits[0]) > LOUD
    found = (contact.stopped if loud else contact.touched)(fit.data, fit, stops[0])
    rest = [item for item in fits if stops[0].name not in item.names]
    if found is None or found.cost > min(item.cost for item in fits):
        return fits
    return sorted([found, *rest], key=lambda item: item.cost)


def in_order(found: Fit, fit: Fit) -> Fit:
    """A fit with its effects in the order of another one, further ones last."""
    names = [*fit.names, *(name for name in found.names if name not in fit.names)]
    return replace(found, values={name: found.values[name] for name in names})


def best_laws(fit: Fit, scales: Scales) -> list[Fit]:
    """Fits with one effect more, best first, each effect under the law of its mechanism that leaves least.

    Beside other effects no further laws are fitted where hardly anything is explained under those that promise most.
    """
    fits = with_stop(fit, extended(fit, scales))
    if fit.names and fits and excess(fits[0]) > (1.0 - BARELY) * excess(fit):
        return fits
    return in_best_laws(fits if fit.names else as_specimens(fit, fits))


def without(fit: Fit, name: str) -> Fit:
    """The fit again with one effect taken away."""
    return fitting.fit(fit.data, {key: value for key, value in fit.values.items() if key != name}, fit.z)


def exchanged(fit: Fit, scales: Scales) -> Fit:
    """A better fit with one effect exchanged for another, if there is any."""
    for name in single(fit)[:-1]:
        others = extended(without(fit, name), scales, count=3, known=fit)
        if others and others[0].cost < fit.cost - TIED:
            fit = others[0]
    return fit


def in_other_laws(fit: Fit) -> Fit:
    """The fit with each effect but the last under that law of its mechanism that leaves least.

    While an effect was missing, one that came before it was held against its other laws beside what that left. Models
    of specimens are left out, which follow all of a force.
    """
    for name in single(fit)[:-1]:
        if len(fit.data.catalogue[name].laws) > 1 and leaves(fit):
            rest = {key: values for key, values in fit.values.items() if key != name}
            better = raced([replace(fit, values=rest | {name: fit.values[name]})], modelled=False)
            if name in better:
                fit = in_order(descended(better[name]), fit)
    return fit


def alternatives(fit: Fit, first: list[Fit], scales: Scales) -> tuple[Fit, ...]:
    """Fits in which one effect is exchanged for another, best first; `first` are those with one only."""
    if len(fit.names) < 2:
        others = [item for item in first if item.names != fit.names]
        return tuple(
            sorted([*others, *under_own_laws(fit, fit.names[0], others)], key=lambda item: item.cost)
        )
    result: list[Fit] = []
    for name in single(fit):
        others = [item for item in extended(without(fit, name), scales, known=fit) if name not in item.names]
        if others and is_gap(fit) and excess(others[0]) < HOPELESS * excess(fit):
            others = under_further_laws(others)
        result += [*others, *under_own_laws(fit, name, others)]
    return tuple(sorted(result, key=lambda item: item.cost))


def under_own_laws(fit: Fit, name: str, others: Sequence[Fit]) -> list[Fit]:
    """Of fits with an effect exchanged for another those under a further law, where they come as near.

    They are of the same reading, or of the same machine as another value of the plan: under its first law a lag is far
    from a delay, and one of second order may do the same; a compliance within a loop is a faster loop.
    """
    catalogue = fit.data.catalogue
    signal, site = catalogue[name].signal, catalogue[name].site
    known = name in values_of_plan(fit.data, fit.values)
    last = [(item, catalogue[item.names[-1]]) for item in others]
    alike = [item for item, one in last if (signal and one.signal == signal) or (known and one.site == site)]
    starts = [start for item in alike for start in begun(item, modelled=False)]
    found = each(lambda start: fitting.fit(start.data, start.values, start.z, STEPS), starts)
    return [item for item in found if item.cost < fit.cost + TIED]


def under_further_laws(fits: list[Fit]) -> list[Fit]:
    """Fits that differ in their last effect, best first, the best with all effects under the laws that leave least.

    Those that are as good as the best take these laws over: of such fits a search chooses.
    """
    best = in_other_laws(in_best_laws(fits[:1], modelled=False)[0])
    kept = {name: best.values[name] for name in best.names[:-1]}
    if all(fits[0].values[name].get("law") == values.get("law") for name, values in kept.items()):
        return [best, *fits[1:]]
    tied = [item for item in fits[1:] if item.cost < fits[0].cost + TIED]
    follow = [fitting.fit(item.data, item.values | kept, best.z) for item in tied]
    return [best, *follow, *fits[1 + len(tied) :]]
