"""Shares of a gap, and the sites that residuals indicate."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diagnosis.findings import where
from diagnosis.findings.how_far import may_be_missed
from diagnosis.findings.sites.shares import shapley
from diagnosis.findings.verdict import PartVerdict, pinned
from diagnosis.findings.where import SiteTrace
from diagnosis.fits import fitting, hypothesis, residuals
from diagnosis.fits.residuals import Data
from diagnosis.fits.search import Search
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.parts import Part
from diagnosis.recorded.record import NOT_LATE, Record
from laboratories.effects import CATALOGUE, checked, lay
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_a, lab_b, unknown, white

PLAYERS = ("actuator", "column", "table", "damper", "link")
WORTH = st.floats(-1e3, 1e3)
MACHINES = ("actuator", "column", "sensor.column_displacement", "sensor.column_force")


def subsets(count: int) -> list[frozenset[str]]:
    """All subsets of the first players."""
    return [
        frozenset(names)
        for size in range(count + 1)
        for names in itertools.combinations(PLAYERS[:count], size)
    ]


@st.composite
def games(draw: st.DrawFn) -> tuple[tuple[str, ...], Mapping[frozenset[str], float]]:
    """Players and the worth of every set of them."""
    count = draw(st.integers(1, 4))
    return PLAYERS[:count], {subset: draw(WORTH) for subset in subsets(count)}


@given(games())
def test_shares_sum_to_the_total(game: tuple[tuple[str, ...], Mapping[frozenset[str], float]]) -> None:
    players, worth = game
    found = shapley(players, worth.__getitem__)
    total = worth[frozenset(players)] - worth[frozenset()]
    assert sum(share for share, _, _ in found.values()) == pytest.approx(total, abs=1e-6)


@given(games())
def test_the_order_of_players_does_not_matter(
    game: tuple[tuple[str, ...], Mapping[frozenset[str], float]],
) -> None:
    players, worth = game
    one, other = (shapley(order, worth.__getitem__) for order in (players, players[::-1]))
    for name in players:
        assert one[name] == pytest.approx(other[name], abs=1e-6)


@given(st.lists(WORTH, min_size=5, max_size=5))
def test_equal_players_get_equal_shares(by_size: list[float]) -> None:
    found = shapley(PLAYERS[:4], lambda subset: by_size[len(subset)])
    shares = [share for share, _, _ in found.values()]
    assert shares == pytest.approx([shares[0]] * 4, abs=1e-6)


@given(st.lists(WORTH, min_size=5, max_size=5), WORTH)
def test_sites_whose_contributions_add_up_each_get_their_own_contribution(
    values: list[float], none: float
) -> None:
    alone = dict(zip(PLAYERS, values, strict=True))
    found = shapley(PLAYERS, lambda subset: none + sum(alone[name] for name in subset))
    for name, (share, first, last) in found.items():
        assert share == pytest.approx(alone[name], abs=1e-6)
        assert first == pytest.approx(share, abs=1e-6)
        assert last == pytest.approx(share, abs=1e-6)


def test_a_site_without_a_contribution_gets_no_share() -> None:
    found = shapley(PLAYERS[:3], lambda subset: float(len(subset - {"table"}) ** 2))
    assert found["table"] == (0.0, 0.0, 0.0)
    assert found["column"] == found["actuator"] == (2.0, 1.0, 3.0)


SITES: dict[str, tuple[str, hypothesis.Values]] = {
    "column": ("a", {"column.friction": {"force": 900.0}}),
    "actuator": ("a", {"actuator.backlash": {"width": 3e-4}}),
    "damper": ("b", {"damper.friction": {"force": 3.0}}),
    "table": ("b", {"table.gain": {"factor": 0.93}}),
    "sensor.table_acceleration": ("b", {"sensor.table_acceleration.gain": {"factor": 1.2}}),
    "sensor.damper_force": ("b", {"sensor.damper_force.gain": {"factor": 1.2}}),
    "sensor.column_displacement": ("a", {"sensor.column_displacement.bias": {"offset": 1e-4}}),
    "structure": ("building", {"structure.damping": {"factor": 1.3}}),
}
PARTS: dict[str, Callable[[Record], Part]] = {"a": lab_a, "b": lab_b, "building": Building}


def spoilt(cases: Cases, kind: str, effects: hypothesis.Values) -> Data:
    """A part whose readings show effects, with noise."""
    whole = cases.record(duration=8.0)
    data = residuals.prepare(PARTS[kind](whole), whole)
    truth = data.part.predict(lay(data.system, tuple(effects.items())))
    data.part.measured = truth + data.white * white(5, *truth.shape)
    return data


@pytest.mark.long
@pytest.mark.parametrize("site", SITES)
def test_an_unexplained_residual_is_attributed_to_the_site_of_the_signals_that_show_it(
    cases: Cases, site: str
) -> None:
    kind, effects = SITES[site]
    data = spoilt(cases, kind, effects)
    trace = where.unexplained(unknown(fitting.at(data, {}, np.zeros(len(data.part.nuisances)))))
    assert trace.site == site
    assert trace.ratio > 0.3
    assert trace.series.shape == (4000,)


@pytest.mark.parametrize("site", SITES)
def test_the_trace_of_an_effect_is_its_change_of_the_prediction(cases: Cases, site: str) -> None:
    kind, effects = SITES[site]
    data = spoilt(cases, kind, effects)
    whole = {name: checked(CATALOGUE[name], values) for name, values in effects.items()}
    (trace,) = where.traces(data, fitting.at(data, whole, np.zeros(len(data.part.nuisances))))
    assert trace.site == site
    assert trace.ratio == pytest.approx(float(np.sqrt(np.mean(trace.series**2))))
    assert trace.ratio > 1.0
    assert trace.signal in data.part.signals


def test_a_trace_gives_its_times_and_its_frequency_band(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    t = whole.time
    burst: Array = np.where((t >= 2.0) & (t < 5.0), 10.0, 0.0) * np.sin(2.0 * np.pi * 4.0 * t)
    trace = SiteTrace("damper", burst, 6.0, "damper_force", 1.0)
    assert where.when(trace, whole) == ((2.0, 5.0),)
    low, high = where.frequencies(trace, whole)
    assert 3.0 < low < 4.0 < high < 5.0


def test_a_delay_of_a_logger_at_its_bound_is_no_site(cases: Cases) -> None:
    part = lab_a(whole := cases.record()).logged(NOT_LATE)
    data = residuals.prepare(part, whole)
    for place, name in ((-1, "gain"), (0, "actuator.gain")):
        z = np.zeros(len(part.nuisances))
        z[place] = hypothesis.TOLERANCES
        fit = fitting.at(data, {}, z)
        faint = replace(fit, reduced=np.zeros_like(fit.reduced))  # nothing is left to be seen
        assert pinned(faint) == (name,)
        assert where.unexplained(unknown(faint)).site in (("actuator",) if place == 0 else MACHINES)


@pytest.mark.parametrize(("factor", "missed"), [(1.0, True), (1.5, False)])
def test_samples_that_repeat_make_no_gap_far_larger_than_the_motion_of_an_interval(
    cases: Cases, factor: float, missed: bool
) -> None:
    part = lab_a(whole := cases.record(duration=8.0))
    place = part.signals.index("column_force")
    measured = part.measured.copy()
    measured[:, place] *= factor
    measured[1::50, place] = measured[::50, place]
    data = residuals.prepare(part.replaced(measured=measured), whole)
    bare = fitting.at(data, {}, np.zeros(len(data.part.nuisances)))
    verdict = PartVerdict(Search(data, bare, bare, ()), "unknown", 1.0, (), ())
    assert may_be_missed(verdict, "column_force", 0.02) is missed
