"""Gains of single readings that are no more than the channels of a data logger are off."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.findings.verdict import judge, within_calibration
from diagnosis.fits import fitting, residuals
from diagnosis.fits.search import Search
from diagnosis.recorded.record import NOT_LATE
from tests.diagnosis.cases import Cases, imported, lab_b

GAIN, LAG = "sensor.table_acceleration.gain", "sensor.table_acceleration.lag"


def found(cases: Cases, values: dict[str, Any], *, logged: bool = True) -> Search:
    """A search that ended with effects, behind a logger of which nothing is stated or in a recording of rths."""
    whole = imported(cases.record()) if logged else cases.record()
    part = lab_b(whole).logged(NOT_LATE) if logged else lab_b(whole)
    data = residuals.prepare(part, whole)
    bare = fitting.at(data, {}, np.zeros(len(part.nuisances)))
    return Search(data, bare, replace(bare, values=values), ())


def test_a_gain_within_a_percent_is_that_of_a_channel(cases: Cases) -> None:
    search = found(cases, {GAIN: {"factor": 0.997}})
    assert within_calibration(search) == ("table_acceleration",)
    verdict = judge(search)
    assert (verdict.outcome, verdict.effects) == ("tolerances", ())
    assert verdict.calibrated == ("table_acceleration",)


@pytest.mark.parametrize(
    ("values", "logged"),
    [
        ({GAIN: {"factor": 1.011}}, True),
        ({GAIN: {"factor": 0.997}}, False),
        ({GAIN: {"factor": 0.997}, LAG: {"time_constant": 1e-3}}, True),
        ({}, True),
    ],
    ids=["larger", "recorded by rths", "beside a lag", "nothing named"],
)
def test_other_gains_are_judged(values: dict[str, Any], logged: bool, cases: Cases) -> None:
    assert within_calibration(found(cases, values, logged=logged)) == ()
