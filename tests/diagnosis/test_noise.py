"""Noise and quantum, on the default test's own signals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import InputError
from common.plan import Plan
from diagnosis.signals.noise import quantum, white_rms
from models import closed_loop, substructure
from models.registry import Array

NAMES = closed_loop.MEASURED_A + closed_loop.MEASURED_B
H = 0.002


@pytest.fixture(scope="module")
def clean(default_plan: Plan) -> dict[str, Array]:
    rows = substructure.ground_rows(default_plan, substructure.motion(default_plan))
    signals = closed_loop.signals(default_plan, closed_loop.simulate(default_plan, rows))
    return {name: signals[name] for name in NAMES}


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("factor", [0.5, 1.0, 3.0])
def test_noise_of_the_default_test(
    clean: dict[str, Array], default_plan: Plan, name: str, factor: float
) -> None:
    level = factor * getattr(default_plan.sensors, name)
    random = np.random.default_rng(7)
    noisy = clean[name] + random.normal(0.0, level, clean[name].size)
    assert white_rms(noisy, H) == pytest.approx(level, rel=0.03)
    short = np.array([white_rms(noisy[k : k + 1000], H) for k in range(0, 20_000, 1000)]) / level
    assert np.mean(short) == pytest.approx(1.0, abs=0.025)
    assert np.mean(np.abs(short - 1.0) < 0.05) >= 0.75  # chance alone leaves 2.9 % of two seconds
    assert np.max(np.abs(short - 1.0)) < 0.15


@pytest.mark.parametrize("name", NAMES)
def test_clean_signals_have_no_noise(clean: dict[str, Array], default_plan: Plan, name: str) -> None:
    assert white_rms(clean[name], H) < 1e-3 * getattr(default_plan.sensors, name)
    assert quantum(clean[name]) == 0.0


def test_spikes_and_steps_do_not_count(clean: dict[str, Array]) -> None:
    x = clean["damper_force"] + np.random.default_rng(3).normal(0.0, 0.2, 20_000)
    x[::400] += 50.0
    x[7000:] += 100.0
    assert white_rms(x, H) == pytest.approx(0.2, rel=0.03)
    x[::20] -= 50.0
    assert white_rms(x, H) == pytest.approx(0.2, rel=0.06)


@pytest.mark.parametrize("interval", [0.0005, 0.001, 0.005, 0.01])
def test_other_intervals(interval: float) -> None:
    t = np.arange(int(20.0 / interval)) * interval
    x = 1000.0 * np.sin(2 * np.pi * t) + np.random.default_rng(1).standard_normal(t.size)
    assert white_rms(x, interval) == pytest.approx(1.0, rel=0.06)


@pytest.mark.parametrize("n", [1, 5, 9, 50, 2000])
def test_constants(n: int) -> None:
    assert white_rms(np.full(n, 3.3), H) == 0.0
    assert quantum(np.full(n, 3.3)) == 0.0


def test_scales_with_the_signal() -> None:
    x = np.random.default_rng(0).standard_normal(3000)
    assert white_rms(1e-9 * x + 5.0, H) == pytest.approx(1e-9 * white_rms(x, H), rel=1e-4)


def test_not_finite_is_refused() -> None:
    with pytest.raises(InputError):
        white_rms(np.array([1.0, np.nan]), H)
    with pytest.raises(InputError):
        quantum(np.array([]))


@given(
    step=st.floats(1e-9, 1e3),
    offset=st.floats(-50.0, 50.0),
    spread=st.floats(1.0, 3000.0),
    seed=st.integers(0, 99),
)
def test_quantum_of_rounded_noise(step: float, offset: float, spread: float, seed: int) -> None:
    places = np.round(np.random.default_rng(seed).normal(0.0, spread, 2000))
    gap = float(np.gcd.reduce(np.diff(np.unique(places)).astype(np.int64)))
    assert quantum(places * step + offset * step) == pytest.approx(gap * step, rel=1e-9)


def test_quantum_with_missing_levels() -> None:
    assert quantum(0.1 * np.array([0.0, 2.0, 2.0, 5.0, 9.0])) == pytest.approx(0.1)
    assert quantum(0.3 * np.array([6.0, 10.0, 21.0, 1000.0])) == pytest.approx(0.3)
    assert quantum(np.array([1.0, 1.0, 4.0])) == pytest.approx(3.0)
    assert quantum(np.sin(np.arange(5000) * 0.01)) == 0.0
    assert quantum(np.concatenate([np.zeros(900), np.random.default_rng(0).random(100)])) == 0.0
