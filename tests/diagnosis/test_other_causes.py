"""Causes that look the same as an effect named."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.findings.certainty.other_causes import of_no_size, other_causes, told_by_little
from diagnosis.findings.verdict import judge
from diagnosis.fits import fitting, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Problem
from diagnosis.fits.search import Search
from laboratories.effects import CATALOGUE
from tests.diagnosis.cases import Cases, lab_a
from tests.diagnosis.test_equivalents import DATA


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


@pytest.mark.parametrize(("delay", "untold"), [(2e-5, True), (4e-3, False)])
def test_an_effect_whose_interval_holds_none_of_it_is_doubted(
    cases: Cases, delay: float, untold: bool
) -> None:
    whole = cases.record(duration=8.0)
    data = residuals.prepare(lab_a(whole), whole)
    bare = fitting.fit(data, {})
    fit = fitting.at(data, {"actuator.delay": {"delay": delay}}, bare.z)
    assert of_no_size(fit) == (["actuator.delay"] if untold else [])
    said = [text for text in other_causes(Search(data, bare, fit, ())) if "holds none of it" in text]
    assert bool(said) == untold
    if untold:  # nominal parameters leave nothing without it
        assert judge(Search(data, bare, fit, ())).effects == ()


@pytest.mark.parametrize(
    ("law", "told", "doubted"),
    [(10.0, 9, False), (10.0, 5, False), (10.0, 4, True), (10.0, 0, True), (0.0, 0, False)],
)
def test_a_law_of_which_the_data_tell_fewer_than_half_of_many_parameters_is_doubted(
    law: float, told: int, doubted: bool
) -> None:
    effect = CATALOGUE["column.yielding"]
    values = {effect.name: effect.under(int(law), effect.values({"yield_displacement": 2e-3}))}
    fit = Fit(DATA, values, np.zeros(0), np.zeros((DATA.groups, 1)))
    problem = Problem(DATA, values)
    low, high = map(np.array, problem.bounds())
    slopes = np.zeros((DATA.groups, low.size))
    for place in range(told):
        slopes[place, place] = 10.0 / (high - low)[place]
    fit.__dict__["central"] = slopes
    assert low.size == (9 if law else 3)
    assert told_by_little(fit) == (effect.name if doubted else "")
