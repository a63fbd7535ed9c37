"""What the diagnosis of all tests so far says of the cause, and what each candidate would add to that."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, product
from typing import NamedTuple

import numpy as np

from common.plan.plan import Plan
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.further_tests.next_test import ENOUGH
from loop.closed_loop import Rollout
from loop.nominal import limited
from loop.signals import by_role
from models.registry import Array
from models.system import System
from simulation.campaign import expected, hypotheses, information, strain
from simulation.campaign.goal import CampaignTest, Goal, plan_of
from simulation.campaign.hypotheses import HiddenCauses
from simulation.campaign.information import Expected
from simulation.campaign.steps import Endured, Option, PossibleCause
from simulation.workers.threads import one_thread

Found = Mapping[str, Diagnosis]  # by role of the slave

# Probability from which on a cause counts for what a test may do to the specimens.
PLAUSIBLE = 0.02
MOST_PLAUSIBLE = 8  # combinations of causes that every candidate is simulated with
LISTED = 8  # causes kept, the most probable ones


class Assessment(NamedTuple):
    """What each candidate would add, and the most probable cause with those that none would tell from it."""

    same: tuple[tuple[str, ...], ...]
    together: float
    options: tuple[Option, ...]


def nominal(goal: Goal) -> tuple[Option, ...]:
    """The candidates before the first test: what they would show of each effect that the laboratories may have.

    The laboratories are as planned, and their sensors' noise is that of the first candidate's simulation.
    """
    plan = plan_of(goal, 1, 1)
    with one_thread():
        known = HiddenState({}, hypotheses.hiding(expected.rehearsed(plan), played=False))
        return tuple(looked_at(goal, known, 1, Endured())[0])


def tests(goal: Goal, test: int) -> Iterator[tuple[CampaignTest, Plan]]:
    """The candidates with their plans as the test of this number."""
    for one in goal.candidates:
        yield one, plan_of(goal, one.number, test)


def knowledge(found: Found) -> NamedState | HiddenState:
    """What the diagnosis of all tests so far says of the cause."""
    with one_thread():
        named = any(fit.names for part in hypotheses.open_parts(found) for fit in part.fits)
        if named or in_samples(found):
            return NamedState(found)
        return HiddenState(found, hypotheses.hidden(found))


def assessed(goal: Goal, known: NamedState | HiddenState, test: int, endured: Endured) -> Assessment:
    """What each candidate would add to what is known, as the test of this number."""
    with one_thread():
        options, apart = looked_at(goal, known, test, endured)
    same, together = known.inseparable(apart)
    return Assessment(same, together, tuple(options))


def looked_at(
    goal: Goal, known: NamedState | HiddenState, test: int, endured: Endured
) -> tuple[list[Option], list[list[Array]]]:
    """Every candidate, and how far each of those within the limits moves the causes of the parts apart."""
    options, apart = [], []
    for one, plan in tests(goal, test):
        rollouts = [expected.rolled_out(plan, systems) for systems in known.plausible(plan)]
        option = judged(goal, one.number, plan, rollouts, endured)
        if rollouts[0].finite:
            tells, distances = known.told(plan, rollouts[0])
            option = replace(option, bits=tells.bits, certainty=tells.certainty)
            apart += [distances] if not option.refused else []
        options.append(option)
    return options, apart


def in_samples(found: Found) -> tuple[str, ...]:
    """The effects that single samples and message numbers show, which are certain."""
    read = [item.effect for one in found.values() for item in one.readings]
    linked = [item.effect for one in found.values() for item in one.link]
    return tuple(dict.fromkeys([*read, *linked]))


def judged(goal: Goal, number: int, plan: Plan, rollouts: Sequence[Rollout], endured: Endured) -> Option:
    """A candidate with what it does to the specimens under each plausible cause, and the limit that it would pass."""
    if not all(one.finite for one in rollouts):
        return Option(number, 0.0, 0.0, "the loop is unstable")
    strains = [strain.of_rollout(plan, one) for one in rollouts]
    drift, energy = (max(values) for values in zip(*strains, strict=True))
    most, more = goal.limits, 1.0 + goal.limits.margin
    refused = ""
    if more * drift > most.drift:
        refused = f"the drift would pass {most.drift:.3g} m"
    elif endured.energy + more * energy > most.energy:
        refused = f"a specimen would absorb more than {most.energy:.3g} J in all"
    elif endured.drift and drift > most.growth * endured.drift:
        refused = f"the drift would grow more than {most.growth:.3g} times"
    else:
        refused = next(filter(None, (beyond(plan, one, more) for one in rollouts)), "")
    return Option(number, drift, energy, refused)


def beyond(plan: Plan, rollout: Rollout, more: float) -> str:
    """The first limit of the plan that a simulated test comes too close to, empty for none."""
    most, share = limited.most(plan), min(1.0 / more, plan.preflight.peak_share)
    for name, peak in limited.peaks(plan, by_role(plan, rollout)).items():
        if peak > share * most[name]:
            return f"{name} would come too close to its limit in the plan"
    return ""


class NamedState:
    """The state in which the gap of one part at least has causes to choose between."""

    def __init__(self, found: Found) -> None:
        self.found = found
        self.parts = hypotheses.open_parts(found)

    def plausible(self, plan: Plan) -> Iterator[Mapping[str, System]]:
        """The laboratories under the most probable causes of all parts, and under other plausible ones."""
        kept = [
            [place for place, weight in enumerate(part.weights) if place == 0 or weight > PLAUSIBLE]
            for part in self.parts
        ]
        for places in islice(product(*kept), MOST_PLAUSIBLE):
            found = self.found
            for part, place in zip(self.parts, places, strict=True):
                found = expected.exchanged(found, part, part.fits[place]) if place else found
            yield expected.laboratories(found, plan)

    def told(self, plan: Plan, rollout: Rollout) -> tuple[Expected, list[Array]]:
        """What a test tells, and how far apart it moves the causes of each part."""
        seen = {role: expected.parts(plan, rollout, role) for role in self.found}
        rows = []
        for part in self.parts:
            there = seen[part.role].get(part.title)
            count = len(part.fits)
            none = (Expected(0.0, float(part.weights[0])), np.zeros((count, count)))
            rows.append(none if there is None else expected.told(part, there))
        return information.together([one for one, _ in rows]), [apart for _, apart in rows]

    def names(self, places: Sequence[int]) -> tuple[str, ...]:
        """The effects of a cause in each part, and those that samples show."""
        pairs = zip(self.parts, places, strict=True)
        rows = (name for part, place in pairs for name in part.fits[place].names)
        return tuple(dict.fromkeys([*rows, *in_samples(self.found)]))

    def inseparable(self, apart: Sequence[Sequence[Array]]) -> tuple[tuple[tuple[str, ...], ...], float]:
        """The most probable cause and those that no allowed test tells from it, and their probability together."""
        places = []
        for number, part in enumerate(self.parts):
            farthest = (
                np.max([one[number][0] for one in apart], axis=0) if apart else np.zeros(len(part.fits))
            )
            near = [place for place in range(len(part.fits)) if place == 0 or farthest[place] < ENOUGH**2]
            places.append(near if apart else [0])
        chance = float(
            np.prod(
                [part.sure * part.weights[near].sum() for part, near in zip(self.parts, places, strict=True)]
            )
        )
        names = [self.names(chosen) for chosen in islice(product(*places), LISTED)]
        return tuple(dict.fromkeys(names)), chance

    def causes(self) -> tuple[PossibleCause, ...]:
        """The causes of all parts together, the most probable first."""
        rows = []
        for chosen in product(*(range(len(part.fits)) for part in self.parts)):
            pairs = zip(self.parts, chosen, strict=True)
            chance = float(np.prod([part.sure * part.weights[place] for part, place in pairs]))
            rows.append(PossibleCause(self.names(chosen), chance))
        return tuple(sorted(rows, key=lambda one: -one.probability))


class HiddenState:
    """The state in which no part has a gap: something may still be there that the tests could not show."""

    def __init__(self, found: Found, hidden: HiddenCauses) -> None:
        self.found = found
        self.hidden = hidden

    def plausible(self, plan: Plan) -> Iterator[Mapping[str, System]]:
        """The laboratories as found; each hidden cause by itself is too improbable to be reckoned with."""
        yield expected.laboratories(self.found, plan)

    def told(self, plan: Plan, rollout: Rollout) -> tuple[Expected, list[Array]]:
        """What a test tells of the hidden causes."""
        seen = {role: expected.parts(plan, rollout, role) for role in dict.fromkeys(self.hidden.roles)}
        there = [
            seen[role].get(fit.data.part.name)
            for role, fit in zip(self.hidden.roles, self.hidden.fits, strict=True)
        ]
        return expected.shown(self.hidden, there), []

    def inseparable(self, _apart: Sequence[Sequence[Array]]) -> tuple[tuple[tuple[str, ...], ...], float]:
        """That nothing is there."""
        return ((),), self.hidden.sure * float(self.hidden.weights[0])

    def causes(self) -> tuple[PossibleCause, ...]:
        """Nothing, and the hidden causes by their effects."""
        chances: dict[tuple[str, ...], float] = {}
        names = [(), *((cause.name,) for cause in self.hidden.causes)]
        for effects, weight in zip(names, self.hidden.weights, strict=True):
            chances[effects] = chances.get(effects, 0.0) + self.hidden.sure * float(weight)
        rows = [PossibleCause(effects, chance) for effects, chance in chances.items()]
        return (rows[0], *sorted(rows[1:], key=lambda one: -one.probability))
