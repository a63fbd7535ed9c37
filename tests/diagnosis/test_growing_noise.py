"""Noise of a reading that grows with what it reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnose import diagnose
from diagnosis.findings.sensors import uneven_noise
from diagnosis.fits import evidence, fitting, residuals
from diagnosis.fits.noise.inputs import motions
from diagnosis.fits.noise.remainder import remainder
from diagnosis.fits.noise.unsteady_noise import by_reading, evened
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.record import Record
from diagnosis.signals.noise.growth import growing
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_b

TICKS = 6000
INTERVAL = 2e-3
LARGEST = 3.4  # times the noise at rest where the reading is largest


def white(seed: int) -> Array:
    """Normal numbers of unit variance."""
    return np.asarray(np.random.default_rng(seed).normal(size=TICKS))


def reading() -> Array:
    """A reading (ticks,) at two frequencies that grows and falls again."""
    t = np.arange(TICKS) * INTERVAL
    waves = np.sin(2.0 * np.pi * 2.0 * t) + 0.5 * np.sin(2.0 * np.pi * 3.1 * t)
    return np.asarray(np.sin(2.0 * np.pi * t / 12.0) ** 2 * waves)


def loudness(size: Array) -> Array:
    """A level that is `LARGEST` times as high where a size is largest as at rest, with a mean square of one."""
    level = 1.0 + (LARGEST - 1.0) * np.abs(size) / np.max(np.abs(size))
    return np.asarray(level / np.sqrt(np.mean(level**2)))


def found(noise: Array, size: int = 1) -> Array | None:
    """How loud noise of the reading is, beside its slope and its bend."""
    return growing(noise, reading(), motions(reading()[:, None]), size)


@pytest.mark.parametrize("seed", range(4))
def test_the_level_of_noise_that_grows_is_found_at_every_tick(seed: int) -> None:
    level = found(loudness(reading()) * white(seed))
    assert level is not None
    assert np.mean(level**2) == pytest.approx(1.0)
    assert np.allclose(level, loudness(reading()), rtol=0.2)


def test_the_root_of_a_sum_of_squares_is_another_law() -> None:
    share = 3.0 * np.abs(reading())
    level = found(np.hypot(1.0, share) * white(3))
    assert level is not None
    true = np.hypot(1.0, share)
    assert np.allclose(level, true / np.sqrt(np.mean(true**2)), rtol=0.15)


def test_the_highest_frequencies_that_a_logger_passed_tell_it() -> None:
    noise = loudness(reading()) * white(5)
    passed = np.convolve(noise, np.ones(3) / 3.0, "same")
    level = found(passed, size=3)
    assert level is not None
    assert np.allclose(level, loudness(reading()), rtol=0.35)


@pytest.mark.parametrize("seed", range(8))
def test_steady_noise_of_any_colour_does_not_grow(seed: int) -> None:
    generator = np.random.default_rng(seed)
    slow = np.convolve(white(seed), np.exp(-np.arange(400) / 60.0), "same")
    for noise in (white(seed), generator.standard_t(3.0, TICKS), slow + 0.3 * white(seed + 100)):
        assert found(noise) is None


@pytest.mark.parametrize("times", [1, 2])
def test_noise_that_follows_the_slope_or_the_bend_does_not_grow_with_the_reading(times: int) -> None:
    motion = reading()
    for _ in range(times):
        motion = np.gradient(motion)
    assert found(loudness(motion) * white(7)) is None


def test_a_share_of_the_reading_that_sways_slowly_is_no_noise() -> None:
    sways = np.sin(2.0 * np.pi * 0.7 * np.arange(TICKS) * INTERVAL)
    assert found(white(8) + 20.0 * reading() * sways) is None


def grown(whole: Record, name: str) -> Record:
    """The record with a reading whose noise is mostly in proportion to what it reads."""
    read = whole.signals[name]
    made = loudness(read - read[0]) * np.random.default_rng(12).normal(size=read.size)
    return replace(whole, signals=whole.signals | {name: read + 1.5 * whole.planned_noise[name] * made})


def test_residuals_are_measured_by_the_noise_of_every_tick(cases: Cases) -> None:
    whole = cases.record(duration=12.0)
    loud = grown(whole, "damper_force")
    part = lab_b(loud)
    place = part.signals.index("damper_force")
    given = residuals.prepare(part, loud)
    data, even = evened(given, remainder(given, given.system), given.system)
    assert data.loudness is not None
    assert np.all(np.delete(data.loudness, place, axis=1) == 1.0)
    true = 1.5 * whole.planned_noise["damper_force"]  # beside the noise that it had, which does not grow
    rms = np.hypot(true, whole.planned_noise["damper_force"])
    assert data.white[place] == pytest.approx(rms, rel=0.05)
    assert given.white[place] < 0.93 * rms  # by medians of noise that comes and goes
    level = np.mean(
        np.square(data.loudness[: len(even.noise) * data.group, place].reshape(-1, data.group)), axis=1
    )
    calm, restless = level < np.quantile(level, 0.4), level > np.quantile(level, 0.8)
    before, after = (item.reduced(item.system)[:, place] for item in (given, data))
    assert before[restless].std() > 1.5 * before[calm].std()
    assert after[restless].std() == pytest.approx(after[calm].std(), rel=0.15)
    bare = replace(data, loudness=None)
    apart = evidence.surprise(fitting.at(data, {}, np.zeros(len(part.nuisances)))) - evidence.surprise(
        fitting.at(bare, {}, np.zeros(len(part.nuisances)))
    )
    energy = np.sum(after**2) - np.sum(bare.reduced(bare.system)[:, place] ** 2)
    assert apart == pytest.approx(energy + np.sum(np.log(level)), rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("name", ["damper_force", "column_force", "table_displacement"])
def test_noise_that_grows_with_its_reading_is_no_gap(name: str, cases: Cases) -> None:
    whole = grown(cases.record(duration=12.0), name)
    result = diagnose({"slave": whole}, {})["slave"].report
    assert result.status in ("no_gap", "within_tolerances", "explained")
    assert all(effect.endswith(".noise") for effect in result.which[0].effects)
    assert any(one.startswith(f"The noise of {name} grows with its reading") for one in result.warnings)


def test_noise_of_a_force_that_grows_with_it_is_noise_of_the_balance_of_its_building(cases: Cases) -> None:
    whole = cases.record(duration=12.0)
    loud = grown(whole, "column_force")
    data = residuals.prepare(LoggedBuilding(Building(loud)), loud)
    joint = replace(data, part=JoinedPart((data.part, data.part)))
    single = remainder(data, data.system).single
    (one,) = by_reading(data, single, data.system)
    (two,) = by_reading(joint, np.concatenate([single, single]), data.system)
    for found, ticks in ((one, whole.ticks), (two, 2 * whole.ticks)):
        assert found is not None
        assert found.why == "grows"
        assert found.loudness.size == ticks
    read = whole.signals["column_force"]
    assert one is not None
    assert np.corrcoef(one.loudness, np.abs(read - read[0]))[0, 1] > 0.9
    fit = fitting.at(replace(data, loudness=one.loudness[:, None]), {}, np.zeros(len(data.part.nuisances)))
    (line,) = uneven_noise.unsteady_in(fit)
    assert line.startswith("The noise of the balance of the building's forces grows with what is read, to ")


def test_the_digits_that_a_log_prints_of_a_displacement_are_noise_of_its_building(cases: Cases) -> None:
    whole = cases.record(duration=12.0)
    exact = whole.signals["displacement"]
    digits = np.floor(np.log10(np.maximum(np.abs(exact), 1e-12))) - 4.0  # five of them
    read = np.round(exact / 10.0**digits) * 10.0**digits
    kept = {
        name: values for name, values in whole.signals.items() if name not in ("velocity", "acceleration")
    }
    printed = replace(whole, signals=kept | {"displacement": read})
    building = Building(printed)
    building._force = ""  # a building of whose forces none is read by its own laboratory
    data = residuals.prepare(LoggedBuilding(building), printed)
    (one,) = by_reading(data, remainder(data, data.system).single, data.system)
    assert one is not None
    assert one.why == "grows"
    assert np.corrcoef(one.loudness, np.abs(exact - exact[0]))[0, 1] > 0.9
