"""Causes that look the same as an effect named."""

from __future__ import annotations

import pytest

from diagnosis.findings.certainty.other_causes import other_causes
from diagnosis.fits import fitting, residuals
from diagnosis.fits.search import Search
from tests.diagnosis.cases import Cases, lab_a


@pytest.mark.long
@pytest.mark.parametrize(("time_constant", "relaxes"), [(1.0, False), (6.0, True)])
def test_a_load_cell_that_leaks_for_longer_than_the_test_may_be_a_specimen_that_relaxes(
    cases: Cases, time_constant: float, relaxes: bool
) -> None:
    effects = {"sensor.column_force.high_pass": {"time_constant": time_constant}}
    whole = cases.record(effects, duration=8.0)
    data = residuals.prepare(lab_a(whole), whole)
    bare = fitting.fit(data, {})
    found = Search(data, bare, fitting.at(data, effects, bare.z), ())
    said = list(other_causes(found))
    assert len(said) == relaxes
    assert all("relaxes" in sentence for sentence in said)
