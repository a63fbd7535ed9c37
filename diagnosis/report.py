"""The report of a diagnosis as plain values (contract, section 8)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from diagnosis import details, exercise, how_far, next_test, where
from diagnosis.search import gaps
from diagnosis.verdict import intervals
from models.effects import CATALOGUE

if TYPE_CHECKING:
    from diagnosis.diagnose import Diagnosis
    from diagnosis.record import Record

VERSION = 1
STILL = 5.0  # rms of a signal over its noise below which it hardly moved
MOST_OTHERS = 8  # alternatives listed


def build(found: Diagnosis, validation: Sequence[Record]) -> dict[str, Any]:
    """The whole report."""
    far = how_far.judge(found, validation)
    status = status_of(found)
    sites = sites_of(found, far)
    entries = which(found, status)
    tests = next_test.choices(found)
    evidence = details.details(found, far, entries)
    evidence["next"] = [
        {"test": item.test, "separation": item.separation, "pair": list(item.pair), "why": ""}
        for item in tests[:5]
    ]
    return {
        "version": VERSION,
        "status": status,
        "tolerances": tolerances(found),
        "gap": far.gap,
        "where": sites,
        "which": entries,
        "equivalent": [list(names) for verdict in found.verdicts for names in verdict.equivalent],
        "how_far": far.summary,
        "not_exercised": exercise.not_exercised(found),
        "next_test": next_test.sentence(tests),
        "warnings": found.warnings,
        "details": evidence,
    }


def status_of(found: Diagnosis) -> str:
    """The status in one word."""
    if not found.verdicts or not moved(found):
        return "not_enough_data"
    outcomes = {verdict.outcome for verdict in found.verdicts}
    named = any(verdict.effects for verdict in found.verdicts) or found.readings or found.link
    if "unknown" in outcomes or found.held:
        return "unknown_effect"
    if "partly" in outcomes:
        return "partly_explained"
    if not named:
        return "no_gap"
    if any(verdict.effects and verdict.probability < 0.5 for verdict in found.verdicts):
        return "ambiguous"
    return "explained"


def moved(found: Diagnosis) -> bool:
    """Whether any part's readings stand out of their noise."""
    for verdict in found.verdicts:
        data = verdict.search.data
        level = np.sqrt(np.mean(np.square(data.part.measured), axis=0))
        if not data.part.exact and np.any(level > STILL * np.maximum(data.white, 1e-12)):
            return True
    return False


def tolerances(found: Diagnosis) -> dict[str, dict[str, float]]:
    """How far each nominal parameter was moved."""
    result = {}
    for verdict in found.verdicts:
        fit = verdict.search.chosen
        for nuisance, z in zip(verdict.search.data.part.nuisances, fit.z, strict=True):
            result[nuisance.name] = {"factor": 1.0 + float(z) * nuisance.tolerance, "z": float(z)}
    return result


def sites_of(found: Diagnosis, far: how_far.HowFar) -> list[dict[str, Any]]:
    """Where the gap lies, the largest share first."""
    entries = []
    for trace in far.traces:
        entries.append(
            {
                "site": trace.site,
                "residual_to_noise": trace.ratio,
                "when": where.when(trace, found.record) if trace.series.size else [],
                "frequency_band": where.frequencies(trace, found.record) if trace.series.size else [0.0, 0.0],
            }
        )
    for entry in entries:
        share, low, high = far.shares[entry["site"]]
        entry |= {"share": share, "share_interval": [low, high]}
    return sorted(entries, key=lambda entry: -entry["share"])


def which(found: Diagnosis, status: str) -> list[dict[str, Any]]:
    """The verdict and what else might be, the most probable first."""
    named = [verdict for verdict in found.verdicts if verdict.effects]
    open_ones = [verdict for verdict in found.verdicts if verdict.others]
    effects = [name for verdict in named for name in verdict.effects]
    effects += [reading.effect for reading in found.readings] + [item.effect for item in found.link]
    probability = float(np.prod([verdict.probability for verdict in named]))
    parameters: dict[str, Any] = {}
    for verdict in named:
        for name, values in intervals(verdict.search.chosen).items():
            parameters[name] = {
                key: {"value": item.value, "interval": [item.low, item.high], "unit": item.unit}
                for key, item in values.items()
            }
            found.warnings += [
                f"{key} of {name} lies at the end of its range."
                for key, item in values.items()
                if item.on_bound
            ]
    for reading in found.readings:
        unit = CATALOGUE[reading.effect].parameters[0].unit
        parameters[reading.effect] = {
            reading.parameter: {"value": reading.value, "interval": list(reading.interval), "unit": unit}
        }
    for item in found.link:
        units = {parameter.name: parameter.unit for parameter in CATALOGUE[item.effect].parameters}
        parameters[item.effect] = {
            key: {"value": value, "interval": list(bounds), "unit": units[key]}
            for key, (value, bounds) in item.parameters.items()
        }
    entries = (
        [entry(effects, probability, parameters, 0.0)]
        if effects
        else [entry([], probability_none(found), {}, 0.0)]
    )
    for verdict in open_ones:
        rest = [name for name in effects if name not in verdict.effects]
        for other, chance in verdict.others:
            values = {
                name: {
                    key: {"value": value, "interval": [None, None], "unit": unit_of(name, key)}
                    for key, value in given.items()
                }
                for name, given in other.values.items()
            }
            kept = {name: parameters[name] for name in rest}
            share = (
                probability / verdict.probability * chance
                if verdict.probability > 0.0 and verdict in named
                else chance
            )
            worse = 0.5 * (other.cost - verdict.search.chosen.cost)
            entries.append(entry([*other.names, *rest], share, kept | values, worse))
    head, tail = entries[0], sorted(entries[1:], key=lambda item: -item["probability"])
    return [head, *tail[:MOST_OTHERS]]


def unit_of(effect: str, parameter: str) -> str:
    """Unit of an effect's parameter."""
    return next(item.unit for item in CATALOGUE[effect].parameters if item.name == parameter)


def probability_none(found: Diagnosis) -> float:
    """How sure it is that nothing is there: the nearer a tolerance's edge, the less."""
    z = [abs(float(value)) for verdict in found.verdicts for value in verdict.search.chosen.z]
    left = [
        item.ratio
        for verdict in found.verdicts
        for item in gaps(verdict.search.chosen, verdict.search.data.group)
    ]
    worst = max([0.0, *(value / 2.5 for value in z), *(value / 0.12 for value in left)])
    return float(1.0 - 0.3 * min(worst, 1.0) ** 4)


def entry(effects: list[str], probability: float, parameters: dict[str, Any], score: float) -> dict[str, Any]:
    """One line of `which`."""
    return {
        "effects": effects,
        "probability": probability,
        "parameters": parameters,
        "held_out_score": score,
    }
