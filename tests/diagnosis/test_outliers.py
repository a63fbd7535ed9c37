"""Samples of a reading that the tails of its noise do not make."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnose import diagnose
from diagnosis.findings.sensors import outliers
from diagnosis.findings.verdict import judge
from diagnosis.fits import hypothesis, residuals
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import search
from diagnosis.recorded.record import Record
from diagnosis.signals.noise.spikes import beyond, deviation, spikes
from tests.diagnosis.cases import Cases, lab_b

TICKS = (1200, 1900, 3100)  # of the samples that are read from elsewhere


def disturbed(whole: Record, size: float, *names: str) -> Record:
    """The record with samples of readings that are so many times their noise away."""
    signals = dict(whole.signals)
    for name in names:
        signals[name] = signals[name].copy()
        signals[name][list(TICKS)] += size * whole.planned_noise[name]
    return replace(whole, signals=signals)


@pytest.mark.long
@pytest.mark.parametrize(
    ("size", "status", "told"),
    [(700.0, "unknown_effect", 1), (20.0, "within_tolerances", 1), (4.0, "within_tolerances", 0)],
)
def test_a_few_samples_from_elsewhere_are_told_and_large_ones_are_an_effect(
    size: float, status: str, told: int, cases: Cases
) -> None:
    whole = disturbed(cases.record(duration=8.0), size, "damper_stroke")
    found = diagnose({"slave": whole}, {})["slave"].report
    said = [
        one for one in found.warnings if one.startswith("damper_stroke has 3 samples far beyond its noise")
    ]
    assert (found.status, len(said)) == (status, told)
    if status == "unknown_effect":
        assert [place.site for place in found.where] == ["sensor.damper_stroke"]
        assert (found.where[0].residual_to_noise or 0.0) > 1.0
        assert "2.400, 3.800, 6.200 s" in said[0]
        assert found.which[0].effects == ()


@pytest.mark.long
def test_samples_that_several_readings_show_are_no_error_of_one(cases: Cases) -> None:
    whole = disturbed(cases.record(duration=8.0), 700.0, "damper_stroke", "damper_force")
    data = residuals.prepare(lab_b(whole), whole)
    assert outliers.found_in(judge(search(data, Scales(whole)))) == []


def test_a_reading_without_noise_has_no_outliers(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    verdict = judge(search(residuals.prepare(lab_b(whole), whole), Scales(whole)))
    data, fit = verdict.search.data, verdict.search.chosen
    measured, white = lab_b(whole).measured.copy(), data.white.copy()
    measured[:, 2] = data.part.predict(hypothesis.lay(data, fit.z, fit.values))[:, 2]
    white[2] = 0.0
    silent = replace(data, part=lab_b(whole).replaced(measured=measured), white=white)
    assert outliers.found_in(replace(verdict, search=replace(verdict.search, data=silent))) == []


@pytest.mark.parametrize("freedom", [3.0, 4.0, 30.0])
def test_heavy_tails_are_noise(freedom: float) -> None:
    draws = np.random.default_rng(5).standard_t(freedom, (20, 6000))
    found = [outliers.beyond_tails(spikes(x), beyond(x) / deviation(beyond(x))) for x in draws]
    assert all(one is None for one in found)


def test_a_few_samples_above_heavy_tails_are_none() -> None:
    noise = np.random.default_rng(6).standard_t(3.0, 6000)
    noise[[500, 2500, 4000]] += 300.0
    found = outliers.beyond_tails(spikes(noise), beyond(noise) / deviation(beyond(noise)))
    assert found is not None
    assert found[0].tolist() == [500, 2500, 4000]
    assert found[1] < outliers.SURE
