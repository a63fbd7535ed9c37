"""The candidates of a report: the verdict and its alternatives, with parameters and probabilities."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from diagnosis.findings.certainty import trust
from diagnosis.findings.certainty.intervals import Interval, intervals
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.sensors.leak import cell, leaks
from diagnosis.findings.sensors.own_reading import errors, gives_energy
from diagnosis.findings.verdict import (
    EITHER,
    UNNAMED,
    PartVerdict,
    loop_of_several,
    small,
    specimen_of_several,
    swings,
)
from diagnosis.fits.fitting import Fit, without_rest
from diagnosis.fits.trade import tied
from diagnosis.fits.unexplained import MATERIAL, gaps
from diagnosis.fits.worth import PRIOR_GAIN
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
        likely = trusted(found, named, signs, likely)
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
        sentence for verdict in named for sentence in (*other_numbers(verdict), *other_causes(verdict))
    ]
    return Named((first, *others[:MOST_OTHERS]), (*ends, *as_good))


def trusted(
    found: Diagnosis, named: Sequence[PartVerdict], signs: Mapping[str, float], costs: float
) -> float:
    """Probability of the effects named by what was learned of such verdicts.

    Where nothing is left, the probability by `costs` is the most. Where something is left, costs only tell the effects
    from the alternatives to them, and the share of the gap that is left lowers the probability.
    """
    if all(verdict.outcome not in UNNAMED for verdict in found.verdicts):
        return min(costs, trust.EXPLAINED.probability(signs))
    near = float(np.prod([trust.share_likeliest(verdict) for verdict in named]))
    left = [item for item in named if item.outcome == "partly"]
    shares = [trust.share_named(item.search.explained) for item in left]
    probability = trust.less_by_freedom(min(near, trust.PARTLY.probability(signs), *shares), left)
    doubtful = any(
        trust.of_the_plan(item)
        or without_rest(item.search.chosen)
        or small(item.search)
        or swings(item.searched)
        or leaks(item.search.chosen)
        or item.own is not None
        for item in left
    )
    return EITHER * probability if doubtful else probability


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


def other_numbers(verdict: PartVerdict) -> list[str]:
    """A sentence for each description of a part by more or fewer effects that the data cannot tell from the verdict."""
    chosen = verdict.search.chosen
    return [
        f"These signals cannot separate {described(chosen)} from {described(other)}: the verdict names the one with "
        "fewer free parameters."
        for other in verdict.search.alternatives
        if len(other.names) != len(chosen.names) and tied(chosen, other)
    ]


def other_causes(verdict: PartVerdict) -> list[str]:
    """A sentence where another cause may look the same as what is named."""
    if small(verdict.search):
        return [
            f"What {described(verdict.search.chosen)} explains is so small that two good solutions of one model may "
            "differ by it. Something else as small may look the same."
        ]
    fit = verdict.search.chosen
    sentences = [
        f"{name} stands beside an effect that shows in this reading alone. Another law of the machine may look the "
        "same: these signals cannot tell them apart."
        for name in errors(fit)
    ]
    if name := gives_energy(fit):
        sentences.append(
            f"With {name} the column gives more energy than it ever took, since its force falls later than it rises. "
            "Hysteresis of its load cell looks the same: these signals cannot tell them apart."
        )
    if name := leaks(fit):
        sentences.append(
            f"A leak of the charge of {cell(fit)} turns the phase of the force as {name} does: these signals cannot "
            "tell them apart."
        )
    if swings(verdict.searched):
        sentences.append(
            f"Beside {described(fit)} something swings for many periods at a frequency of its own. It looks like "
            "noise, but follows from what the machine was told. It may be another effect, or all of the gap."
        )
    loop, specimen = loop_of_several(verdict.search), specimen_of_several(verdict.search)
    if loop:
        sentences.append(
            f"Several values of the plan are named of the {loop}. One other part of its loop, such as a filter in its "
            "feedback, may look the same: these signals cannot tell them apart."
        )
    if specimen:
        sentences.append(
            f"Several effects of the {specimen} are named. One other law of this specimen may look the same: these "
            "signals cannot tell them apart."
        )
    return sentences


def described(fit: Fit) -> str:
    """The effects of a fit, with the law of each that has not the first of its laws."""
    laws = {name: fit.data.catalogue[name].law(values) for name, values in fit.values.items()}
    words = [
        f"{name} (law {law.name})" if law and fit.values[name].get("law") else name
        for name, law in laws.items()
    ]
    return " with ".join(words)


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

    By the fourth power only what comes close to a limit of the search lowers it: half of a limit costs 2 %.
    """
    worst = 0.0
    for verdict in found.verdicts:
        fit = verdict.search.chosen
        sizes = np.abs(fit.z) / math.sqrt(PRIOR_GAIN)
        left = [item.ratio / MATERIAL for item in gaps(fit, fit.data.group)]
        worst = max([worst, *map(float, sizes), *left, float(verdict.own is not None)])
    return float(1.0 - 0.3 * min(worst, 1.0) ** 4)


def entry(effects: list[str], probability: float, parameters: Parameters, score: float) -> Candidate:
    """One candidate."""
    return Candidate(
        effects=tuple(effects), probability=probability, parameters=parameters, held_out_score=score
    )
