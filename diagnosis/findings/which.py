"""The candidates of a report: the verdict and its alternatives, with parameters and probabilities."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from diagnosis.findings.certainty import trust
from diagnosis.findings.certainty.intervals import Interval, intervals
from diagnosis.findings.certainty.other_causes import EITHER, described, other_causes, swings
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits.fitting import Fit
from diagnosis.fits.trade import tied
from diagnosis.fits.unexplained import MATERIAL, gaps
from diagnosis.fits.worth import PRIOR_GAIN
from diagnosis.recorded.missing_rows import without_readings
from diagnosis.report.records import Candidate
from diagnosis.report.values import Parameters, Value
from laboratories.effects.effect import Effect

# Of -2 log likelihood, which an alternative must gain to be listed: a parameter one standard error off gains as much.
LEAST_GAIN = 1.0
MOST_OTHERS = 5  # alternatives listed, the most probable ones: as many as a reader compares with the verdict


class Named(NamedTuple):
    """The candidates, the verdict first, then the alternatives by probability."""

    candidates: tuple[Candidate, ...]
    warnings: tuple[str, ...]


def which(found: Diagnosis, signs: Mapping[str, float], sure: float = 1.0) -> Named:
    """The candidates, the verdict's with the probability `sure` at most, and warnings on the verdict's parameters."""
    if not found.verdicts:
        return Named((Candidate(effects=(), probability=None, parameters={}, held_out_score=None),), ())
    named = [verdict for verdict in found.verdicts if verdict.effects]
    effects = [name for verdict in named for name in verdict.effects]
    effects += [reading.effect for reading in found.readings] + [item.effect for item in found.link]
    likely = float(np.prod([verdict.probability for verdict in found.verdicts]))
    if effects:
        likely = trust.trusted(found, named, signs, likely)
    probability = min(sure, likely)
    if not effects:
        probability = min(probability, nothing(found))
    fits = {name: values for verdict in named for name, values in intervals(verdict).items()}
    catalogue = found.record.catalogue
    laws = {
        name: chosen_law(values) for verdict in named for name, values in verdict.search.chosen.values.items()
    }
    parameters = {name: fitted(values) | laws[name] for name, values in fits.items()} | seen(found)
    others = [
        item for verdict in found.verdicts for item in alternatives(verdict, effects, parameters, probability)
    ]
    others.sort(key=lambda item: -(item.probability or 0.0))
    first = entry(effects, probability, parameters, 0.0)
    ends = [warning for name, values in fits.items() for warning in at_the_end(catalogue[name], values)]
    as_good = [
        sentence
        for verdict in named
        for sentence in (*other_numbers(verdict), *other_causes(verdict.search), *swinging(verdict))
    ]
    return Named(once([first, *others])[: 1 + MOST_OTHERS], (*ends, *as_good))


def once(candidates: list[Candidate]) -> tuple[Candidate, ...]:
    """The candidates without those whose effects an earlier one has too: the same ones under another law."""
    firsts: dict[frozenset[str], Candidate] = {}
    for item in candidates:
        firsts.setdefault(frozenset(item.effects), item)
    return tuple(firsts.values())


def fitted(values: Mapping[str, Interval]) -> dict[str, Value]:
    """Parameters of an effect found by a fit, with intervals."""
    return {key: value(item.value, item.low, item.high, item.unit) for key, item in values.items()}


def chosen_law(values: Mapping[str, float]) -> dict[str, Value]:
    """Which formula of an effect that has several a fit chose, where it is not the first."""
    return {"law": value(values["law"], None, None, "")} if values.get("law") else {}


def at_the_end(effect: Effect, values: Mapping[str, Interval]) -> list[str]:
    """A sentence for each parameter of an effect, shapes aside, that a fit left at the end of its range."""
    shapes = {item.name for item in effect.parameters if item.shape}
    return [
        f"The parameter {key} of {effect.name} lies at the end of its range."
        for key, item in values.items()
        if item.on_bound and key not in shapes
    ]


def swinging(verdict: PartVerdict) -> list[str]:
    """A sentence where something swings beside the effects of a part."""
    if not swings(verdict.searched):
        return []
    return [
        f"Beside {described(verdict.search.chosen)} something swings for many periods at a frequency of its own. It "
        "looks like noise, but follows from what the machine was told. It may be another effect, or all of the gap."
    ]


def other_numbers(verdict: PartVerdict) -> list[str]:
    """A sentence for each description of a part by more or fewer effects that the data cannot tell from the verdict."""
    chosen = verdict.search.chosen
    return [
        f"These signals cannot separate {described(chosen)} from {described(other)}: the verdict names the one with "
        "fewer free parameters."
        for other in verdict.search.alternatives
        if len(other.names) != len(chosen.names) and tied(chosen, other)
    ]


def seen(found: Diagnosis) -> dict[str, dict[str, Value]]:
    """Parameters of the effects that were found in samples and in message numbers."""
    result = {}
    catalogue = found.record.catalogue
    for reading in found.readings:
        unit = unit_of(catalogue[reading.effect], reading.parameter)
        result[reading.effect] = {reading.parameter: value(reading.value, *reading.interval, unit)}
    for item in found.link:
        result[item.effect] = {
            key: value(size, *bounds, unit_of(catalogue[item.effect], key))
            for key, (size, bounds) in item.parameters.items()
        }
    return result


def alternatives(
    verdict: PartVerdict, effects: list[str], parameters: Parameters, probability: float
) -> list[Candidate]:
    """Entries in which one part's effects are others that explain something."""
    rest = [name for name in effects if name not in verdict.effects]
    result = []
    for other, chance in verdict.others:
        if other.names and not other.cost < verdict.search.commissioned.cost - LEAST_GAIN:
            continue
        share = chance
        if verdict.effects and verdict.probability > 0.0:
            share = probability / verdict.probability * chance
        kept = {name: parameters[name] for name in rest}
        worse = 0.5 * (other.cost - verdict.search.chosen.cost) if verdict.effects else 0.0
        result.append(entry([*other.names, *rest], share, kept | bare(other), worse))
    return result


def bare(fit: Fit) -> dict[str, dict[str, Value]]:
    """Parameters of a fit without intervals."""
    catalogue = fit.data.catalogue
    return {
        name: {key: value(size, None, None, unit_of(catalogue[name], key)) for key, size in given.items()}
        for name, given in fit.values.items()
    }


def value(size: float, low: float | None, high: float | None, unit: str) -> Value:
    """A parameter as the report holds it; an end that is not finite is not known."""
    lower, upper = (None if end is None or not math.isfinite(end) else end for end in (low, high))
    return Value(value=size, interval=(lower, upper), unit=unit)


def unit_of(effect: Effect, parameter: str) -> str:
    """Unit of an effect's parameter."""
    return next(item.unit for item in effect.every if item.name == parameter)


def nothing(found: Diagnosis) -> float:
    """Probability that there is no effect: one, down to 0.7 where a search nearly named one.

    By the fourth power only what comes close to a limit of the search lowers it: half of a limit costs 2 %. It is half
    as large where readings were recorded that could not be judged.
    """
    worst = 0.0
    for verdict in found.verdicts:
        fit = verdict.search.chosen
        sizes = np.abs(fit.z) / math.sqrt(PRIOR_GAIN)
        left = [item.ratio / MATERIAL for item in gaps(fit, fit.data.group)]
        worst = max([worst, *map(float, sizes), *left, float(verdict.own is not None)])
    unjudged = without_readings([verdict.search.data.part for verdict in found.verdicts], found.record)
    return float(1.0 - 0.3 * min(worst, 1.0) ** 4) * (EITHER if unjudged else 1.0)


def entry(effects: list[str], probability: float, parameters: Parameters, score: float) -> Candidate:
    """One candidate."""
    return Candidate(
        effects=tuple(effects), probability=probability, parameters=parameters, held_out_score=score
    )
