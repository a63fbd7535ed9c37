"""The verdict on one part: how well which effects explain its gap, how surely, and which cannot be separated."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from diagnosis.findings.sensors.leak import leaks
from diagnosis.findings.sensors.one_motion import one_motion, one_place
from diagnosis.findings.sensors.own_reading import errors, gives_energy, machine_alone, of_column
from diagnosis.findings.sensors.slow_noise import under_less_noise
from diagnosis.findings.sites.likely import APART, TRUE_LEAVES, likely_sites, ranked
from diagnosis.findings.sites.signatures import laboratory_of
from diagnosis.fits import fitting, hypothesis, residuals, sensor_noise
from diagnosis.fits.fitting import Fit, at_end
from diagnosis.fits.residuals import Data
from diagnosis.fits.search import Search, exchanged_pair
from diagnosis.fits.trade import tied
from diagnosis.fits.unexplained import MATERIAL, foresees, gaps, leaves, model_error
from diagnosis.fits.worth import DATA_GAIN, PRIOR_GAIN, SEEN, at_bound
from diagnosis.recorded.nuisances import LoggedReadings
from diagnosis.recorded.parts import MODEL_ERROR
from diagnosis.report.records import Outcome
from laboratories.effects.sites import is_sensor
from models.registry import Array

# Share of a gap's energy from which on effects that leave something are named: what they explain then is the larger
# part.
HALF = 0.5
# The two figures below turn costs into probabilities; they were set on draws of `rths blind --set tune` (ADR 0012).
# Differences of cost are divided by TEMPERATURE, since what a model leaves is not quite white. DOUBT is the probability
# that the true cause is not among the effects named, by outcome.
TEMPERATURE = 3.0
DOUBT = {"explained": 0.02, "partly": 0.12, "unknown": 0.9}
# Probability of several effects of which one unknown cause may look the same, over that without: half, as one cause is
# no less likely than two.
EITHER = 0.5
MOST_LEFT = 0.2  # of a gap's rms that effects may leave as an error of such solutions: 4 % of its energy
# Share of a gap's rms that may be taken for coloured noise where only the residual itself is evidence: a sixth of its
# energy.
OWN = 0.4
# Standard deviations of Σ z² above its mean from which on the nominal parameters speak against the effects beside them.
STRAINED = 3.0
# Share of a gap's energy beyond any that these stand-ins explained.
NEARLY = 0.99
# Stand-ins per true name among the verdicts that leave nothing: 5 of 78 were wrong (ADR 0052).
FALSE = 0.06
WITHOUT_GAP: tuple[Outcome, ...] = ("none", "tolerances")  # that leave nothing to explain
UNNAMED: tuple[Outcome, ...] = ("partly", "unknown")  # in which some of the gap has no named cause


class OwnError(NamedTuple):
    """An error of one reading by itself: no motion predicts it, and it is not its sensor's noise."""

    signal: str
    ratio: float  # its rms over that of the noise
    sites: tuple[str, ...] = ()  # from which it may come, the likeliest first; none where readings must tell
    text: str = ""  # a sentence on it, empty where another warning says it


@dataclass(frozen=True)
class PartVerdict:
    """The verdict on one part."""

    search: Search  # in the recording that is reported on
    outcome: Outcome
    probability: float  # of the chosen effects, or those tied with them
    others: tuple[tuple[Fit, float], ...]  # alternatives with their probability
    equivalent: tuple[tuple[str, ...], ...]
    joined: Search | None = None  # in all recordings, where several were searched at once
    doubted: str = ""  # the reading of which the gap might also be slow noise, empty for none
    own: OwnError | None = None  # the gap, where it is an error of one reading by itself

    @property
    def searched(self) -> Search:
        """Where the effects and their parameters were found: in all recordings."""
        return self.joined or self.search

    @property
    def effects(self) -> tuple[str, ...]:
        """The chosen effects."""
        return self.search.chosen.names


def judge(search: Search) -> PartVerdict:
    """The verdict on a part."""
    less, name = under_less_noise(search)
    if not search.chosen.names:
        outcome = without_effects(less)
        return PartVerdict(less, outcome, 1.0, (), (), doubted=name if outcome == "unknown" else "")
    if less is not search and how_well(less) == "explained":
        less, name = search, ""
    return replace(with_effects(machine_alone(less)), doubted=name)


def with_effects(search: Search) -> PartVerdict:
    """The verdict on a part for which a search found effects."""
    outcome = how_well(search)
    if outcome == "unknown" or (outcome == "partly" and imitated(search)):
        return unnamed(search)
    if trifling(search) or one_motion(search):
        return unnamed(search)
    chances = odds(search)
    same = [tied(search.chosen, other) for other in search.alternatives]
    whole = 1.0 + sum(chances)
    named = (1.0 + sum(value for value, yes in zip(chances, same, strict=True) if yes)) / whole
    sure = (1.0 - DOUBT[outcome]) * certainty(search) * (EITHER if other_cause(search) else 1.0)
    others = tuple(
        (other, sure * value / whole)
        for other, value, yes in zip(search.alternatives, chances, same, strict=True)
        if not yes
    )
    return PartVerdict(search, outcome, sure * named, others, equivalents(search))


def other_cause(search: Search) -> bool:
    """Whether one other cause may look the same as what is named, to the last of what can be seen.

    It is another part of a loop of which several values are named, another law of a specimen of which several effects
    are named, another place of a machine in the place of offsets, or another law of a machine of which a reading is
    named as well that shows nothing else: both are one function of the same motion, as are a column that gives energy
    and a load cell with hysteresis, or a dashpot and a charge that leaks. A small gap may have any cause.
    """
    fit = search.chosen
    machine = loop_of_several(search) or specimen_of_several(search) or one_place(search)
    return bool(machine or errors(fit) or gives_energy(fit) or leaks(fit) or small(search))


def loop_of_several(search: Search) -> str:
    """The transfer system of which several values of the plan are named, empty for none.

    Its loop has more parts than the plan has values of it: a filter in its feedback looks like a shorter time constant
    with a longer delay, and leaves nothing to be seen.
    """
    data, part = search.data, laboratory_of(search.data.part)
    if part is None:
        return ""
    loop = part.lab.site(part.lab.kind.sites[0])
    values = hypothesis.values_of_plan(data, search.chosen.values)
    return loop if sum(data.catalogue[name].site == loop for name in values) > 1 else ""


def specimen_of_several(search: Search) -> str:
    """The column of which several effects are named that are not all values of the plan, empty for none.

    Each of its effects is a force that follows from one motion, as is the law of any specimen that the catalogue lacks:
    two of them together imitate it.
    """
    site, values = of_column(search.chosen)
    laws = len(values) - len(hypothesis.values_of_plan(search.data, values))
    return site if len(values) > 1 and laws > 0 else ""


def odds(search: Search) -> list[float]:
    """How probable each alternative is, over the chosen effects."""
    noise = max(1.0, search.chosen.chi / search.chosen.data.size)
    worse = [max((other.cost - search.chosen.cost) / noise, 0.0) for other in search.alternatives]
    return [math.exp(-min(one / (2.0 * TEMPERATURE), 700.0)) for one in worse]


def seen_in(data: Data, verdict: PartVerdict) -> PartVerdict:
    """The verdict on several recordings as it shows in the data of one of them."""
    joined = verdict.search
    if len(joined.data.part.measured) == len(data.part.measured):
        return verdict
    ticks = len(data.part.measured)
    lines = None if joined.data.lines is None else joined.data.lines[:ticks]
    spikes = None if joined.data.spikes is None else joined.data.spikes[:ticks]
    here = replace(
        residuals.measured_by(data, joined.data.white), noise=joined.data.noise, lines=lines, spikes=spikes
    )
    if here.noise:
        here = replace(here, related=sensor_noise.related(here, here.system))

    def there(fit: Fit) -> Fit:
        return fitting.at(here, fit.values, fit.z)

    alternatives = tuple(map(there, joined.alternatives))
    search = Search(here, there(joined.commissioned), there(joined.chosen), alternatives)
    others = tuple((there(fit), chance) for fit, chance in verdict.others)
    return replace(verdict, search=search, others=others, joined=joined)


def unnamed(search: Search) -> PartVerdict:
    """The verdict on a gap of which no effect explains half: nothing is named, and the nearest effects are listed."""
    near = (search.chosen, *search.alternatives)
    costs = np.array([fit.cost for fit in near])
    odds = np.exp(
        -np.clip(
            (costs - costs.min()) / max(1.0, costs.min() / search.chosen.data.size) / (2.0 * TEMPERATURE),
            0.0,
            700.0,
        )
    )
    chances = (1.0 - DOUBT["unknown"]) * odds / odds.sum()
    bare = replace(search, chosen=search.commissioned)
    return PartVerdict(
        bare, "unknown", DOUBT["unknown"], tuple(zip(near, map(float, chances), strict=True)), ()
    )


def without_effects(search: Search) -> Outcome:
    """The outcome where no effect is named: unknown, explained by the tolerances, or nothing above the noise."""
    fit, erring = search.chosen, model_error(search.chosen)
    foreseen = small(search) and foresees(fit, erring)
    if search.left > SEEN or leaves(fit, erring) or foreseen or pinned(fit):
        return "unknown"
    nominal = fitting.at(search.data, {}, np.zeros(fit.z.size))
    return "tolerances" if leaves(nominal) else "none"


def how_well(search: Search) -> Outcome:
    """Explained if the rest is noise and no nominal parameter is too far off; otherwise partly explained or unknown.

    An effect that only imitates the true one leaves a systematic residual, however much of the gap it closes, or the
    nominal parameters have to give way, or it would be larger than it can be.
    """
    if not (falls_short(search) or swings(search)):
        return "explained"
    return "partly" if search.explained > HALF else "unknown"


def falls_short(search: Search) -> bool:
    """Whether effects leave more than noise, strain nominal parameters or explain too small a gap."""
    fit = search.chosen
    strained = bool(pinned(fit)) or farthest(fit) < HALF or bool(at_end(fit))
    everywhere = fitting.at(replace(fit.data, vague=None), fit.values, fit.z)  # behind impacts as well
    return strained or leaves(everywhere, allowed(search)) or unproven(search) or small(search)


def swings(search: Search) -> bool:
    """Whether effects leave a resonance that the inputs swing: another mechanism, as no law leaves one."""
    related, fit = search.data.related, search.chosen
    return related is not None and related.swings and foresees(fit, model_error(fit))


def small(search: Search) -> bool:
    """Whether a gap is so small that two good solutions of one model may differ by it: its cause may be anything."""
    return search.data.erring < MODEL_ERROR


def imitated(search: Search) -> bool:
    """Whether effects that leave something are too doubtful to be named at all.

    Where nominal parameters give way so far that what they explain says little for the effects, these are named if they
    explain nearly all of a gap: beside another formula of the true effect the parameters take what is left.
    """
    stretched = strain(search) < HALF and search.explained < NEARLY
    return stretched or artefact(search) or misplaced(search)


def artefact(search: Search) -> bool:
    """Whether nothing but errors of readings is named, and these leave more of the gap than stand-ins leave.

    A sensor errs by a simple law, so that what such an error explains in part has another cause. Where a logger
    recorded, which may do anything to its channels, that does not follow.
    """
    data = search.data
    kinds = {data.catalogue[name].kind for name in search.chosen.names}
    logged = any(isinstance(item, LoggedReadings) for item in data.part.nuisances)
    return kinds == {"measurement"} and not logged and search.explained < 1.0 - TRUE_LEAVES


def trifling(search: Search) -> bool:
    """Whether nothing but gains of readings is named, smaller than what their machine is known to.

    That a reading is too large by less than the tolerances of the machine's parameters follows only if the machine's
    model is exact beyond them: a parameter that is no constant, within its tolerance, changes the reading as much. The
    machine must change the same readings.
    """
    data, fit = search.data, search.chosen
    known = min((item.tolerance for item in data.part.nuisances if not item.of_record), default=0.0)
    effects = [data.catalogue[name] for name in fit.names]
    gains = [abs(fit.values[item.name]["factor"] - 1.0) for item in effects if item.fault == "gain"]
    if len(gains) < len(effects) or max(gains) >= known:
        return False
    sites = {item.site for item in ranked(search.commissioned) if item.cost < APART}
    return not sites <= {item.site for item in effects}


def misplaced(search: Search) -> bool:
    """Whether a single other site explains more of a gap than the effects named, by the readings that it changes.

    An effect changes the readings of its site, so that one that only imitates the cause changes others. It is misplaced
    as well where it changes the right reading as a machine does, and the gap is a function of what the sensor reads;
    but not an effect of a specimen, whose law is in no list and may be any function of its motion and force.
    """
    sites = {search.data.catalogue[name].site for name in search.chosen.names}
    found = ranked(search.commissioned)
    by_form = set(likely_sites(search.commissioned))
    _, specimen = of_column(search.chosen)
    sensors_alone = not specimen and bool(by_form) and all(map(is_sensor, by_form))
    near = by_form if sensors_alone else {item.site for item in found if item.cost < APART}
    return bool(found) and not sites & near and found[0].left < 1.0 - search.explained


def allowed(search: Search) -> Array:
    """What effects may leave beyond noise, over σ (signals,): what two good solutions of one model may differ by.

    That is no more than a small share of the gap, as otherwise an effect that explains half of a small gap would do.
    """
    whole = np.array([item.ratio for item in gaps(search.commissioned, search.data.group)])
    return np.minimum(model_error(search.chosen), MOST_LEFT * whole)


def heard(search: Search) -> Array:
    """Rms noise (signals,) of a part's sensors; that of the highest frequencies where the rest of it is doubtful."""
    white = search.data.white
    return np.minimum(white, sharpest(search)) if unproven(search) else white


def sharpest(search: Search) -> Array:
    """Rms noise (signals,) of a part's sensors at the highest frequencies, without the lines that they pick up."""
    data, fit = search.data, search.chosen
    return data.white_part(data.residual(hypothesis.lay(data, fit.z, fit.values)))


def pickup(search: Search) -> Array:
    """Rms (signals,) of the narrow lines that a part's sensors pick up."""
    lines = search.data.lines
    return np.zeros(search.data.sigma.size) if lines is None else np.sqrt(np.mean(np.square(lines), axis=0))


def unproven(search: Search) -> bool:
    """Whether a large share of a gap is taken for noise for which the residual itself is the only evidence."""
    before, after = search.commissioned, search.chosen
    left = [
        np.sqrt(np.mean(np.square(fit.data.residual(hypothesis.lay(fit.data, fit.z, fit.values))), axis=0))
        for fit in (before, after)
    ]
    seen = np.array([item.ratio > MATERIAL for item in gaps(before, search.data.group)])
    own = np.array([item.unproven for item in search.data.noise])
    if not own.size or not np.any(seen & own):
        return False
    was, is_ = (np.square(rms / search.data.sigma)[seen & own].sum() for rms in left)
    return bool(is_ > OWN**2 * was)


def pinned(fit: Fit) -> tuple[str, ...]:
    """Nominal parameters that a fit leaves at the bound of their range."""
    far = at_bound(fit)
    return tuple(item.name for item, yes in zip(fit.data.part.nuisances, far, strict=True) if yes)


def certainty(search: Search) -> float:
    """Probability that there is an effect at all: 0.5 at the limit of the search, towards one far above it.

    It is smaller where nominal parameters that are all far off beside the effects imitate another one.
    """
    before, after = search.commissioned, search.chosen
    margin = max(before.prior - after.prior, 0.0) / PRIOR_GAIN + max(before.chi - after.chi, 0.0) / DATA_GAIN
    return (1.0 - 0.5 * math.exp(-(margin - 1.0))) * strain(search) * farthest(after)


def strain(search: Search) -> float:
    """Factor on the probability of effects, which falls as the nominal parameters beside them move further off."""
    z = search.chosen.z
    usual = z.size + STRAINED * math.sqrt(2.0 * z.size)
    return math.exp(-max(search.chosen.prior - usual, 0.0) / (2.0 * TEMPERATURE))


def farthest(fit: Fit) -> float:
    """Factor on the probability of effects beside which one nominal parameter is far off, 1 where none is.

    By Bayes: the share of laboratories that have a parameter as far off, over that share and `FALSE`, as a stand-in may
    push a parameter anywhere.
    """
    usual = math.erf(float(np.max(np.abs(fit.z), initial=0.0)) / math.sqrt(2.0))
    chance = 1.0 - usual**fit.z.size
    return (1.0 + FALSE) * chance / (chance + FALSE) if fit.z.size else 1.0


def equivalents(search: Search) -> tuple[tuple[str, ...], ...]:
    """Sets of effects that the data cannot tell apart, one per chosen effect that has others beside it.

    Every name is in one set only: an effect that could stand for several chosen ones is counted where its predictions
    agree best with those of the chosen effects.
    """
    nearest: dict[str, tuple[float, str]] = {}
    for other in search.alternatives:
        pair = exchanged_pair(search.chosen, other)
        if pair is None or not tied(search.chosen, other):
            continue
        gone, come = pair
        apart = float(np.sum(np.square(other.reduced - search.chosen.reduced)))
        if come not in nearest or apart < nearest[come][0]:
            nearest[come] = apart, gone
    sets: dict[str, list[str]] = {}
    for come, (_, gone) in nearest.items():
        sets.setdefault(gone, [gone]).append(come)
    return tuple(map(tuple, sets.values()))
