"""One hidden laboratory: the campaign with chosen tests, and again with random ones.

All keep the same limits and end by the same rule; only the choice differs, that of the first test included.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from common.errors import InputError
from common.plan.plan import Plan
from common.reality.reality import Reality
from diagnosis.findings.report import Judged
from simulation.campaign import actions, choice, course, log
from simulation.campaign.choice import CERTAIN, INSEPARABLE, Pick
from simulation.campaign.goal import Goal
from simulation.campaign.steps import BegunStep, DecidedStep, DiagnosedStep, EndedStep, Step
from validation.blind.cases.case import Case, reality
from validation.blind.cases.names import CaseNames
from validation.blind.results.scoring import truths

REPEATS = 2  # campaigns with random tests in each laboratory


@dataclass(frozen=True)
class PlayedCampaign:
    """A campaign that was played to its end."""

    tests: int
    outcome: str
    right: bool  # whether it ended certain of the right cause
    wrong: bool  # whether it ended certain of another one
    candidates: tuple[int, ...]
    certainty: tuple[float, ...]  # of the most probable cause, after each test


@dataclass(frozen=True)
class ComparedCase:
    """The campaigns in one hidden laboratory."""

    index: int
    kind: str
    truth: tuple[str, ...]
    gentle: bool  # whether the test with the smallest drift is enough to be certain of the right cause
    chosen: PlayedCampaign
    random: tuple[PlayedCampaign, ...]


def compare(goal: Goal, begun: BegunStep, case: Case) -> ComparedCase:
    """The campaigns in one laboratory, all from the same first step."""
    names = CaseNames(goal.plan)
    truth = tuple(names.effect(item) for item in case.laid)
    with tempfile.TemporaryDirectory(prefix="rths-campaign-") as place:

        def played(name: str, pick: Pick, tests: int = goal.head.tests) -> PlayedCampaign:
            own = replace(goal, head=replace(goal.head, tests=tests))
            return judged(goal, case, names, play(own, case, Path(place) / name, pick, begun))

        return ComparedCase(
            case.index,
            case.kind,
            truth,
            played("least", choice.least, 1).right,
            played("chosen", choice.best),
            tuple(
                played(f"random-{number}", partial(choice.at_random, hash_of(case, number)))
                for number in range(REPEATS)
            ),
        )


def hash_of(case: Case, number: int) -> int:
    """The seed of a campaign with random tests."""
    return 1000 * case.index + number


def play(goal: Goal, case: Case, folder: Path, pick: Pick, begun: BegunStep) -> list[Step]:
    """Play a campaign to its end, in virtual time; its steps."""
    folder.mkdir()
    work = actions.CampaignActions(goal, folder, actions.virtually(partial(laboratories, case)), nowhere)
    with log.opened(folder) as kept:
        kept.append(begun)
        course.go_on(kept, work, choice.choosing(goal.head, pick, gentle=goal.gentle))
        return kept.steps


def nowhere(_path: Path, _judged: Mapping[str, Judged]) -> None:
    """Write no report."""


def laboratories(case: Case, plan: Plan, test: int) -> Reality:
    """The hidden laboratories in a test of the campaign, with a draw of the noise of its own."""
    tables = plan.tables()
    tables["limits"]["error_energy"] = math.inf  # an effect that disturbs the loop must not end the test
    return reality(replace(case, plan=tables, seed=case.seed + test))


def judged(goal: Goal, case: Case, names: CaseNames, steps: Sequence[Step]) -> PlayedCampaign:
    """A campaign judged against the truth."""
    last, said = steps[-1], course.of(steps, DiagnosedStep)
    if not isinstance(last, EndedStep):
        raise InputError("The campaign did not end: compare campaigns in virtual time.")
    ends = {CERTAIN: [said[-1].causes[0].effects], INSEPARABLE: list(said[-1].same)} if said else {}
    named = ends.get(last.outcome, [])
    right = any(is_true(case, names, effects) for effects in named)
    return PlayedCampaign(
        len(said),
        last.outcome,
        right,
        bool(named) and not right,
        tuple(one.candidate for one in course.of(steps, DecidedStep)),
        tuple(one.certainty for one in said),
    )


def is_true(case: Case, names: CaseNames, effects: Sequence[str]) -> bool:
    """Whether effects are the cause that a case hides, and no others."""
    if not effects:
        return not case.laid or case.inside
    wanted = [truths(item, names) for item in case.laid]
    return len(effects) == len(wanted) and all(group & set(effects) for group in wanted)
