"""Readings that are rounded to more than their noise: where they move, rest, and have slow noise beside their steps."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from diagnosis.fits import evidence, fitting, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.residuals import COARSE, Data
from diagnosis.recorded.parts import LaboratoryPart
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_b

SIGNAL = "table_displacement"


def stepping(cases: Cases, steps: float, noise: Array | float = 0.0) -> tuple[Data, int]:
    """A laboratory with a reading of so many steps in its range, of `noise` (ticks,) in steps before the rounding."""
    record = cases.record(duration=20.0)
    data = residuals.prepare(lab_b(record), record)
    part = data.part.first(data.groups * data.group)
    assert isinstance(part, LaboratoryPart)
    place = part.signals.index(SIGNAL)
    exact = part.predict(data.system)[:, place]
    step = float(np.ptp(exact)) / steps
    part.measured = part.measured.copy()
    part.measured[:, place] = step * np.round(exact / step + noise)
    rounded = np.where(np.arange(len(part.signals)) == place, step, 0.0)
    data = replace(data, part=part, rounded=rounded)
    return residuals.measured_by(data, data.white_part(data.residual(data.system))), place


def test_a_reading_that_moves_over_coarse_steps_errs_by_a_twelfth_of_their_square(cases: Cases) -> None:
    data, place = stepping(cases, 1000.0)
    step = data.rounded[place]
    assert data.white[place] < step / residuals.STEPPING
    assert data.sigma[place] == pytest.approx(step / math.sqrt(12.0), rel=0.5)
    reduced = data.reduced(data.system)[:, place]
    assert 0.3 < np.std(reduced) < 1.3  # white, of unit variance at most
    assert data.resting is not None
    others = np.delete(np.arange(data.sigma.size), place)
    assert np.all(data.resting[:, others] == 1.0)


@pytest.mark.parametrize(("white", "rounding"), [(0.35, 0.0), (0.1, 1.0)])
def test_what_a_moving_reading_errs_by_counts_once(cases: Cases, white: float, rounding: float) -> None:
    """Noise of 0.35 steps, measured of the rounded reading, holds the 0.29 steps that it errs by."""
    data, place = stepping(cases, 1000.0)
    step = data.rounded[place]
    noise = data.white.copy()
    noise[place] = white * step
    found = residuals.measured_by(data, noise).sigma[place]
    least = data.erring * data.part.level[place]
    assert found**2 == pytest.approx(noise[place] ** 2 + rounding * step**2 / 12.0 + least**2, rel=1e-9)


def test_a_reading_counts_less_the_longer_it_rests_on_a_step(cases: Cases) -> None:
    data, place = stepping(cases, 1000.0)
    assert data.resting is not None
    quiet = slice(0, 20)  # at rest, before the motion begins
    part = data.part.first(data.groups * data.group)
    assert isinstance(part, LaboratoryPart)
    part.measured = part.measured.copy()
    part.measured[: 20 * data.group, place] = part.measured[0, place]
    still = residuals.measured_by(replace(data, part=part), data.white)
    assert still.resting is not None
    most = math.sqrt(1.0 + (12.0 * COARSE**2 - 1.0) / 12.0 * (data.rounded[place] / still.sigma[place]) ** 2)
    assert still.resting[quiet, place][:15] == pytest.approx(most)
    more = 2.0 * float(np.sum(np.log(still.resting))) - 2.0 * float(np.sum(np.log(data.resting)))
    fits = [
        Fit(item, {}, np.zeros(len(part.nuisances)), np.zeros_like(still.resting)) for item in (data, still)
    ]
    assert evidence.surprise(fits[1]) - evidence.surprise(fits[0]) == pytest.approx(more, abs=1e-3)


def test_of_a_reading_that_mostly_rests_three_steps_count_as_noise(cases: Cases) -> None:
    data, place = stepping(cases, 3.0)
    assert data.resting is None
    assert data.sigma[place] == pytest.approx(COARSE * data.rounded[place], rel=0.05)


def test_slow_noise_beside_coarse_steps_has_its_colour(cases: Cases) -> None:
    draw = np.random.default_rng(2).standard_normal(cases.record(duration=20.0).ticks)
    slow = 0.015 * np.asarray(signal.lfilter([1.0], [1.0, -0.998], draw))
    data, place = stepping(cases, 1000.0, slow)
    assert data.rounded[place] > residuals.STEPPING * data.white[place]
    found = sensor_noise.remodelled(fitting.at(data, {}, np.zeros(len(data.part.nuisances))))
    density = found.noise[place].density
    assert density is not None
    assert density[0] > 100.0 * density[-1]
