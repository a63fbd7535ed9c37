"""The verdict on one part: how well which effects explain its gap, how surely, and which cannot be separated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from diagnosis.findings.certainty.costs import certainty, farthest, odds, over, strain
from diagnosis.findings.certainty.other_causes import EITHER, of_no_size, other_causes, small, swings
from diagnosis.findings.sensors.drifting_zeros import drifting_zeros
from diagnosis.findings.sensors.noise_levels import unproven
from diagnosis.findings.sensors.one_motion import one_motion
from diagnosis.findings.sensors.own_reading import machine_alone, of_column
from diagnosis.findings.sensors.slow_noise import under_less_noise
from diagnosis.findings.sites.likely import APART, TRUE_LEAVES, likely_sites, ranked
from diagnosis.fits import fitting, residuals
from diagnosis.fits.fitting import Fit, at_end
from diagnosis.fits.noise import inputs
from diagnosis.fits.residuals import Data
from diagnosis.fits.search import Search, exchanged_pair
from diagnosis.fits.trade import tied
from diagnosis.fits.unexplained import foresees, gaps, leaves, model_error
from diagnosis.fits.worth import SEEN, at_bound
from diagnosis.recorded.nuisances import LoggedReadings
from diagnosis.recorded.parts import MODEL_ERROR
from diagnosis.report.records import Outcome
from laboratories.effects.sites import is_sensor
from models.registry import Array

# Share of a gap's energy from which on effects that leave something are named: what they explain then is the larger
# part.
HALF = 0.5
# Probability that the true cause is not among the effects named, by outcome; set on draws of `rths blind --set tune`
# (ADR 0012).
DOUBT = {"explained": 0.02, "partly": 0.12, "unknown": 0.9}
MOST_LEFT = 0.2  # of a gap's rms that effects may leave as an error of such solutions: 4 % of its energy
# Share of a gap's energy beyond any that these stand-ins explained.
NEARLY = 0.99
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
    drifting: tuple[str, ...] = ()  # the readings whose zeros drift, where that is all of the gap
    calibrated: tuple[str, ...] = ()  # the readings whose gains are those of a logger's channels, likewise
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
    if drifting := drifting_zeros(search):
        bare = replace(search, chosen=search.commissioned, alternatives=())
        return PartVerdict(bare, "tolerances", 1.0, (), (), drifting=drifting)
    if calibrated := within_calibration(search):
        bare = replace(search, chosen=search.commissioned, alternatives=())
        return PartVerdict(bare, "tolerances", 1.0, (), (), calibrated=calibrated)
    if search.chosen.names and set(of_no_size(search.chosen)) == set(search.chosen.names):
        bare = replace(search, chosen=search.commissioned, alternatives=())
        if (outcome := without_effects(bare)) != "unknown":
            return PartVerdict(bare, outcome, 1.0, (), ())
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
    sure = (1.0 - DOUBT[outcome]) * certainty(search) * (EITHER if any(other_causes(search)) else 1.0)
    level = [set(other.names) for other, yes in zip(search.alternatives, same, strict=True) if yes]
    # effects under a law that is not as good stand for none beside the same ones under one that is
    others = tuple(
        (other, sure * value / whole)
        for other, value in zip(search.alternatives, chances, strict=True)
        if set(other.names) not in level
    )
    return PartVerdict(search, outcome, sure * named, others, equivalents(search))


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
        here = replace(here, related=inputs.related(here, here.system))

    def there(fit: Fit) -> Fit:
        return fitting.at(here, fit.values, fit.z)

    alternatives = tuple(map(there, joined.alternatives))
    search = Search(here, there(joined.commissioned), there(joined.chosen), alternatives)
    others = tuple((there(fit), chance) for fit, chance in verdict.others)
    return replace(verdict, search=search, others=others, joined=joined)


def unnamed(search: Search) -> PartVerdict:
    """The verdict on a gap of which no effect explains half: nothing is named, and the nearest effects are listed."""
    near = (search.chosen, *search.alternatives)
    least = min(fit.cost for fit in near)
    chances = over((fit.cost for fit in near), least, max(1.0, least / search.chosen.data.size))
    share = (1.0 - DOUBT["unknown"]) / sum(chances)
    others = tuple((fit, share * chance) for fit, chance in zip(near, chances, strict=True))
    bare = replace(search, chosen=search.commissioned)
    return PartVerdict(bare, "unknown", DOUBT["unknown"], others, ())


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
    """Whether effects leave more than noise, strain nominal parameters, explain too small a gap or stand elsewhere.

    An error of one reading may take so much of a small gap that what it leaves in another one cannot be seen. All
    readings together may tell all the same that a machine is at fault.
    """
    fit = search.chosen
    strained = bool(pinned(fit)) or farthest(fit) < HALF or bool(at_end(fit))
    everywhere = fitting.at(replace(fit.data, vague=None), fit.values, fit.z)  # behind impacts as well
    elsewhere = of_readings(search) and misplaced(search) and at_machine(search)
    return strained or leaves(everywhere, allowed(search)) or unproven(search) or small(search) or elsewhere


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
    logged = any(isinstance(item, LoggedReadings) for item in search.data.part.nuisances)
    return of_readings(search) and not logged and search.explained < 1.0 - TRUE_LEAVES


def of_readings(search: Search) -> bool:
    """Whether nothing but errors of readings is named."""
    return {search.data.catalogue[name].kind for name in search.chosen.names} == {"measurement"}


def trifling(search: Search) -> bool:
    """Whether nothing but gains is named, smaller than what their machine is known to.

    That a reading is too large by less than the tolerances of the machine's parameters follows only if the machine's
    model is exact beyond them: a parameter that is no constant, within its tolerance, changes the reading as much. The
    machine must change the same readings. No factor at all is known to less than two good solutions differ by.
    """
    data, fit = search.data, search.chosen
    factors = [values["factor"] for values in fit.values.values() if set(values) == {"factor"}]
    if len(factors) == len(fit.names) and all(abs(one - 1.0) < MODEL_ERROR for one in factors):
        return True
    known = min((item.tolerance for item in data.part.nuisances if not item.of_record), default=0.0)
    effects = [data.catalogue[name] for name in fit.names]
    gains = [abs(fit.values[item.name]["factor"] - 1.0) for item in effects if item.fault == "gain"]
    if len(gains) < len(effects) or max(gains) >= known:
        return False
    sites = {item.site for item in ranked(search.commissioned) if item.cost < APART}
    return not sites <= {item.site for item in effects}


def within_calibration(search: Search) -> tuple[str, ...]:
    """The readings, by signal, whose gains are all that is named and no more than a logger's channels are off.

    Empty where a calibration is stated, or where rths recorded.
    """
    data, fit = search.data, search.chosen
    known = [
        item.tolerance
        for item in data.part.nuisances
        if isinstance(item, LoggedReadings) and item.parameter == "gain"
    ]
    effects = [data.catalogue[name] for name in fit.names]
    if not known or not effects or any(item.fault != "gain" for item in effects):
        return ()
    gains = [abs(fit.values[item.name]["factor"] - 1.0) for item in effects]
    return tuple(item.signal for item in effects) if max(gains) < min(known) else ()


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


def at_machine(search: Search) -> bool:
    """Whether all readings together say that a gap arises at machines, and at no sensor."""
    return not any(map(is_sensor, likely_sites(search.commissioned)))


def allowed(search: Search) -> Array:
    """What effects may leave beyond noise, over σ (signals,): what two good solutions of one model may differ by.

    That is no more than a small share of the gap, as otherwise an effect that explains half of a small gap would do.
    """
    whole = np.array([item.ratio for item in gaps(search.commissioned, search.data.group)])
    return np.minimum(model_error(search.chosen), MOST_LEFT * whole)


def pinned(fit: Fit) -> tuple[str, ...]:
    """Nominal parameters that a fit leaves at the bound of their range."""
    far = at_bound(fit)
    return tuple(item.name for item, yes in zip(fit.data.part.nuisances, far, strict=True) if yes)


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
