"""Noise of a reading that comes in bursts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnose import diagnose
from diagnosis.findings.sensors import uneven_noise
from diagnosis.fits import fitting, hypothesis, residuals, settling
from diagnosis.fits.noise.inputs import motions
from diagnosis.fits.noise.remainder import remainder
from diagnosis.fits.noise.unsteady_noise import by_reading
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.record import Record
from diagnosis.signals.noise import growth
from diagnosis.signals.noise.bursts import LEFT_OUT, LOUDEST, bursting, neighbouring
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_b

TICKS = 6000
INTERVAL = 2e-3
TIMES = 4.0  # level in the middle of a burst over that between bursts


def white(seed: int, count: int = TICKS) -> Array:
    """Normal numbers of unit variance."""
    return np.asarray(np.random.default_rng(seed).normal(size=count))


def loudness(seed: int, count: int = TICKS, times: float = TIMES) -> Array:
    """A level (count,) of bursts of 0.4 s at times by chance, with a mean square of one."""
    t, middles = np.arange(count) * INTERVAL, np.random.default_rng(seed).uniform(0.0, count * INTERVAL, 3)
    made = 1.0 + (times - 1.0) * np.max(np.exp(-(((t[:, None] - middles) / 0.4) ** 2)), axis=1)
    return np.asarray(made / np.sqrt(np.mean(made**2)))


def motion() -> Array:
    """A motion (ticks, 1) that grows and falls again."""
    t = np.arange(TICKS) * INTERVAL
    return np.asarray(np.sin(2.0 * np.pi * t / 12.0) ** 4 * np.sin(2.0 * np.pi * 2.0 * t))[:, None]


def found(noise: Array, size: int = 1) -> Array | None:
    """How loud noise is beside that motion."""
    return bursting(noise, motions(motion()), size, INTERVAL)


@pytest.mark.parametrize("seed", range(6))
def test_bursts_are_found_at_their_times(seed: int) -> None:
    got = found(loudness(seed) * white(seed + 50))
    assert got is not None
    assert np.mean(got**2) == pytest.approx(1.0)
    assert np.corrcoef(got, loudness(seed))[0, 1] > 0.9
    assert got.max() / got.min() == pytest.approx(TIMES, rel=0.3)


def test_the_highest_frequencies_that_a_logger_passed_tell_bursts() -> None:
    passed = np.convolve(loudness(2) * white(3), np.ones(3) / 3.0, "same")
    got = found(passed, size=3)
    assert got is not None
    assert np.corrcoef(got, loudness(2))[0, 1] > 0.85


@pytest.mark.parametrize("seed", range(8))
def test_steady_noise_of_any_colour_has_no_bursts(seed: int) -> None:
    generator = np.random.default_rng(seed)
    slow = np.convolve(white(seed), np.exp(-np.arange(400) / 60.0), "same")
    impacts = white(seed) + 30.0 * (generator.random(TICKS) < 2e-3)
    for noise in (white(seed), generator.standard_t(3.0, TICKS), slow + 0.3 * white(seed + 100), impacts):
        assert found(noise) is None


def test_what_is_a_little_louder_for_a_while_is_no_burst() -> None:
    """Readings that were moved in time by ever another part of a row have noise of ever another level."""
    changing = 1.0 + 0.3 * np.sin(2.0 * np.pi * np.arange(TICKS) * INTERVAL / 6.0)
    assert found(changing * white(4)) is None


@pytest.mark.parametrize("times", [0, 1, 2])
def test_noise_that_follows_a_motion_has_no_bursts(times: int) -> None:
    size = motion()[:, 0]
    for _ in range(times):
        size = np.gradient(size)
    level = 1.0 + (TIMES - 1.0) * np.abs(size) / np.max(np.abs(size))
    assert found(level * white(9)) is None


def test_noise_that_is_nowhere_but_in_few_places_has_no_bursts() -> None:
    """So does a reading that rests on the step of its converter."""
    moves = np.where(np.abs(np.arange(TICKS) - 3000) < 200, 1.0, 0.0)
    assert found(moves * white(1)) is None


def test_a_level_is_told_by_its_neighbours_alone() -> None:
    """Else steady noise would be likelier with a level of its own."""
    rising = np.linspace(1.0, 2.0, 200)
    other = rising.copy()
    other[150] = 50.0
    before, after = (level / level[-1] for level in (neighbouring(one, 6) for one in (rising, other)))
    apart = np.flatnonzero(np.abs(after - before) > 1e-9) - 150
    assert apart.size > 0
    assert np.all(np.abs(apart) > LEFT_OUT)
    assert np.all(np.abs(apart) <= 6)


def test_a_short_record_of_noise_with_tails_has_no_bursts() -> None:
    """Medians over few samples differ by more than twice, which is no evidence."""
    loudest = []
    for seed in range(120):
        noise = np.random.default_rng(seed).standard_t(2.0, 420)
        sizes = growth.sizes(noise, 1)
        level = neighbouring(sizes, 6)
        loudest.append(level.max() / level.min())
        assert bursting(noise, np.zeros((420, 1)), 1, 0.02) is None
    assert max(loudest) > LOUDEST


def bursts_in(whole: Record, name: str) -> Record:
    """The record with a reading whose noise comes in bursts."""
    made = loudness(5, whole.ticks) * white(12, whole.ticks)
    read = whole.signals[name] + 2.0 * whole.planned_noise[name] * made
    return replace(whole, signals=whole.signals | {name: read})


def test_the_noise_of_bursts_is_told_and_leaves_nothing(cases: Cases) -> None:
    whole = bursts_in(cases.record(duration=12.0), "damper_stroke")
    data = residuals.prepare(lab_b(whole), whole)
    fit = settling.settled(fitting.at(data, {}, np.zeros(len(data.part.nuisances))))
    place = data.part.signals.index("damper_stroke")
    assert fit.data.loudness is not None
    assert np.all(np.delete(fit.data.loudness, place, axis=1) == 1.0)
    left = fit.data.residual(hypothesis.lay(fit.data, fit.z, {}))[:, place] / fit.data.loudness[:, place]
    assert fit.data.white[place] == pytest.approx(left.std(), rel=0.04)
    added = 2.0 * whole.planned_noise["damper_stroke"]
    assert fit.data.white[place] == pytest.approx(np.hypot(added, 0.5 * added), rel=0.1)
    (line,) = uneven_noise.unsteady_in(fit)
    assert line.startswith("The noise of damper_stroke comes in bursts of up to")
    loudest = round(float(line.split("loudest at ")[1].split(" s")[0]) / INTERVAL)
    assert loudness(5, whole.ticks)[loudest] > 0.8 * loudness(5, whole.ticks).max()


def test_a_burst_is_told_by_the_time_in_its_own_recording(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    data = residuals.prepare(lab_b(whole), whole)
    loud = np.ones(2 * whole.ticks)
    loud[whole.ticks + 700] = 3.0
    assert uneven_noise.loudest(loud[: whole.ticks], data) == 0.0
    joint = replace(data, part=JoinedPart((data.part, data.part)))
    assert uneven_noise.loudest(loud, joint) == pytest.approx(700 * INTERVAL)


def test_noise_below_the_steps_of_a_converter_has_no_bursts(cases: Cases) -> None:
    whole = bursts_in(cases.record(duration=12.0), "damper_stroke")
    data = residuals.prepare(lab_b(whole), whole)
    place = data.part.signals.index("damper_stroke")
    for steps, there in ((0.4, True), (0.6, False)):
        rounded = data.rounded.copy()
        rounded[place] = steps * data.white[place]
        coarse = replace(data, rounded=rounded)
        one = by_reading(coarse, remainder(coarse, coarse.system).single, coarse.system)[place]
        assert (one is not None) == there


def test_a_burst_of_a_force_is_one_of_the_balance_of_its_building(cases: Cases) -> None:
    whole = bursts_in(cases.record(duration=12.0), "column_force")
    data = residuals.prepare(LoggedBuilding(Building(whole)), whole)
    (one,) = by_reading(data, remainder(data, data.system).single, data.system)
    assert one is not None
    assert one.why == "bursts"
    assert one.loudness.max() / one.loudness.min() > LOUDEST


@pytest.mark.long
@pytest.mark.parametrize("name", ["damper_stroke", "column_force", "table_displacement"])
def test_noise_that_comes_in_bursts_is_no_gap(name: str, cases: Cases) -> None:
    whole = bursts_in(cases.record(duration=12.0), name)
    result = diagnose({"slave": whole}, {})["slave"].report
    assert result.status in ("no_gap", "within_tolerances", "explained")
    assert all(effect.endswith(".noise") for effect in result.which[0].effects)
    assert any(one.startswith(f"The noise of {name} comes in bursts") for one in result.warnings)
