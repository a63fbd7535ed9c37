"""Intervals of parameters: errors that are correlated in time, few blocks, and alternatives that are as probable."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm, t

from diagnosis.findings.certainty.covariances import FOREIGN, Spread, between_solutions, covariance, spread
from diagnosis.findings.certainty.intervals import between_formulas, intervals, mixed, refined
from diagnosis.findings.verdict import judge
from diagnosis.fits import fitting, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.hypothesis import Problem
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import search
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_a, lab_b

BLOCKS, EACH = 12, 50  # blocks of 1 s, of so many samples


def fit_of_mean(series: Array) -> Fit:
    """The mean of a series (samples,), as a fit without nominal parameters that has seen all of it."""
    plan: Any = SimpleNamespace(test=SimpleNamespace(interval=1.0 / EACH))
    data: Any = SimpleNamespace(
        train=np.ones(series.size, dtype=bool),
        sigma=np.ones(1),
        group=1,
        system=SimpleNamespace(plan=plan),
    )
    found = Fit(data, {}, np.zeros(0), (series - series.mean())[:, None])
    found.__dict__["central"] = np.full((series.size, 1), -1.0)
    return found


def test_errors_that_last_a_block_widen_an_interval_until_it_holds() -> None:
    rng, held, narrow = np.random.default_rng(5), 0, 0
    for _ in range(300):
        series = rng.normal(size=BLOCKS * EACH) + np.repeat(rng.normal(size=BLOCKS), EACH)
        sure = spread(fit_of_mean(series))
        assert sure.blocks == BLOCKS
        held += abs(series.mean()) < sure.half(0)
        narrow += abs(series.mean()) < 1.96 * np.sqrt(sure.noise[0, 0])
    assert held >= 0.92 * 300
    assert narrow < 0.5 * 300


def test_white_noise_hardly_widens_an_interval() -> None:
    rng = np.random.default_rng(6)
    fits = [fit_of_mean(rng.normal(size=BLOCKS * EACH)) for _ in range(50)]
    wide = [covariance(fit)[0, 0] * BLOCKS * EACH for fit in fits]
    assert 1.0 <= np.median(wide) < 1.3


def test_the_scatter_of_few_blocks_counts_by_students_t() -> None:
    one, none = np.eye(1), np.zeros((1, 1))
    assert Spread(one, none, 5).half(0) == pytest.approx(norm.ppf(0.975))
    assert Spread(none, one, 5).half(0) == pytest.approx(t.ppf(0.975, 4))
    assert Spread(none, none, 5).half(0) == 0.0


def test_alternatives_widen_an_interval_towards_where_they_put_the_parameter() -> None:
    assert mixed(1.0, []) == (-1.0, 1.0)
    assert mixed(1.0, [(0.0, 0.7)]) == (-1.0, 1.0)
    low, high = mixed(1.0, [(8.0, 1.0)])
    assert -1.0 < low < -0.8
    assert 8.5 < high < 9.0
    low, high = mixed(1.0, [(8.0, 1e-3)])  # too improbable to matter
    assert (low, high) == pytest.approx((-1.0, 1.0), abs=0.02)


def test_parameters_are_refined_on_the_rows_that_selection_did_not_see(cases: Cases) -> None:
    found = cases.record({"damper.friction": {"force": 3.0}}, duration=4.0)
    fit = fitting.fit(
        residuals.prepare(lab_b(found), found), {"damper.friction": {"force": 2.5, "velocity": 1e-3}}
    )
    better = refined(fit)
    assert not fit.data.train.all()
    assert better.data.train.all()
    seen, whole = (np.diag(spread(item).noise)[item.z.size :] for item in (fit, better))
    assert np.all(whole < seen)
    assert better.values["damper.friction"]["force"] == pytest.approx(3.0, rel=0.03)


@pytest.mark.long
def test_an_interval_leaves_room_for_another_formula(cases: Cases) -> None:
    name = "damper.friction"
    whole = cases.record({name: {"force": 3.0}}, duration=4.0)
    verdict = judge(search(residuals.prepare(lab_b(whole), whole), Scales(whole)))
    fit = refined(verdict.searched.chosen)
    problem = Problem(fit.data, fit.values)
    place = problem.place(fit.values, fit.z)[fit.z.size]
    half = np.hypot(FOREIGN * spread(fit).half(fit.z.size), between_solutions(fit))
    (item,) = (free for free in problem.frees if free.parameter.name == "force")
    given = intervals(verdict)[name]["force"]
    assert given.low == pytest.approx(item.outward(place - half), rel=1e-3)
    assert given.high == pytest.approx(item.outward(place + half), rel=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("limit", [60.0, 120.0])
def test_a_level_that_a_reading_does_not_go_beyond_is_as_wide_as_formulas_differ(
    cases: Cases, limit: float
) -> None:
    name = "sensor.damper_force.saturation"
    whole = cases.record({name: {"limit": limit, "sharpness": 3.0}}, duration=8.0)  # it reaches 76 N
    data = residuals.prepare(lab_b(whole), whole)
    fit = fitting.fit(data, {name: {"limit": limit, "sharpness": 3.0}})
    free = next(item for item in Problem(data, fit.values).frees if item.parameter.bends_by)
    tanh = limit / 1.5 ** (1.0 / 3.0)
    small = 0.1 * limit
    assert tanh * np.tanh((small / tanh) ** 1.5) ** (1.0 / 1.5) == pytest.approx(
        small / (1.0 + (small / limit) ** 3.0) ** (1.0 / 3.0), rel=1e-6
    )
    assert between_formulas(fit, free) == pytest.approx(np.log(limit / tanh), rel=0.1)
    clipped = fitting.at(data, {name: {"limit": 20.0, "sharpness": 3.0}}, fit.z)
    assert between_formulas(clipped, free) == 0.0


def test_a_limit_at_which_a_machine_bends_is_as_wide_as_formulas_differ(cases: Cases) -> None:
    name = "actuator.velocity_limit"
    data = residuals.prepare(lab_a(cases.record()), cases.record())
    for values, wide in (({"sharpness": 3.0, "law": 1.0}, np.log(1.5) / 3.0), ({}, 0.0)):
        fit = fitting.at(data, {name: {"velocity": 0.01, **values}}, np.zeros(len(data.part.nuisances)))
        (free,) = (one for one in Problem(data, fit.values).frees if one.parameter.name == "velocity")
        assert between_formulas(fit, free) == pytest.approx(wide)


@pytest.mark.long
def test_the_interval_of_an_unreached_level_holds_that_of_another_formula(cases: Cases) -> None:
    name = "sensor.damper_force.saturation"
    whole = cases.record({name: {"limit": 60.0, "sharpness": 3.0}}, duration=8.0)
    found = search(residuals.prepare(lab_b(whole), whole), Scales(whole, 0.0))
    level = intervals(judge(found))[name]["limit"]
    assert level.value == pytest.approx(60.0, rel=0.05)
    assert level.low < 60.0 / 1.5 ** (1.0 / 3.0)
