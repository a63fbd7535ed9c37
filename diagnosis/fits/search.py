"""The search for effects of the catalogue that explain a part's gap: forward selection, exchange, pruning."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.fits import candidates, contact, fitting, hypothesis, settling, trade, worth
from diagnosis.fits.fitting import Fit, excess
from diagnosis.fits.laws.coupled import coupled
from diagnosis.fits.laws.loop import of_one_loop, single, whole_loops
from diagnosis.fits.residuals import Data
from diagnosis.fits.scales import Scales
from diagnosis.fits.trade import plainer, tied
from diagnosis.fits.unexplained import MATERIAL, foresees, leaves, model_error, remaining, resonant
from diagnosis.recorded.joined import column_of

MOST = 3  # effects of one part, the bias of a sensor aside: more of them can imitate any residual
# Effects of one part that leave only noise, each of them needed for that; the share of what is left that each must
# explain on the way. Of 11 gaps of unknown effects and other formulas none was taken for such a set.
MOST_NEEDED, STEP_OF_LEFT = 6, 0.3
# Systematic residual over noise that such a set is to explain, and the share of it that it may leave. The formula of a
# law leaves 0.3 where the specimen has another one, and two effects that were not there took 0.308 to 0.296, just below
# what can be seen. The least effect that counts as visible in a trial is 2. Of a fainter residual beside `MOST` effects
# a single further one must leave nothing: what a formula errs by, no one effect takes away.
FAINT, CLEARLY = 0.5, 0.5
HALVINGS = 20  # by which a value is found beyond which the system is the same


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


def search(data: Data, scales: Scales) -> Search:
    """What was found in a part, beside a resonance that its inputs swing where nothing else is left to explain.

    Beside effects one is looked for in a column only: tables and dampers swing by themselves, and so does what an
    effect of theirs leaves.
    """
    found, fine = at_any_size(data, scales)
    named = found.chosen
    asked = named.names and column_of(data.part) and not leaves(named, model_error(named))
    left = named if asked else fine
    swings = None if left is None else resonant(left)
    return found if swings is None else at_any_size(replace(data, related=swings), scales)[0]


def at_any_size(data: Data, scales: Scales) -> tuple[Search, Fit | None]:
    """What was found in a part, with nothing withheld where what it leaves acts for a short time only.

    Where no gap is larger than what two good solutions of one model may differ by, a smaller one is looked for: in the
    fit beside it, which is None where there is a gap. Behind a filter of a logger none is: what the stated filter is
    off, or does between the ticks, is larger than a smaller gap.
    """
    bare = settling.settled(fitting.fit(data, {}))
    found = found_from(data, bare, scales)
    if (
        data.part.exact
        or data.fine is data
        or leaves(found.chosen, model_error(found.chosen))
        or found_enough(found, bare)
    ):
        return found, None
    fine = fitting.polished(settling.settled(fitting.fit(data.fine, {}, bare.z)))
    erring = model_error(fine)
    if leaves(fine, erring) or foresees(fine, erring):
        return found_from(data.fine, fine, scales), None
    return found, fine


def found_enough(found: Search, bare: Fit) -> bool:
    """Whether effects were found that tell enough: of a larger gap than good solutions differ by, or all of a gap."""
    return bool(found.chosen.names) and (leaves(bare, model_error(bare)) or not worth.is_gap(found.chosen))


def found_from(data: Data, bare: Fit, scales: Scales) -> Search:
    """What was found in a part, from its fit without effects on."""
    if worth.is_gap(bare) and fitting.one_sided(bare):
        return searched(settling.settled(fitting.fit(data.whole, {})), scales)
    found = searched(bare, scales)
    left = found.chosen
    if left.names and leaves(left, model_error(left)) and fitting.one_sided(left, fitting.NOTHING):
        return searched(settling.settled(fitting.fit(data.whole, {})), scales)
    return found


def searched(bare: Fit, scales: Scales) -> Search:
    """Select effects one by one beside the fit without any, exchange and prune them, and fit what else might be."""
    bare, first = one_by_one(bare, scales)
    if first:
        whole = [*coupled(bare, first), *whole_loops(bare, first)]
        first = sorted([*whole, *first], key=lambda fit: fit.cost)
    bare, chosen, first, beside = selected(bare, first, scales)
    if not chosen.names:
        return Search(bare.data, bare, chosen, ())
    before = chosen
    chosen = pruned(bare, chosen)
    most = MOST + len(chosen.names) - count(chosen)
    chosen, as_good = trade.traded(bare, chosen, first, scales, most)
    if may_lack(bare, chosen):
        chosen = with_weaker(chosen, scales, beside if chosen is before else None)
    further = trade.under_unlike(bare, chosen, scales)
    others = [*candidates.alternatives(chosen, first, scales), *as_good, *further]
    others = sorted(others, key=lambda fit: fit.cost)
    chosen, others = by_fewer(chosen, others, first, scales)
    if (more := trade.two_for_one(chosen, others, scales, MOST_NEEDED)) is not chosen:
        chosen, others = more, [chosen, *candidates.alternatives(more, first, scales)]
    chosen, others = trade.on_all(chosen, others)
    found = Search(bare.data, bare, trimmed(chosen), tuple(map(trimmed, others)))
    found = plainest(inside_ranges(likeliest(found)))
    stands = found.chosen
    if set(stands.names) != set(chosen.names) and may_lack(bare, stands):
        stands = with_weaker(stands, scales)  # what an exchanged effect hid
    if (chosen := fewest(stands)) is found.chosen:
        return found
    chosen, others = trade.on_all(chosen, candidates.alternatives(chosen, first, scales))
    return plainest(Search(bare.data, bare, chosen, tuple(map(trimmed, others))))


def by_fewer(chosen: Fit, others: list[Fit], first: list[Fit], scales: Scales) -> tuple[Fit, list[Fit]]:
    """The effects chosen and the alternatives, or fewer effects that do the same, with the chosen ones beside them.

    They are those of an alternative that the data cannot tell from the chosen effects, and of which one does nothing: a
    compliance within a loop does what a gain and a time constant do, and is found beside either of them only.
    """
    level = [fewest(item) for item in others if len(item.names) == len(chosen.names) and tied(chosen, item)]
    stands, as_good = trade.simplest(
        [chosen, *(item for item in level if len(item.names) < len(chosen.names))]
    )
    if stands is chosen:
        return chosen, others
    return stands, [*as_good, *candidates.alternatives(stands, first, scales)]


def one_by_one(bare: Fit, scales: Scales) -> tuple[Fit, list[Fit]]:
    """The fit without effects, and those with one, best first, under one noise.

    Under noise that is a gap no effect shows. Where that of one reading stands out, an effect may show for a small part
    that this noise leaves of another one, which is then far likelier.
    """
    first = candidates.best_laws(bare, scales) if worth.is_gap(bare) else []
    shows = bool(first) and worth.is_worth(bare, bare, first[0])
    if shows and not settling.stands_out(bare):
        return bare, first
    other, instead = settling.instead_of_colour(bare, scales)
    if not instead or (shows and not settling.far_likelier(instead[0], settling.remodelled(first[0]))):
        return bare, first
    return other, instead


def selected(bare: Fit, first: list[Fit], scales: Scales) -> tuple[Fit, Fit, list[Fit], list[Fit] | None]:
    """The fit without effects, the one with all effects that are worth it, and those with one, under one noise.

    The last are fits with one effect more, none of them worth it, where they were tried. `first` are the fits with one
    effect, best first. As the noise follows from what is left, it may change with every effect.
    """
    chosen, better = bare, first
    while better and worth.is_worth(bare, chosen, best := trade.foremost(better)):
        if len(best.names) > 1 and not of_one_loop(best):
            best = candidates.in_other_laws(candidates.exchanged(best, scales))
        chosen = settling.settled(best, bare.data)
        chosen = by_impacts(bare, chosen)
        while count(chosen) < MOST and (more := settling.beside_colour(chosen, scales)):
            chosen = more
        if chosen.data is not bare.data:
            bare, *first = settling.all_again((bare, *first), chosen.data)
            if len(chosen.names) == 1 and not worth.is_worth(bare, bare, chosen):
                return bare, bare, first, None
        if count(chosen) >= MOST or worth.enough(bare, chosen):
            return bare, chosen, first, None
        # beside a loop of many parts first laws show what else there is: others take as long as all before
        further = candidates.extended if of_one_loop(chosen) else candidates.best_laws
        better = further(chosen, scales)
    return bare, chosen, first, better


def by_impacts(bare: Fit, fit: Fit) -> Fit:
    """A fit that leaves much, measured by how well impacts are known where an end stop is worth it by that as well."""
    vaguer = contact.vaguer(fit) if remaining(fit) > worth.LOUD else None
    if vaguer is None:
        return fit
    without = settling.again(bare, vaguer.data)
    return vaguer if worth.is_worth(without, without, vaguer) else fit


def count(fit: Fit) -> int:
    """How many effects of a fit can imitate something else; those that were found together as one loop are one."""
    return sum(not fit.data.catalogue[name].motionless for name in single(fit)) + bool(of_one_loop(fit))


def may_lack(bare: Fit, fit: Fit) -> bool:
    """Whether effects may be missing beside those of a fit that explain too little by themselves.

    A fit that leaves more than `LOUD` still lacks its largest effects, and so does one that explains less than each
    further effect must.
    """
    begun = excess(fit) <= (1.0 - STEP_OF_LEFT) * excess(bare)
    return begun and remaining(fit) < worth.LOUD and not of_one_loop(fit)


def with_weaker(chosen: Fit, scales: Scales, beside: list[Fit] | None = None) -> Fit:
    """The effects chosen with further ones where all together leave nothing that can be seen; else those chosen.

    Beside an effect of a thousand times the noise, one of twenty times the noise explains too little of the whole gap
    to be worth it, and so nothing behind it is found either. But effects that are not there hardly leave only noise.
    `beside` are fits with one effect more, best first, where they are known already.
    """
    fit, left = chosen, remaining(chosen)
    faint = left <= FAINT
    if faint and count(chosen) < MOST:
        return chosen
    share, size = (worth.NEARLY_ALL, len(chosen.names) + 1) if faint else (STEP_OF_LEFT, MOST_NEEDED)
    while wanting(fit) and len(fit.names) < min(size, MOST_NEEDED):
        further = beside if fit is chosen and beside is not None else candidates.best_laws(fit, scales)
        if not further or excess(further[0]) > (1.0 - share) * excess(fit):
            break
        fit = further[0]
        if wanting(fit):  # an effect that came before may have stood in for the new one as well
            fit = candidates.exchanged(fit, scales)
    most = min(worth.SEEN, CLEARLY * left)
    if len(fit.names) == len(chosen.names) or remaining(fit) > most or (faint and worth.is_gap(fit)):
        return chosen
    fit = needed(fit, most)
    likely = fit.prior < max(worth.usual(fit), chosen.prior)
    return fit if likely and len(fit.names) > len(chosen.names) else chosen


def wanting(fit: Fit) -> bool:
    """Whether a further effect may be missing: more is left than a model errs by, or nominal parameters stand in."""
    return leaves(fit, model_error(fit)) or worth.strained(fit)


def needed(fit: Fit, most: float) -> Fit:
    """The fit without effects without which no more than `most` (systematic residual over noise) is left either."""
    for name in fit.names:
        if len(fit.names) > 1 and remaining(less := candidates.without(fit, name)) < most:
            fit = less
    return fit


def pruned(bare: Fit, fit: Fit) -> Fit:
    """The fit without effects that explain too little."""
    return cleared(fit, lambda less, fit: worth.is_worth(bare, less, fit))


def fewest(fit: Fit) -> Fit:
    """The fit without effects that gain no more than chance does.

    An effect that was exchanged for another one may stand beside one that only the former needed.
    """
    return trimmed(cleared(fit, lambda less, fit: worth.pays(*worth.gained(less, fit))))


def cleared(fit: Fit, stays: Callable[[Fit, Fit], bool]) -> Fit:
    """The fit without effects that do not stay, as fits without and with one say; at least one effect is left.

    Those that change the residuals least are judged first: beside one that changes nothing, an effect that explains a
    whole gap would be worth nothing either.
    """
    sizes = map(np.max, worth.changes(fit))
    whole = of_one_loop(fit)
    for _, name in sorted(zip(sizes, fit.names, strict=True)):
        if len(fit.names) < 2:
            break
        if name in whole:
            continue
        less = candidates.without(fit, name)
        if not (is_there(fit, less, name) or stays(less, fit)):
            fit = less
    return fit


def is_there(fit: Fit, less: Fit, name: str) -> bool:
    """Whether an effect that no motion causes stays, because the coloured noise is far less likely without it.

    It cannot repair the formula of what a motion does, and beside such noise it explains little.
    """
    return fit.data.catalogue[name].motionless and settling.beats_colour(fit, less)


def trimmed(fit: Fit) -> Fit:
    """A fit whose effects are no larger than what changes the system: no more delay taken away than there is."""
    values = {name: dict(given) for name, given in fit.values.items()}
    for name, given in values.items():
        effect = fit.data.catalogue[name]
        system = hypothesis.lay(
            fit.data, fit.z, {key: item for key, item in fit.values.items() if key != name}
        )
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


def likeliest(search: Search) -> Search:
    """The search with that one in front of as many effects that is far likelier than the chosen ones.

    The effects beside an exchanged one were chosen before it, so that a further exchange may still pay.
    """
    chosen = search.chosen
    same = [item for item in search.alternatives if len(item.names) == len(chosen.names)]
    best = min(same, key=lambda fit: fit.cost, default=chosen)
    seen_more = remaining(best) > max(remaining(chosen), MATERIAL)
    if best.cost > chosen.cost - fitting.TIED or seen_more or plainer(chosen, best):
        return search
    return in_front(search, best)


def inside_ranges(search: Search) -> Search:
    """The search with effects inside their ranges in front of ones at the end of theirs, if none is seen to leave more.

    At the end of its range an effect turns into another one, as pinching without stiffness at the origin into slip.
    What tells the two then is the formula, which no laboratory follows exactly.
    """
    chosen = search.chosen
    if not fitting.at_end(chosen):
        return search
    others = [item for item in search.alternatives if len(item.names) == len(chosen.names)]
    faint = [item for item in others if remaining(item) < MATERIAL and not fitting.at_end(item)]
    return in_front(search, min(faint, key=lambda fit: fit.cost, default=chosen))


def in_front(search: Search, stands: Fit) -> Search:
    """The search with one of its alternatives as the chosen fit, and that among the alternatives."""
    if stands is search.chosen:
        return search
    rest = [search.chosen, *(item for item in search.alternatives if item is not stands)]
    return replace(search, chosen=stands, alternatives=tuple(rest))


def plainest(search: Search) -> Search:
    """The search with that one in front of as many effects that the data cannot tell from the chosen ones.

    Those that move nominal parameters further than chance does stand behind the others, and effects at the end of their
    range behind effects inside it. A machine's effect stands before a sensor's, then the one with the fewest free
    parameters, then other values of the plan before laws, then the likeliest, where one of several laws is as likely as
    any other of its effect.
    """
    catalogue, chosen = search.data.catalogue, search.chosen

    def order(fit: Fit) -> tuple[bool, bool, int, int, int, float]:
        artefacts = sum(catalogue[name].kind == "measurement" for name in fit.names)
        laws = sum(math.log(max(1, len(catalogue[name].laws))) for name in fit.names)
        beyond = len(fit.names) - len(hypothesis.values_of_plan(fit.data, fit.values))
        pulled = fit.prior > least + trade.PULLED
        return (
            pulled,
            bool(fitting.at_end(fit)),
            artefacts,
            trade.freedom(fit)[0],
            beyond,
            fit.cost + 2.0 * laws,
        )

    same = [item for item in search.alternatives if len(item.names) == len(chosen.names)]
    level = [item for item in same if tied(chosen, item) or plainer(item, chosen)]
    least = min(item.prior for item in (chosen, *level))
    return in_front(search, min([chosen, *level], key=order))


def exchanged_pair(chosen: Fit, other: Fit) -> tuple[str, str] | None:
    """The effect that was taken away and the one that came for it."""
    gone, come = set(chosen.names) - set(other.names), set(other.names) - set(chosen.names)
    return (gone.pop(), come.pop()) if len(gone) == len(come) == 1 else None
