"""The proposed test that tells candidates apart; nothing is proposed if the verdict is clear."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from diagnosis.findings.further_tests import next_test
from diagnosis.findings.further_tests.next_test import ChosenTest
from diagnosis.fits import fitting, residuals
from diagnosis.fits.hypothesis import Values
from diagnosis.fits.residuals import Data
from diagnosis.recorded.parts import LaboratoryPart
from laboratories.effects import CATALOGUE, checked
from tests.diagnosis.cases import Cases, lab_a, lab_b


def laboratory(cases: Cases) -> Data:
    """A clean laboratory A."""
    whole = cases.record(duration=8.0)
    return residuals.prepare(lab_a(whole), whole)


def hypothesis(data: Data, effect: str, **given: float) -> fitting.Fit:
    """One effect at given parameters."""
    values: Values = {effect: checked(CATALOGUE[effect], given)}
    return fitting.at(data, values, np.zeros(len(data.part.nuisances)))


def scaled(data: Data, factor: float) -> Data:
    """The same motion at another scale."""
    part = data.part
    assert isinstance(part, LaboratoryPart)
    inputs = {name: factor * values for name, values in part.inputs.items()}
    return dataclasses.replace(data, part=part.replaced(inputs=inputs))


def test_a_larger_motion_separates_candidates_that_depend_on_amplitude(cases: Cases) -> None:
    data = laboratory(cases)
    yielding = hypothesis(data, "column.yielding", yield_displacement=2e-3)
    softer = hypothesis(data, "column.stiffness", factor=0.95)
    apart = [next_test.separation(scaled(data, factor), yielding, softer) for factor in (0.25, 0.5, 1.0, 2.0)]
    assert apart == sorted(apart)
    assert apart[-1] > 10.0 * apart[0]


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_no_motion_separates_a_stiffness_from_a_gain(cases: Cases, factor: float) -> None:
    data = laboratory(cases)
    stiffer = hypothesis(data, "column.stiffness", factor=1.1)
    gain = hypothesis(data, "sensor.column_force.gain", factor=1.1)
    assert next_test.separation(scaled(data, factor), stiffer, gain) < 1.0


def test_a_hypothesis_is_not_separated_from_itself(cases: Cases) -> None:
    data = laboratory(cases)
    one = hypothesis(data, "column.friction", force=900.0)
    assert next_test.separation(data, one, one) < 1e-6


def test_proposed_tests_stay_within_the_reached_range_or_state_that_they_exceed_it(cases: Cases) -> None:
    data = laboratory(cases)
    part = data.part
    assert isinstance(part, LaboratoryPart)
    largest = float(np.max(np.abs(part.inputs["actuator_command"])))
    tests = next_test.menu(data)
    names = [name for name, _ in tests]
    assert len(set(names)) == len(names) == 6
    for _, item in tests:
        assert isinstance(item.part, LaboratoryPart)
        assert float(np.max(np.abs(item.part.inputs["actuator_command"]))) <= 2.0 * largest * (1 + 1e-9)
    assert part.inputs["actuator_command"] is not None  # the recording's own are as they were


@pytest.mark.long
def test_an_unambiguous_explanation_needs_no_further_test(cases: Cases) -> None:
    report = cases.report({"column.friction": {"force": 900.0}})
    assert report["equivalent"] == []
    assert report["next_test"] == ""
    assert report["details"]["next"] == []


@pytest.mark.long
def test_candidates_that_no_motion_separates_lead_to_the_advice_to_check_the_sensor(cases: Cases) -> None:
    report = cases.report({"column.stiffness": {"factor": 1.1}})
    assert "check the sensor" in report["next_test"]
    assert "No proposed motion separates" in report["next_test"]
    assert report["details"]["next"][0]["separation"] < next_test.ENOUGH


def test_the_advice_on_the_next_test_is_stated_in_words() -> None:
    assert next_test.sentence([]) == ""
    best = ChosenTest("a sine", 12.4, ("column.slip", "column.pinching"))
    other = ChosenTest("slow cycles", 2.0, ("column.slip", "column.friction"))
    assert next_test.sentence([best, other]) == (
        "Run a sine: it separates column.slip from column.pinching by 12 standard deviations of the noise."
    )
    assert next_test.sentence([other], str.upper).startswith("No proposed motion separates COLUMN.SLIP")


def test_spikes_of_the_recording_are_not_in_the_next_test(cases: Cases) -> None:
    data = laboratory(cases)
    spiky = dataclasses.replace(data, spikes=np.zeros_like(data.part.present))
    longer = np.zeros((2 * len(data.part.measured), data.part.measured.shape[1]))
    assert next_test.played(spiky, longer).there.shape == longer.shape


@pytest.mark.parametrize("ticks", [3001, 3999])
def test_tests_of_a_machine_without_a_spring_have_their_own_length_and_begin_at_rest(
    cases: Cases, ticks: int
) -> None:
    data = residuals.prepare(lab_b(whole := cases.record(duration=8.0)), whole)
    part = data.part
    assert isinstance(part, LaboratoryPart)
    part = part.first(ticks).replaced(freed=2, anew=np.array([[0.0, 0.01, 0.1]]))
    part = part.replaced(inputs=part.inputs | {"table_command": np.zeros(ticks)})
    tests = next_test.menu(dataclasses.replace(data, part=part))
    assert tests
    assert not any("table" in name for name, _ in tests)
    lighter = hypothesis(data, "damper.mass", factor=0.9)
    weaker = hypothesis(data, "damper.gain", factor=0.9)
    for _, item in tests:
        assert isinstance(item.part, LaboratoryPart)
        assert np.all(np.asarray(item.part.anew)[:, 1:] == 0.0)
        assert np.isfinite(next_test.separation(item, lighter, weaker))
