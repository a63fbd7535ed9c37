"""Other numbers of effects that explain as much: one in the place of two, and two in the place of one.

Selection one by one does not reach them. Of descriptions that the data cannot tell apart the one with the fewest free
parameters stands, of these the one with the fewest effects (Schwarz, Annals of Statistics 6 (1978)); the others are
kept beside it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from diagnosis.fits import candidates, fitting, worth
from diagnosis.fits.fitting import TIED, Fit, excess
from diagnosis.fits.hypothesis import Problem, Values, left_out, values_of_plan
from diagnosis.fits.laws.afresh import afresh
from diagnosis.fits.laws.best import ROUNDS, STEPS, begun, descended, fitted, raced
from diagnosis.fits.laws.loop import of_one_loop, single
from diagnosis.fits.laws.unlike_first import unlike_first
from diagnosis.fits.scales import Scales
from diagnosis.fits.threads import each
from diagnosis.fits.unexplained import MATERIAL, leaves, model_error

# Squared distance of two predictions, in noise. Where one of them is true, their costs differ by this distance, give or
# take twice its root: from here on by more than `TIED`, but for one chance in a thousand.
APART = 36.0
RIVALS = 2  # single effects behind the best one that are tried with a second one
# Of what one effect by itself leaves: less must be left after a few steps under another of its laws if this is to do
# what two effects do. A spring and dashpot in series beside a column leave 0.3 then, in place of a dashpot and a lag.
NEARING = 0.5
# Of what is left without effects: less must be left with one that follows another effect closely, so that this one may
# be found in its place. Where the best effect of all leaves more, nothing of the catalogue alone is near the cause.
FOLLOWED = 0.5
TRIED = 3  # candidates that are fitted in such a place: they must come close at once
OF_FORMULA = 0.25  # of the most that two good solutions of one model differ by: what they differ by as a rule
REFITTED = 8  # steps over all seconds of hypotheses that leave as much of those seen
PULLED = 3.84  # of Σ z²: a single effect that truly is none brings back as much in one of twenty cases (χ²)


def tied(chosen: Fit, other: Fit) -> bool:
    """Whether the data cannot tell another fit from the chosen one: it fits as well and predicts the same.

    Two fits that miss the data as far in different ways are not the same: more data would decide between them.
    """
    noise = max(1.0, chosen.chi / chosen.data.size)
    apart = float(np.sum(np.square(other.reduced - chosen.reduced)))
    return (other.cost - chosen.cost) / noise < TIED and apart / noise < APART


def plainer(fit: Fit, other: Fit) -> bool:
    """Whether other values of the plan do what laws with more free parameters do, to what formulas differ by.

    So small a difference, which nobody could see, is no reason for another mechanism.
    """
    come = set(fit.names) - set(other.names)
    if not come or freedom(fit)[0] >= freedom(other)[0]:
        return False
    if not come <= set(values_of_plan(fit.data, fit.values)) or (leaves(fit) and not leaves(other)):
        return False
    apart = np.sqrt(np.mean(np.square(fit.reduced - other.reduced), axis=0) / fit.data.group)
    return bool(np.all(apart <= np.minimum(MATERIAL, OF_FORMULA * model_error(other))))


def on_all(fit: Fit, others: Sequence[Fit]) -> tuple[Fit, list[Fit]]:
    """A fit and others with one effect exchanged, fitted to all seconds where the data cannot tell them apart then.

    Parameters that the seconds seen hardly tell err in the withheld ones, by which hypotheses are ranked, and in one
    hypothesis more than in another that leaves as much of what both have seen.
    """
    seen = seen_cost(fit)
    alike = [
        item
        for item in others
        if len(item.names) == len(fit.names) and abs(seen_cost(item) - seen) < TIED and not tied(fit, item)
    ]
    if not alike or fit.data.train.all():
        return fit, list(others)
    best, *rivals = each(
        lambda item: fitting.fit(fit.data.whole, item.values, item.z, REFITTED, rounds=1), [fit, *alike]
    )
    level = {id(item): rival for item, rival in zip(alike, rivals, strict=True) if tied(best, rival)}
    if not level:
        return fit, list(others)

    def here(item: Fit) -> Fit:
        return fitting.at(fit.data, item.values, item.z)

    return here(best), [here(level[id(item)]) if id(item) in level else item for item in others]


def seen_cost(fit: Fit) -> float:
    """What the seconds that a fit has seen cost, with its prior."""
    return float(np.sum(np.square(fit.reduced[fit.data.train]))) + fit.prior


def freedom(fit: Fit) -> tuple[int, int]:
    """How many parameters of effects a fit moves, and how many effects it has."""
    return len(Problem(fit.data, fit.values).frees), len(fit.names)


def foremost(fits: Sequence[Fit]) -> Fit:
    """Of fits, best first, that the data cannot tell from the best the one with the fewest free parameters."""
    return min((item for item in fits if tied(fits[0], item)), key=freedom)


def traded(
    bare: Fit, chosen: Fit, first: list[Fit], scales: Scales, most: int
) -> tuple[Fit, tuple[Fit, ...]]:
    """The best description with one effect more or less, and those with another number that are as good.

    `first` are the fits with one effect, best first; no description has more than `most` effects.
    """
    found = [*joined(chosen, scales), *alone(chosen), *under_others(chosen)]
    follows = len(chosen.names) == 1 and excess(chosen) < FOLLOWED * excess(bare)
    if follows and worth.is_gap(chosen) and not chosen.data.part.exact:
        found += afresh(chosen, scales)
    found += in_further_laws(chosen, first)
    if len(chosen.names) < most:
        found += parted(bare, chosen, scales)
        found += paired(bare, chosen, first, scales)
        found += released(chosen, scales)
    stands, as_good = simplest([chosen, *found])
    plan = of_the_plan(bare, stands, first)
    return simplest([stands, *as_good, *plan]) if plan else (stands, as_good)


def simplest(fits: Sequence[Fit]) -> tuple[Fit, tuple[Fit, ...]]:
    """Of fits that the data cannot tell from the best the simplest, and those of them with more or fewer effects.

    One that moves nominal parameters too far to be an explanation stands behind those that do not.
    """
    best = min(fits, key=lambda item: item.cost)
    level = [item for item in fits if tied(best, item) or plainer(item, best)]
    sound = [] if worth.is_gap(best) else [item for item in level if not worth.is_gap(item)]
    stands = min(sound or level, key=freedom)
    return stands, tuple(item for item in level if len(item.names) != len(stands.names))


def joined(fit: Fit, scales: Scales) -> list[Fit]:
    """Fits with one effect in the place of two of three."""
    result = []
    for gone in itertools.combinations(single(fit), 2):
        kept = {name: values for name, values in fit.values.items() if name not in gone}
        if kept:
            less = fitting.fit(fit.data, kept, fit.z)
            result += candidates.extended(less, scales, count=TRIED, known=fit)[:1]
    return result


def alone(fit: Fit) -> list[Fit]:
    """Fits with one of two effects, where shapes that it had left out may make up for the other.

    A shape that begins where it has no influence stays there in a search, which then adds an effect for what it does.
    """
    result = []
    for name, values in fit.values.items() if len(fit.names) == 2 else ():
        effect = fit.data.catalogue[name]
        law = effect.law(values)
        starts = law.shapes if law else {}
        shapes = [item.name for item in effect.parameters if item.name in starts and left_out(item, values)]
        if shapes:
            shaped = {**values, **{shape: starts[shape] for shape in shapes}}
            result.append(fitting.polished(fitting.fit(fit.data, {name: shaped}, fit.z)))
    return result


def under_others(fit: Fit) -> list[Fit]:
    """Fits without one of the effects, with another one of them under a further of its laws.

    A law that does what two effects do is else tried only where its effect comes last, and not where another one is
    chosen first or where the first law with that other effect leaves nothing.
    """
    result: list[Fit] = []
    for gone, name in itertools.permutations(single(fit), 2):
        if len(fit.data.catalogue[name].laws) > 1:
            rest = {key: values for key, values in fit.values.items() if key not in (gone, name)}
            less = fitting.fit(fit.data, rest | {name: fit.values[name]}, fit.z)
            result += raced([less], NEARING * excess(less)).values()
    return each(descended, [item for item in result if fitting.near(item, fit)])


def of_the_plan(bare: Fit, fit: Fit, first: Sequence[Fit]) -> list[Fit]:
    """Fits with two other values of the plan in the place of effects of one site that move as many parameters or more.

    A table that is both late and slow looks like one whose oil gives way, or one with a feed-forward and a little play.
    One of the two by itself explains much then. `first` are the fits with one effect; each of two begins at half of
    what it is alone.
    """
    if freedom(fit)[0] < 2 or leaves(fit):
        return []
    sites = {fit.data.catalogue[name].site for name in fit.names}
    if len(sites) != 1 or set(fit.names) <= set(values_of_plan(fit.data, fit.values)):
        return []
    plain = [item for item in first if freedom(item)[0] == 1 and values_of_plan(item.data, item.values)]
    if all(excess(item) > FOLLOWED * excess(bare) for item in plain):
        return []
    starts = [half(one) | half(other) for one, other in itertools.combinations(plain, 2)]
    rough = each(lambda start: fitting.fit(fit.data, start, None, STEPS, rounds=ROUNDS), starts)
    return each(descended, [item for item in rough if fitting.near(item, fit)])


def half(fit: Fit) -> Values:
    """The effects of a fit at half of what they are."""
    catalogue = fit.data.catalogue
    return {
        name: given
        | {
            item.name: 0.5 * (item.null + given[item.name])
            for item in catalogue[name].parameters
            if not item.shape
        }
        for name, given in fit.values.items()
    }


def parted(bare: Fit, fit: Fit, scales: Scales) -> list[Fit]:
    """Fits in which an effect has the first of its laws and another effect stands beside it, as good or worth it.

    Effects that one model holds together are left as they are: one of them under another law explains little.
    """
    result = []
    formulas = {name: fit.data.catalogue[name].law(values) for name, values in fit.values.items()}
    whole = {held for name, law in formulas.items() if law and law.beside for held in (name, *law.beside)}
    for name, values in fit.values.items():
        if not values.get("law") or name in whole or name in of_one_loop(fit):
            continue
        usual = fit.data.catalogue[name].under(0, values)
        plain = fitting.fit(fit.data, fit.values | {name: usual}, fit.z)
        others = candidates.extended(plain, scales, count=TRIED, known=fit)[:1]
        if any(item.cost < fit.cost - TIED for item in others):  # the fit may not have reached its own end
            fit = fitting.fit(fit.data, fit.values, fit.z)
            result.append(fit)
        result += [item for item in others if tied(fit, item) or worth.is_worth(bare, fit, item)]
    return result


def paired(bare: Fit, fit: Fit, first: list[Fit], scales: Scales) -> list[Fit]:
    """Fits with two effects, without the one that a fit has by itself, where that one leaves more than noise."""
    if len(fit.names) != 1 or not leaves(fit):
        return []
    rivals = [item for item in first if item.names != fit.names][:RIVALS]
    best = each(lambda rival: candidates.extended(rival, scales, count=TRIED, known=fit)[:1], rivals)
    return [item for others in best for item in others if worth.is_worth(bare, fit, item)]


def released(fit: Fit, scales: Scales) -> list[Fit]:
    """Fits with one effect more that bring nominal parameters back, of a fit that leaves nothing but has moved them.

    The data cannot tell them from it, as a gain of 6 % beside a compliance from a larger compliance by which gain and
    time constant are 3 % off each: the tolerances alone speak for the one or the other.
    """
    if fit.prior < PULLED or leaves(fit):
        return []
    others = candidates.extended(fit, scales, count=TRIED, known=fit)
    return [item for item in others if tied(fit, item) and item.prior < fit.prior - PULLED]


def in_further_laws(fit: Fit, first: Sequence[Fit]) -> list[Fit]:
    """Single effects under further laws, of a fit that leaves nothing but has moved nominal parameters.

    Those that are about as good under their first law: a lag of second order lies between a delay and a lag, and
    nominal parameters make up for what either does not do. `first` are the fits with one effect.
    """
    if fit.prior < PULLED or leaves(fit):
        return []
    alike = [item for item in first if item.cost < fit.cost + APART]
    starts = each(lambda item: begun(item, modelled=False), alike)
    found = each(lambda item: fitted(item, STEPS, ROUNDS), [item for items in starts for item in items])
    return [item for item in found if item.prior < fit.prior - PULLED]


def under_unlike(bare: Fit, fit: Fit, scales: Scales) -> list[Fit]:
    """Single effects under laws that no first law is like, in the place of one that follows a gap and leaves something.

    A search looks at such laws only where no first law promises much: a soft end stop promises nearly all of what a
    spring does that stiffens with its stroke.
    """
    if len(fit.names) != 1 or fit.data.part.exact or not leaves(fit):
        return []
    if excess(fit) > FOLLOWED * excess(bare):
        return []
    other = fitting.at(fit.data, bare.values, bare.z)
    found = [
        item for item in unlike_first(fitting.begun(other), scales) if item.effect.name not in fit.values
    ]
    starts = [({item.effect.name: item.values}, item.z) for item in found[:TRIED]]
    tried = each(lambda start: fitting.fit(fit.data, start[0], start[1], STEPS), starts)
    return each(descended, [item for item in tried if fitting.near(item, fit)])


def two_for_one(fit: Fit, rivals: Sequence[Fit], scales: Scales, most: int) -> Fit:
    """The fit, or one with two effects in the place of one that brings back nominal parameters which moved too far.

    `rivals` are fits with one effect exchanged, best first. One effect may do what two do, as a compliance what a gain
    and a time constant do, if nominal parameters do the rest.
    """
    if fit.prior <= worth.usual(fit) or len(fit.names) < 2 or len(fit.names) >= most:
        return fit
    others: list[Fit] = []
    for rival in [item for item in rivals if len(item.names) == len(fit.names)][:RIVALS]:
        others += candidates.extended(rival, scales, count=TRIED, known=fit)[:1]
    level = [item for item in others if item.prior < fit.prior - PULLED and item.cost < fit.cost + TIED]
    sound = [item for item in level if not worth.is_gap(item)]
    return min(sound, key=lambda item: item.cost, default=fit)
