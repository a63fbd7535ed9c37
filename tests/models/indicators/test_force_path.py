"""The estimated delay and gain of a force, tested with forces of known delay and gain."""

from __future__ import annotations

import numpy as np
import pytest

from common.errors import InputError
from common.plan.plan import Plan
from laboratories.column.kind import COLUMN
from loop.force_path import force_path
from models import indicators
from models.registry import Array
from validation.benchmark2020.problem import CASES, EL_CENTRO, SETTINGS, with_compensator
from validation.benchmark2020.runs import play, specimen_force, stage

DT = 0.002


def times(ticks: int) -> Array:
    return np.arange(ticks, dtype=np.float64) * np.float64(DT)


def motion(t: Array) -> Array:
    """A sum of sines around 2 Hz that grow and decay, at any time."""
    draws = np.random.default_rng(5)
    f, phase = draws.normal(2.0, 0.5, 40), draws.uniform(0.0, 6.28, 40)
    envelope = np.exp(-(((t - 12.0) / 8.0) ** 2))
    return np.asarray(1e3 * envelope * np.sin(2.0 * np.pi * np.outer(t, f) + phase).sum(axis=1))


def noisy(values: Array, level: float, seed: int) -> Array:
    return values + level * np.random.default_rng(seed).standard_normal(values.size)


@pytest.mark.parametrize("seconds", [8.0, 40.0])
@pytest.mark.parametrize("delay", [-0.0313, -0.0011, 0.0, 0.0007, 0.002, 0.0123, 0.08])
def test_a_known_delay_and_gain_are_found(delay: float, seconds: float) -> None:
    t = times(round(seconds / DT))
    found = indicators.force_path(motion(t), 1.07 * motion(t - delay), DT)
    assert found.delay == pytest.approx(delay, abs=2e-6 + 2e-3 * abs(delay))
    assert found.gain == pytest.approx(1.07, rel=2e-3)
    assert found.frequency == pytest.approx(2.0, abs=0.5)
    assert found.interval[0] <= found.delay <= found.interval[1]


def test_the_interval_covers_the_true_delay_as_often_as_stated() -> None:
    """Of 200 draws of noise 95 % within three standard errors of such a count."""
    t = times(20_000)
    expected, measured = motion(t), motion(t - 0.002)
    within = 0
    for seed in range(200):
        found = indicators.force_path(
            noisy(expected, 60.0, 2 * seed), noisy(measured, 90.0, 2 * seed + 1), DT
        )
        within += found.interval[0] <= 0.002 <= found.interval[1]
        assert found.interval[1] - found.interval[0] < 2e-3
    assert 0.90 <= within / 200 <= 0.995


@pytest.mark.parametrize("ticks", [0, 8, -8, 40])
@pytest.mark.parametrize("case", [1, 4])
def test_the_force_delay_is_found_under_the_noise_of_a_specimen_with_mass(ticks: int, case: int) -> None:
    """With the benchmark's readings the displacement's noise, differentiated twice, is twenty times the force."""
    on = stage(CASES[case - 1], EL_CENTRO, 0, 1)
    plan = with_compensator(on.plants[0], SETTINGS["amb"])
    _, rollout = play(on, "amb", plan)
    measured, late = (np.ascontiguousarray(rollout.master[name]) for name in COLUMN.channels.names)
    interval = plan.test.interval
    found = indicators.force_path(specimen_force(plan, measured), np.roll(late, ticks), interval)
    assert found.delay == pytest.approx(ticks * interval, abs=1e-4)
    assert found.interval[0] - 5e-5 <= ticks * interval <= found.interval[1] + 5e-5
    assert found.gain == pytest.approx(1.0, abs=5e-3)


def test_a_dashpot_that_the_plan_lacks_appears_as_a_lead() -> None:
    t = times(20_000)
    x = motion(t)
    found = indicators.force_path(x, x + 0.003 * np.gradient(x, DT), DT)
    assert found.delay == pytest.approx(-0.003, rel=0.01)


def test_the_planned_columns_force_is_computed_from_the_measured_displacement() -> None:
    plan = Plan()
    x = motion(times(5000)) / 12.5e6
    found = force_path(plan, x, np.roll(plan.column.stiffness * x, 3))
    assert found is not None
    assert found.delay == pytest.approx(3 * DT, rel=2e-3)
    assert found.gain == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("seconds", [10.0, 40.0])
@pytest.mark.parametrize("width", [0.1, 0.4, 1.0, 3.0])
def test_unrelated_noise_under_the_same_burst_is_refused(width: float, seconds: float) -> None:
    """A single strong block would appear coherent with any signal."""
    t = times(round(seconds / DT))
    for seed in range(10):
        burst = np.exp(-0.5 * ((t - 4.0 - 0.1 * seed) / width) ** 2)
        one, other = np.random.default_rng(seed).standard_normal((2, t.size)) * burst
        with pytest.raises(InputError, match="coherent with that of the specimen's model at no frequency"):
            indicators.force_path(one, other, DT)


@pytest.mark.parametrize("place", [0, 1000, 4900])
def test_a_pulse_within_one_block_is_refused(place: int) -> None:
    """No other block confirms the estimate."""
    pulse = np.zeros(5000)
    pulse[place : place + 40] = 1e3 * np.hanning(40)
    with pytest.raises(InputError, match="or only for a moment"):
        indicators.force_path(pulse, np.roll(pulse, 3), DT)
    assert force_path(Plan(), pulse / 12.5e6, np.roll(pulse, 3)) is None


def test_signals_without_information_are_refused() -> None:
    t = times(5000)
    with pytest.raises(InputError, match="coherent with that of the specimen's model at no frequency"):
        indicators.force_path(motion(t), noisy(0.0 * t, 1.0, 3), DT)
    with pytest.raises(InputError, match="100 ticks are too few for a delay of the force: give at least 256"):
        indicators.force_path(motion(t[:100]), motion(t[:100]), DT)
    with pytest.raises(InputError, match="constant"):
        indicators.force_path(motion(t), 0.0 * t, DT)
    assert force_path(Plan(), 0.0 * t, 0.0 * t) is None
