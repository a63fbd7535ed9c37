"""Readings that are means over time, of which the import map states nothing, or a delay only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from common.recording.imported import ImportedChannel
from common.recording.logger.low_pass import LoggerFilter
from common.recording.logger.passing import averaged
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.logged import filters, means
from diagnosis.fits import fitting, residuals, settling, worth
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.record import Record
from diagnosis.signals import alike
from models.registry import Array
from tests.diagnosis.cases import Cases, imported, lab_a, lab_b

INTERVAL, LENGTH = 0.002, 11e-3  # s
TICKS = INTERVAL * np.arange(4000)


def stated(whole: Record, channel: ImportedChannel) -> Record:
    """The record as an import whose map states the same of all readings."""
    found = imported(whole, lambda x: x)
    names = {lab.role: lab.measured for lab in found.labs}
    said = found.mapped
    assert said is not None
    channels = {role: dict.fromkeys(those, channel) for role, those in names.items()}
    run = found.run
    run = replace(run, metadata=run.metadata | {"import": replace(said, channels=channels).metadata()})
    return replace(found, run=run)


def mean(values: Array) -> Array:
    """A reading as means."""
    return averaged(values, INTERVAL, LENGTH)


@pytest.mark.parametrize("length", [2e-3, 5.3e-3, LENGTH])
@pytest.mark.parametrize("frequency", [1.0, 8.0])
def test_a_mean_of_a_wave_is_its_integral(length: float, frequency: float) -> None:
    omega = 2.0 * np.pi * frequency
    begun = np.maximum(TICKS - length, 0.0)
    wanted = (np.cos(omega * begun) - np.cos(omega * TICKS)) / (omega * length)
    found = averaged(np.sin(omega * TICKS), INTERVAL, length)
    assert np.max(np.abs(found - wanted)[20:-2]) < 3e-5  # of a wave, of which lines would miss 8e-4 at 8 Hz
    channel = ImportedChannel(average=length)
    assert channel.late == pytest.approx(0.5 * length)
    assert np.abs(channel.response(np.array([frequency]))) == pytest.approx(np.sinc(frequency * length))


@pytest.mark.long
def test_a_mean_of_which_nothing_is_stated_is_found_and_leaves_no_gap(cases: Cases) -> None:
    found = filters.filtered(imported(cases.record(), mean))
    assert all(one.filter is None for one in found.passed.values())
    assert [one.average for one in found.passed.values()] == pytest.approx([LENGTH] * 6, rel=0.1)
    for lab in (lab_a(found), lab_b(found)):
        fit = fitting.fit(residuals.prepare(lab.logged(found.late), found), {})
        assert not worth.is_gap(settling.settled(fit))
    (said,) = means.remarks(Diagnosis(found))
    assert "are means over 1" in said


@pytest.mark.parametrize("averages", [True, False])
def test_a_stated_delay_is_that_of_a_mean_where_readings_say_so(cases: Cases, averages: bool) -> None:

    whole = cases.record()
    read = mean if averages else lambda x: ImportedChannel(delay=0.5 * LENGTH).through(x, INTERVAL)
    names = [name for lab in whole.labs for name in lab.measured]
    moved = {name: read(whole.signals[name]) for name in names}
    record = stated(replace(whole, signals=whole.signals | moved), ImportedChannel(delay=0.5 * LENGTH))
    found = means.averaged(record)
    assert bool(found.passed) == averages

    if averages:
        channel = found.stated.channel("slave", "damper_stroke")  # type: ignore[union-attr]
        assert channel.late == pytest.approx(0.5 * LENGTH)
        assert channel.average == pytest.approx(LENGTH, rel=0.1)


@pytest.mark.parametrize(
    "passed",
    [
        ImportedChannel(LoggerFilter("butterworth", 4, 60.0), delay=2e-3),
        ImportedChannel(delay=4e-3, average=8e-3),
    ],
)
def test_a_delay_beside_a_stated_filter_or_mean_is_that_of_no_other_mean(
    cases: Cases, passed: ImportedChannel
) -> None:
    """Not even where another mean is in the readings: it would stand in the place of what is stated."""
    whole = cases.record()
    names = [name for lab in whole.labs for name in lab.measured]
    moved = {name: mean(passed.through(whole.signals[name], INTERVAL)) for name in names}
    record = stated(replace(whole, signals=whole.signals | moved), passed)
    assert means.averaged(record) is record


def test_series_are_brought_behind_a_mean_of_one_of_them() -> None:
    wave = np.sin(2.0 * np.pi * 3.0 * TICKS)
    columns = np.column_stack([wave, mean(wave)])
    found = alike.alike(columns, [ImportedChannel(), ImportedChannel(average=LENGTH)], 0.0, INTERVAL)
    assert np.max(np.abs(found[:, 0] - found[:, 1])[20:]) < 1e-9


def test_the_building_is_judged_behind_the_mean_of_its_force(cases: Cases) -> None:
    whole = cases.record()
    read = whole.signals | {"column_force": mean(whole.signals["column_force"])}
    record = replace(
        stated(whole, ImportedChannel()),
        signals=read,
        passed={("master", "column_force"): ImportedChannel(average=LENGTH)},
    )
    plain = Building(record)
    assert plain.treated
    assert np.std(LoggedBuilding(plain, behind=True).left()) < 0.2 * np.std(LoggedBuilding(plain).left())
