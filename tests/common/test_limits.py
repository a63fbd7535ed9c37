"""The message about a violated limit."""

from __future__ import annotations

import math

import pytest

from common.plan.limits import LimitViolation


@pytest.mark.parametrize(
    ("violation", "sentence"),
    [
        (
            LimitViolation("actuator_velocity", 0.612, 0.5),
            "actuator_velocity is 0.612, beyond its limit of 0.5 m/s.",
        ),
        (LimitViolation("error_energy", 1.25, 1.0), "error_energy is 1.25, beyond its limit of 1."),
        (
            LimitViolation("column_force", math.nan, 4e5),
            "column_force is nan, beyond its limit of 400000 N.",
        ),
    ],
)
def test_a_violated_limit_is_one_sentence_with_the_unit_of_the_plan(
    violation: LimitViolation, sentence: str
) -> None:
    assert str(violation) == violation.sentence == sentence
