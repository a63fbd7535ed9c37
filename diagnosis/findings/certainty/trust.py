"""How far a verdict that names effects may be trusted: its signs, and the probability learned from them.

A verdict is right where it names every effect that is large enough to be found. What makes that more or less probable
is summed up in a few signs; their weights were learned by `python -m validation.blind.learn` from verdicts on
laboratories whose effects are known (ADR 0052).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from diagnosis.findings.certainty.other_causes import EITHER, small, swings
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.sites.likely import TRUE_LEAVES
from diagnosis.findings.verdict import UNNAMED, PartVerdict
from diagnosis.fits import hypothesis, worth
from diagnosis.fits.fitting import without_rest
from diagnosis.fits.laws.best import BETTER
from diagnosis.fits.trade import freedom
from diagnosis.fits.unexplained import MATERIAL

LEAST_TRACE = 0.1  # trace over noise below which a smaller one makes no difference: nothing can be seen of it
SIGNS = ("clear", "names")


class Weights(NamedTuple):
    """Log-odds that a verdict is right: a constant and what a unit of each sign adds."""

    constant: float
    signs: Mapping[str, float]

    def probability(self, signs: Mapping[str, float]) -> float:
        """The probability that a verdict with these signs is right."""
        odds = self.constant + sum(weight * signs[name] for name, weight in self.signs.items())
        return 1.0 / (1.0 + math.exp(-odds))


# Learned from 113 verdicts that leave nothing and from 33 that leave something (ADR 0052).
EXPLAINED = Weights(2.93, {"clear": 0.0805, "names": -0.719})
PARTLY = Weights(-0.569, {"clear": 0.225, "names": -0.113})


def trusted(
    found: Diagnosis, named: Sequence[PartVerdict], signs: Mapping[str, float], costs: float
) -> float:
    """Probability of the effects named by what was learned of such verdicts.

    Where nothing is left, the probability by `costs` is the most. Where something is left, costs only tell the effects
    from the alternatives to them, and the share of the gap that is left lowers the probability.
    """
    if all(verdict.outcome not in UNNAMED for verdict in found.verdicts):
        return min(costs, EXPLAINED.probability(signs))
    near = float(np.prod([share_likeliest(verdict) for verdict in named]))
    left = [item for item in named if item.outcome == "partly"]
    shares = [share_named(item.search.explained) for item in left]
    probability = less_by_freedom(min(near, PARTLY.probability(signs), *shares), left)
    doubtful = any(
        of_the_plan(item)
        or without_rest(item.search.chosen)
        or small(item.search)
        or swings(item.searched)
        or item.own is not None
        for item in left
    )
    return EITHER * probability if doubtful else probability


def share_named(explained: float) -> float:
    """Probability that the effects named are the true ones, by the share of a gap's energy that they explain."""
    return TRUE_LEAVES / (TRUE_LEAVES + max(1.0 - explained, 0.0))


def less_by_freedom(probability: float, verdicts: Sequence[PartVerdict]) -> float:
    """The probability of effects that leave something, less by the parameters that they move beside the first of each.

    A stand-in leaves less with every parameter that it can choose, so that what it explains says less: by as much as a
    law with more parameters must leave less to be preferred, the odds fall with each.
    """
    counts = [freedom(verdict.search.chosen) for verdict in verdicts]
    further = sum(max(parameters - effects, 0) for parameters, effects in counts)
    odds = probability * BETTER**further
    return odds / (odds + 1.0 - probability)


def of_the_plan(verdict: PartVerdict) -> bool:
    """Whether nothing but other values of the plan's own parameters is named, as a mass or a delay.

    What a mechanism leaves its law may leave, which is another one in the laboratory. A value has no law: what is left
    beside it has another cause.
    """
    fit = verdict.search.chosen
    return len(hypothesis.values_of_plan(fit.data, fit.values)) == len(fit.values)


def share_likeliest(verdict: PartVerdict) -> float:
    """Probability of the effects that a verdict names, if one of it and of the alternatives to it is right."""
    others = sum(chance for _, chance in verdict.others)
    return verdict.probability / max(verdict.probability + others, 1e-300)


def signs(found: Diagnosis) -> dict[str, float]:
    """The signs of a diagnosis by name, empty where nothing is named.

    clear: the least, over the parts, of the log of the smallest trace of an effect named in a part over the systematic
    residual left in it, both over noise; what is left in a part without names counts against the smallest trace of all.
    names: how many effects are named beside the first.
    """
    named = [verdict for verdict in found.verdicts if verdict.effects]
    count = sum(len(verdict.effects) for verdict in named) + len(found.readings) + len(found.link)
    if not count:
        return {}
    traces = [smallest_trace(verdict) for verdict in named]
    open_parts = [verdict for verdict in found.verdicts if not verdict.effects]
    compared = [*zip(traces, named, strict=True), *((min(traces, default=1.0), one) for one in open_parts)]
    clear = [math.log(trace / (verdict.search.left + MATERIAL)) for trace, verdict in compared]
    return {"clear": min(clear, default=math.log(1.0 / MATERIAL)), "names": count - 1.0}


def smallest_trace(verdict: PartVerdict) -> float:
    """How far the least of the effects that a verdict names stands out of the noise."""
    sizes = worth.changes(verdict.search.chosen)
    least = math.sqrt(min(float(np.max(size)) for size in sizes) / verdict.search.data.group)
    return max(least, LEAST_TRACE)
