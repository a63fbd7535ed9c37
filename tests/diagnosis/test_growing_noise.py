"""Noise of a reading that grows with what it reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnose import diagnose
from diagnosis.fits.noise.inputs import motions
from diagnosis.recorded.record import Record
from diagnosis.signals.noise.growth import growing
from models.registry import Array
from tests.diagnosis.cases import Cases

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


@pytest.mark.long
@pytest.mark.parametrize("name", ["damper_force", "column_force", "table_displacement"])
def test_noise_that_grows_with_its_reading_is_no_gap(name: str, cases: Cases) -> None:
    whole = grown(cases.record(duration=12.0), name)
    result = diagnose({"slave": whole}, {})["slave"].report
    assert result.status in ("no_gap", "within_tolerances", "explained")
    assert all(effect.endswith(".noise") for effect in result.which[0].effects)
    assert any(one.startswith(f"The noise of {name} grows with its reading") for one in result.warnings)
