"""A flexible model explains known causes almost completely and noise not at all."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import signal

from common.errors import InputError
from diagnosis.fits.residuals import withheld_ticks
from diagnosis.signals.mask import Mask
from diagnosis.signals.predictors.ceiling import ceiling, depends_on
from diagnosis.signals.predictors.features import plays
from models.registry import Array

H, N = 0.002, 15_000
T: Array = np.arange(N, dtype=np.float64) * H


def split(n: int, interval: float) -> tuple[Mask, Mask]:
    """The samples for fitting and the withheld ones."""
    held = withheld_ticks(n, interval)
    return ~held, held


def drive(seed: int) -> Array:
    """Two modes shaken by noise under an earthquake's envelope; its peak is 4 to 5."""
    noise = np.random.default_rng(seed).standard_normal(N)
    x = np.zeros(N)
    for frequency in (1.2, 4.0):
        b, a = signal.butter(2, [frequency * 0.9, frequency * 1.1], "band", fs=1.0 / H)
        mode = signal.lfilter(b, a, noise)
        x += mode / mode.std() / frequency
    x *= 0.3 + np.minimum(T / 4.0, 1.0) * np.exp(-np.maximum(T - 12.0, 0.0) / 15.0)
    return np.asarray(x / x.std(), dtype=np.float64)


def play(x: Array, half: float) -> Array:
    result, y = np.empty_like(x), 0.0
    for k, value in enumerate(x):
        y = min(max(y, value - half), value + half)
        result[k] = y
    return result


def behind(x: Array) -> Array:
    b, a = signal.butter(2, 15.0, fs=1.0 / H)
    return np.asarray(signal.lfilter(b, a, x) - x)


CAUSES: dict[str, Callable[[Array], Array]] = {
    "filter": behind,
    "friction": lambda x: np.sign(np.gradient(x)),
    "backlash": lambda x: play(x, 0.2) - x,
    "cubic": lambda x: x**3,
    "drift": lambda x: T - 10.0,
}


@pytest.mark.parametrize("cause", CAUSES)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_flexible_model_explains_known_causes(cause: str, seed: int) -> None:
    x, random = drive(seed), np.random.default_rng(100 + seed)
    wanted = CAUSES[cause](x)
    residual = 3.0 * wanted / wanted.std() + random.standard_normal(N)
    inputs = np.column_stack([x + random.normal(0.0, 0.01, N), drive(seed + 50)])
    assert ceiling(inputs, residual, *split(N, H), 1.0, H) > 0.9


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("level", [1.0, 1.1])
def test_a_flexible_model_does_not_explain_noise(seed: int, level: float) -> None:
    residual = level * np.random.default_rng(1000 + seed).standard_normal(N)
    inputs = np.column_stack([drive(seed), drive(seed + 50)])
    assert ceiling(inputs, residual, *split(N, H), 1.0, H) < 0.1
    coordinates = {"x": inputs[:, 0], "t": T, "still": np.ones(N)}
    assert all(share < 0.1 for _, share in depends_on(coordinates, residual, 1.0))


def test_a_residual_of_an_unmeasured_input_is_not_explained() -> None:
    residual = 3.0 * drive(9) + np.random.default_rng(0).standard_normal(N)
    assert ceiling(drive(10), residual, *split(N, H), 1.0, H) < 0.15


def test_masks_that_leave_no_samples_are_refused() -> None:
    none = np.zeros(N, dtype=bool)
    with pytest.raises(InputError):
        ceiling(drive(1), drive(2), none, ~none, 1.0, H)


def test_a_constant_input_explains_a_constant_residual() -> None:
    residual = 3.0 + np.random.default_rng(0).standard_normal(N)
    assert ceiling(np.ones((N, 2)), residual, *split(N, H), 1.0, H) > 0.9


def test_a_play_operator_of_the_model_equals_the_kernel_for_play() -> None:
    x = drive(1)[:3000, None]
    np.testing.assert_allclose((plays(x) + x)[:, 4], play(x[:, 0], 0.1 * float(np.max(np.abs(x)))))


@pytest.mark.parametrize(("cause", "first"), [("friction", "v"), ("cubic", "x"), ("drift", "t")])
def test_the_coordinate_on_which_a_residual_depends_is_named(cause: str, first: str) -> None:
    x = drive(4)
    wanted = CAUSES[cause](x)
    residual = 2.0 * wanted / wanted.std() + np.random.default_rng(0).standard_normal(N)
    found = depends_on({"x": x, "v": np.gradient(x, H), "t": T}, residual, 1.0)
    assert found[0][0] == first
    assert found[0][1] > 0.85
    assert found[1][1] < 0.5


def test_withheld_seconds_divide_the_record() -> None:
    train, held = split(20_000, H)
    assert np.array_equal(train, ~held)
    assert held.mean() == pytest.approx(0.4)
    assert np.flatnonzero(held)[0] == 1000
    assert np.all(np.diff(np.flatnonzero(np.diff(held.astype(int)))) % 500 == 0)


@pytest.mark.parametrize("n", [17, 1000, 1501])
def test_short_records_are_divided_for_withheld_data(n: int) -> None:
    train, held = split(n, H)
    assert train.any()
    assert 0.2 <= held.mean() <= 0.6
