"""Lags of second order: named with their own parameters, and not as a delay beside something else."""

from __future__ import annotations

import pytest

from diagnosis.fits import trade
from tests.diagnosis.cases import STRONGEST, Cases, estimate, named
from tests.diagnosis.test_pairs import fit


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Cases:
    """Recordings with known secrets, made on demand, no longer than the strongest motion."""
    return Cases(tmp_path_factory, STRONGEST)


@pytest.mark.long
def test_a_servo_loop_of_second_order_is_named_with_its_damping(cases: Cases) -> None:
    effect, values = "actuator.time_constant", {"factor": 1.2, "law": 1.0, "damping": 0.6}
    report = cases.report({effect: values})
    assert named(report) == [effect]
    assert report["status"] == "explained"
    assert estimate(report, effect, "factor") == pytest.approx(1.2, rel=0.1)
    assert estimate(report, effect, "damping") == pytest.approx(0.6, rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "time_constant", "damping"),
    [("damper.motor_lag", 0.008, 0.6), ("sensor.column_force.lag", 0.012, 0.7)],
)
def test_a_lag_of_second_order_is_named_with_its_damping(
    cases: Cases, effect: str, time_constant: float, damping: float
) -> None:
    report = cases.report({effect: {"time_constant": time_constant, "law": 1.0, "damping": damping}})
    assert named(report) == [effect]
    assert report["status"] == "explained"
    assert estimate(report, effect, "law") == 1.0
    assert estimate(report, effect, "time_constant") == pytest.approx(time_constant, rel=0.05)
    assert estimate(report, effect, "damping") == pytest.approx(damping, rel=0.15)


@pytest.mark.long
def test_a_filter_that_only_delays_stands_beside_the_delay_that_does_the_same(cases: Cases) -> None:
    late = {"time_constant": 0.006, "law": 1.0, "damping": 0.7}
    report = cases.report({"sensor.column_force.lag": late})
    assert report["equivalent"] == [["sensor.column_force.delay", "sensor.column_force.lag"]]


@pytest.mark.parametrize(
    ("off", "other", "back", "kept"),
    [(2.3, 2.4, 0.3, 1), (1.8, 1.9, 0.0, 0), (2.3, 2.4, 1.5, 0), (2.3, 9.0, 0.3, 0)],
)
def test_a_further_law_of_one_as_good_is_kept_where_it_brings_nominal_parameters_back(
    monkeypatch: pytest.MonkeyPatch, off: float, other: float, back: float, kept: int
) -> None:
    rival, bent = fit({"a": {}}, other), fit({"a": {"law": 1.0}}, back)
    monkeypatch.setattr(trade, "begun", lambda item, modelled: [bent] if item is rival else [])
    monkeypatch.setattr(trade, "fitted", lambda item, *_: item)
    assert trade.in_further_laws(fit({"b": {}}, off), [rival]) == [bent] * kept


def test_a_further_law_that_brings_nominal_parameters_back_is_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen, bent = fit({"a": {}}, 4.0), fit({"a": {"law": 1.0}}, 0.3)
    for name in ("joined", "alone", "under_others", "afresh", "parted", "paired", "released"):
        monkeypatch.setattr(trade, name, lambda *_: [])
    monkeypatch.setattr(trade, "freedom", lambda item: (1, 1))
    monkeypatch.setattr(trade, "in_further_laws", lambda *_: [bent])
    assert trade.traded(fit({}, 9.0), chosen, [], None, 3)[0] is bent  # type: ignore[arg-type]
