"""The signs from which the probability of a verdict follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnose import examine
from diagnosis.findings.certainty.trust import signs
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits.unexplained import MATERIAL, remaining
from tests.diagnosis.cases import STRONGEST, Cases

TRUE = {"column.friction": {"force": 900.0}, "damper.friction": {"force": 3.0}}


@pytest.fixture(scope="module")
def found(cases: Cases) -> Diagnosis:
    """The diagnosis of a test with an effect in each laboratory."""
    return examine(cases.record(TRUE, duration=STRONGEST))


def part(found: Diagnosis, name: str) -> PartVerdict:
    """The verdict on a part."""
    return next(one for one in found.verdicts if one.search.data.part.name == name)


def clear(found: Diagnosis, *verdicts: PartVerdict) -> float:
    """The sign `clear` of a diagnosis with these verdicts alone."""
    return signs(replace(found, verdicts=verdicts))["clear"]


def leaving(verdict: PartVerdict) -> PartVerdict:
    """The verdict with a systematic residual, and none on what it names."""
    fit = verdict.search.chosen
    wave = np.sin(0.2 * np.arange(fit.data.groups))[:, None]
    left = replace(fit, reduced=fit.reduced + 20.0 * wave)
    return replace(verdict, search=replace(verdict.search, chosen=left))


@pytest.mark.long
def test_what_is_left_in_a_part_says_nothing_against_an_effect_of_another_part(found: Diagnosis) -> None:
    a, b = part(found, "laboratory A"), part(found, "laboratory B")
    assert a.effects
    assert b.effects
    rest = leaving(b)
    assert remaining(rest.search.chosen) > 10.0 * MATERIAL
    assert clear(found, a, rest) == pytest.approx(min(clear(found, a), clear(found, rest)))
    assert clear(found, rest) < clear(found, b)


def test_what_is_left_in_a_part_without_names_says_something_against_every_effect(found: Diagnosis) -> None:
    a, b = part(found, "laboratory A"), part(found, "laboratory B")
    unknown = replace(b, search=replace(b.search, chosen=b.search.commissioned), outcome="unknown")
    assert clear(found, a, unknown) < clear(found, a) - 1.0
