"""The noise of readings where its colour may hide a gap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from diagnosis.findings.sensors.common_noise import in_common, unforeseen
from diagnosis.findings.sites.likely import likely_sites
from diagnosis.fits import fitting, residuals, settling
from diagnosis.fits.fitting import Fit
from diagnosis.fits.noise import sensor_noise
from diagnosis.recorded.record import Record
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_a, lab_b, white

ERROR = 4.0  # rms of the error of a stroke over its noise


def coloured(seed: int, count: int) -> Array:
    """Noise of unit rms that is loud below some 20 Hz."""
    return np.asarray(signal.lfilter([np.sqrt(1.0 - 0.8**2)], [1.0, -0.8], white(seed, count)))


def bare(whole: Record) -> Fit:
    """The fit of a table and damper without effects."""
    return settling.settled(fitting.fit(residuals.prepare(lab_b(whole), whole), {}))


@pytest.fixture
def bent(cases: Cases) -> Record:
    """A test whose stroke errs by its size on either side, with coloured noise of the accelerometer."""
    whole = cases.record(duration=8.0)
    stroke, felt = whole.signals["damper_stroke"], whole.signals["table_acceleration"]
    error = ERROR * whole.planned_noise["damper_stroke"] * np.abs(stroke) / stroke.std()
    more = 2.0 * whole.planned_noise["table_acceleration"] * coloured(5, whole.ticks)
    signals = {"damper_stroke": stroke + error, "table_acceleration": felt + more}
    return replace(whole, signals=whole.signals | signals)


def test_noise_of_which_inputs_foresee_nothing_is_none_of_the_gap_of_another_reading(
    bent: Record,
) -> None:
    fit = bare(bent)
    place = fit.data.part.signals.index("table_acceleration")
    assert unforeseen(fit)[place]
    assert not unforeseen(fit)[fit.data.part.signals.index("damper_stroke")]
    assert in_common(fit).noise[place].density is not None
    assert likely_sites(fit)[0] == "sensor.damper_stroke"


@pytest.mark.long
def test_without_a_gap_that_inputs_foresee_no_reading_stands_apart(cases: Cases) -> None:
    assert not any(unforeseen(bare(cases.record(duration=8.0))))


def test_a_sensor_that_jumps_has_no_colour_that_the_other_reading_lacks(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    jumps = np.cumsum(np.random.default_rng(3).choice([-1.0, 0.0, 1.0], whole.ticks, p=[1e-3, 0.998, 1e-3]))
    read = whole.signals["column_displacement"] + 10.0 * whole.planned_noise["column_displacement"] * jumps
    jumping = replace(whole, signals=whole.signals | {"column_displacement": read})
    settled = settling.settled(fitting.fit(residuals.prepare(lab_a(jumping), jumping), {}))
    fit = fitting.at(sensor_noise.whitened(settled), {}, settled.z)
    assert unforeseen(fit) == [False, True]
    assert not any(item.density is not None for item in in_common(fit).noise)
    assert likely_sites(fit) == ("sensor.column_displacement",)
