"""The criteria against NumPy's own statistics and known motions."""

from __future__ import annotations

import numpy as np
import pytest

from models.registry import Array
from validation.benchmark2020.criteria import MEANINGS, Criteria, criteria

INTERVAL = 1.0 / 4096.0
T = np.arange(8192) * INTERVAL


def wave(shift: float = 0.0, frequency: float = 3.0) -> Array:
    return np.asarray(
        np.sin(2.0 * np.pi * frequency * (T - shift)) * np.exp(-(((T - 1.0 - shift) / 0.3) ** 2))
    )


def test_every_criterion_is_the_ratio_of_its_definition() -> None:
    rng = np.random.default_rng(5)
    target, measured = rng.normal(size=500), rng.normal(size=500) + 0.3
    floors, reference = rng.normal(size=(500, 3)), rng.normal(size=(500, 3)) * (1.0, 2.0, 3.0)
    found = criteria(target, measured, floors, reference, INTERVAL)

    def spread(values: Array) -> float:
        return float(np.std(values))

    def largest(values: Array) -> float:
        return float(np.abs(values).max())

    error = floors - reference
    wanted = Criteria(
        found.j1,
        spread(measured - target) / spread(target),
        largest(measured - target) / largest(target),
        spread(measured - reference[:, 0]) / spread(reference[:, 0]),
        largest(measured - reference[:, 0]) / largest(reference[:, 0]),
        spread(error[:, 1]) / spread(reference[:, 1]),
        spread(error[:, 2]) / spread(reference[:, 2]),
        largest(error[:, 1]) / largest(reference[:, 1]),
        largest(error[:, 2]) / largest(reference[:, 2]),
    )
    assert found == pytest.approx(wanted)


def test_every_criterion_has_a_description() -> None:
    assert [name.lower() for name in MEANINGS] == list(Criteria._fields)


def test_equal_signals_make_all_criteria_zero() -> None:
    x = wave()
    floors = np.stack([x, 2.0 * x, 3.0 * x], axis=1)
    assert criteria(x, x, floors, floors, INTERVAL) == Criteria(*[0.0] * 9)
