"""How much likelier readings of an import are behind one filter of its logger than behind another one."""

from __future__ import annotations

from typing import cast

import pytest

from diagnosis.findings.logged.nominal_fits import NominalFits
from diagnosis.recorded.record import Record

NAMES = [("master", "column_force"), ("slave", "damper_force")]


def found(*surprises: float, missed: float = 0.0) -> NominalFits:
    """The readings with −2·log of how probable each is, of which models miss a share of the second."""
    of = dict(zip(NAMES, surprises, strict=True))
    return NominalFits(cast(Record, None), [], of, dict(zip(NAMES, (0.0, missed), strict=True)))


@pytest.mark.parametrize(
    ("other", "sure"),
    [
        ((0.0, 9.0), False),
        ((0.0, 11.0), True),
        ((-9.0, 30.0), True),
        ((-11.0, 30.0), False),
        ((-11.0, 900.0), True),  # two hundredths of what all gain
    ],
)
def test_readings_are_far_likelier_where_none_loses_much(other: tuple[float, float], sure: bool) -> None:
    assert found(0.0, 0.0).far_likelier(found(*other), NAMES) == sure


def test_readings_that_their_models_miss_tell_nothing_beside_others() -> None:
    assert found(0.0, 0.0, missed=0.1).told(NAMES) == {NAMES[0]}
    assert found(0.0, 0.0, missed=0.1).told(NAMES[1:]) == {NAMES[1]}
