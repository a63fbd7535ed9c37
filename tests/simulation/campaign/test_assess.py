"""What each candidate adds to what is known, where a gap has causes and where none was found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from common.roles import SLAVE
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits import fitting
from diagnosis.fits.fitting import Fit
from diagnosis.fits.search import Search
from diagnosis.recorded import record
from diagnosis.report.records import Outcome
from simulation.campaign import assess, expected, goal
from simulation.campaign.goal import Goal
from simulation.campaign.steps import Endured

COLUMN = "laboratory A"


@cache
def campaign() -> Goal:
    return goal.from_tables({"candidate": [{"scales": [0.01, 0.1], "durations": 2.0}]}, Path())


@cache
def played() -> tuple[record.Record, Mapping[str, Fit]]:
    """The gentle test in the laboratories as planned, and the fits of its parts without effects, by their names."""
    plan = goal.plan_of(campaign(), 1, 1)
    run = expected.recorded(plan, expected.rolled_out(plan, expected.laboratories({}, plan), 1))
    fits = {fit.data.part.name: fit for _, fit in expected.rehearsed(plan)}
    return record.build(run, plan, role=SLAVE), fits


def found(outcome: Outcome, *names: str) -> dict[str, Diagnosis]:
    """A diagnosis in which these effects of laboratory A explain its gap equally well; none without names."""
    own, fits = played()
    bare = fits[COLUMN]
    near = [fitting.at(bare.data, {name: {"factor": 1.02}}, bare.z) for name in names]
    search = Search(bare.data, bare, (near or [bare])[0], tuple(near[1:]))
    chance = 0.9 / max(1, len(near))
    verdict = PartVerdict(search, outcome, chance, tuple((one, chance) for one in near[1:]), ())
    return {SLAVE: Diagnosis(own, [verdict])}


@pytest.mark.parametrize(
    ("outcome", "names"),
    [("none", ()), ("explained", ("actuator.gain", "actuator.time_constant"))],
)
def test_the_stronger_candidate_is_expected_to_tell_more(outcome: Outcome, names: tuple[str, ...]) -> None:
    known = assess.knowledge(found(outcome, *names))
    said = assess.assessed(campaign(), known, 2, Endured(0.0001, 0.1))
    gentle, strong = said.options
    assert (gentle.refused, strong.refused) == ("", "")
    assert gentle.drift == pytest.approx(strong.drift / 10.0, rel=0.05)
    assert 0.0 < gentle.bits < strong.bits
    assert gentle.certainty <= strong.certainty <= 1.0
    assert said.same == (names[:1],)
    assert said.together == known.causes()[0].probability


def test_a_candidate_whose_drift_would_grow_too_much_is_refused() -> None:
    own = replace(campaign(), limits=replace(campaign().limits, growth=5.0))
    said = assess.assessed(
        own, assess.knowledge(found("explained", "actuator.gain")), 2, Endured(0.0003, 0.1)
    )
    assert [one.refused for one in said.options] == ["", "the drift would grow more than 5 times"]
