"""The noise of sensors by readings at rest before a test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from diagnosis.findings.sensors import noise_levels
from diagnosis.fits import fitting, residuals
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.residuals import Data
from diagnosis.fits.search import Search
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals.noise import colour
from diagnosis.signals.noise.model import NoiseModel
from tests.diagnosis.cases import Cases, lab_b

SECONDS = 12.0  # of readings at rest
SIGNAL = "damper_stroke"


def with_rest(cases: Cases, times: float, slow: float) -> tuple[Data, int, float]:
    """A laboratory with white noise of its stroke before a test, `times` that of the test, beside `slow` noise."""
    record = cases.record(duration=20.0)
    data = residuals.prepare(lab_b(record), record)
    bare = fitting.fit(data, {})
    data = sensor_noise.remodelled(bare)
    place = data.part.signals.index(SIGNAL)
    level = float(data.white[place])
    draws = np.random.default_rng(4).standard_normal((2, round(SECONDS / record.plan.test.interval)))
    kept = times * level * draws[0] + slow * level * np.asarray(
        signal.lfilter([1.0], [1.0, -0.995], draws[1])
    )
    part = data.part.first(data.groups * data.group)
    assert isinstance(part, LaboratoryPart)
    part.rest = tuple(kept if name == SIGNAL else None for name in data.part.signals)
    return replace(data, part=part), place, level


@pytest.mark.parametrize("times", [0.95, 1.05])
def test_white_noise_at_rest_is_white_in_a_test(cases: Cases, times: float) -> None:
    data, place, level = with_rest(cases, times, 0.0)
    found = sensor_noise.before_the_test(data, place)
    assert found == NoiseModel(level, source="at rest")
    other = data.part.signals.index("table_displacement")
    assert sensor_noise.before_the_test(data, other) is None


def test_slow_noise_at_rest_is_noise_in_a_test(cases: Cases) -> None:
    data, place, level = with_rest(cases, 1.0, 0.1)
    found = sensor_noise.before_the_test(data, place)
    assert found is not None
    assert (found.kind, found.source, found.unproven) == ("ar", "at rest", False)
    assert found.density is not None
    assert found.density[0] > 20.0 * level**2
    assert found.density[-1] == pytest.approx(level**2, rel=0.3)


@pytest.mark.parametrize("times", [0.5, 2.0, 0.0])
def test_readings_of_another_noise_at_the_highest_frequencies_tell_nothing(
    cases: Cases, times: float
) -> None:
    data, place, _ = with_rest(cases, times, 0.0)
    assert sensor_noise.before_the_test(data, place) is None


@pytest.mark.parametrize(
    ("at_rest", "source", "kind"),
    [(None, "residual", "ar"), (0.0, "at rest", "white"), (0.02, "at rest", "ar")],
)
def test_slow_noise_in_a_test_is_the_sensors_only_where_it_was_there_at_rest(
    cases: Cases, at_rest: float | None, source: str, kind: str
) -> None:
    """White noise at rest leaves what is slow in the test for a gap."""
    data, place, level = with_rest(cases, 1.0, at_rest or 0.0)
    part = data.part.first(data.groups * data.group)
    assert isinstance(part, LaboratoryPart)
    if at_rest is None:
        part.rest = (None,) * len(part.signals)
    draw = np.random.default_rng(11).standard_normal(len(part.measured))
    part.measured = part.measured.copy()
    part.measured[:, place] += 0.02 * level * np.asarray(signal.lfilter([1.0], [1.0, -0.995], draw))
    fit = fitting.at(replace(data, part=part, noise=()), {}, np.zeros(len(part.nuisances)))
    found = sensor_noise.remodelled(fit).noise[place]
    assert (found.source, found.kind) == (source, kind)


def test_far_slower_noise_than_at_rest_is_no_noise_of_the_sensor(cases: Cases) -> None:
    data, place, level = with_rest(cases, 1.0, 0.02)
    part = data.part.first(data.groups * data.group)
    assert isinstance(part, LaboratoryPart)
    draw = np.random.default_rng(11).standard_normal(len(part.measured))
    part.measured = part.measured.copy()
    part.measured[:, place] += 0.3 * level * np.asarray(signal.lfilter([1.0], [1.0, -0.995], draw))
    fit = fitting.at(replace(data, part=part, noise=()), {}, np.zeros(len(part.nuisances)))
    left = sensor_noise.remodelled(fit)
    known, found = sensor_noise.before_the_test(left, place), left.noise[place]
    assert known is not None
    assert (known.kind, found.source) == ("ar", "at rest")
    told = colour.GRID > 0.05
    assert np.asarray(found.density)[told] == pytest.approx(np.asarray(known.density)[told], rel=0.5)


def test_too_few_readings_tell_nothing(cases: Cases) -> None:
    data, place, _ = with_rest(cases, 1.0, 0.0)
    part = data.part.first(data.groups * data.group)
    assert isinstance(part, LaboratoryPart)
    part.rest = tuple(one if one is None else one[:150] for one in part.rest)
    assert sensor_noise.before_the_test(replace(data, part=part), place) is None


@pytest.mark.parametrize(("slope", "lifted"), [(0.0, False), (1.0, True)])
def test_below_what_readings_at_rest_tell_only_noise_that_becomes_louder_there_may_be_louder(
    slope: float, lifted: bool
) -> None:
    """Pink noise has the slope 1; eight half waves of a record of 400 samples begin at a fiftieth of the highest."""
    known = NoiseModel(1.0, density=np.maximum(colour.GRID, 0.02) ** -slope, samples=400.0)
    other = 1e3 * np.ones(colour.GRID.size)
    below = colour.GRID < 0.02
    most = known.at_most(other)
    assert np.array_equal(most[~below], np.asarray(known.density)[~below])
    assert np.all(most[below] == (1e3 if lifted else 1.0))
    assert np.array_equal(known.at_most(0.0 * other), np.asarray(known.density))


def test_noise_at_rest_is_not_that_of_a_part_which_unseen_commands_move(cases: Cases) -> None:
    data, place, level = with_rest(cases, 1.0, 0.0)
    assert isinstance(data.part, LaboratoryPart)
    still = data.part.replaced(blurred=0.01 * level)
    assert sensor_noise.before_the_test(replace(data, part=still), place) is not None
    moved = data.part.replaced(blurred=10.0 * level)
    assert sensor_noise.before_the_test(replace(data, part=moved), place) is None


@pytest.mark.parametrize(("times", "expected"), [(0.3, 0.3), (3.0, 1.0)])
def test_a_sensor_is_no_noisier_than_before_the_test(cases: Cases, times: float, expected: float) -> None:
    data, place, level = with_rest(cases, times, 0.0)
    bare = fitting.fit(data, {})
    found = noise_levels.sensors_rms(Search(data, bare, bare, ()))
    whole = noise_levels.highest_rms(Search(data, bare, bare, ()))
    assert found[place] == pytest.approx(expected * level, rel=0.05)
    others = np.arange(found.size) != place
    assert np.array_equal(found[others], whole[others])


def test_noise_that_was_there_at_rest_stays_where_coloured_noise_is_doubted(cases: Cases) -> None:
    """A gap that looks like slow noise of one reading makes no other reading's noise white."""
    data, place, level = with_rest(cases, 1.0, 0.02)
    part = data.part.first(data.groups * data.group)
    assert isinstance(part, LaboratoryPart)
    draws = np.random.default_rng(11).standard_normal((2, len(part.measured)))
    part.measured = part.measured.copy()
    slow = np.asarray(signal.lfilter([1.0], [1.0, -0.995], draws))
    other = next(one for one in range(len(part.signals)) if one != place)
    part.measured[:, place] += 0.02 * level * slow[0]
    part.measured[:, other] += 0.02 * float(data.white[other]) * slow[1]
    fit = fitting.at(replace(data, part=part, noise=()), {}, np.zeros(len(part.nuisances)))
    found = sensor_noise.remodelled(fit).noise
    assert (found[place].kind, found[other].kind) == ("ar", "ar")
    noise = sensor_noise.flattened(fit).noise
    assert (noise[place].source, noise[place].kind, noise[other].kind) == ("at rest", "ar", "white")
