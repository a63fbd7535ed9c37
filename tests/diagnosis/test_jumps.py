"""A reading whose zero jumps, and noise that only looks like it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from diagnosis.diagnose import diagnose
from diagnosis.findings.sensors import jumps
from diagnosis.findings.sites.likely import APART
from models.registry import Array
from tests.diagnosis.cases import Cases

COUNT = 1500  # averaged samples
NAME = "column_displacement"


def white(seed: int) -> Array:
    """Normal numbers of unit variance."""
    return np.asarray(np.random.default_rng(seed).normal(size=COUNT))


def steady(seed: int) -> dict[str, Array]:
    """Slow noises without jumps, beside white noise."""
    other = white(seed + 100)
    forgetting = signal.lfilter([0.14], [1.0, -0.99], other)
    return {
        "white": white(seed),
        "grows without end": white(seed) + 0.1 * np.cumsum(other),
        "forgets": white(seed) + 2.0 * forgetting,
        "filtered": signal.lfilter([0.3], [1.0, -0.7], other),
        "drift": white(seed) + np.linspace(0.0, 3.0, COUNT),
    }


@pytest.mark.parametrize("seed", range(3))
def test_slow_noise_does_not_jump(seed: int) -> None:
    for noise in steady(seed).values():
        found = jumps.found_in(noise)
        assert not found.places or found.nats < 0.5 * APART


def test_the_jumps_of_a_zero_are_found() -> None:
    noise = white(7)
    for place, size in ((300, 3.0), (700, -2.5), (1100, 3.0)):
        noise[place:] += size
    found = jumps.found_in(noise)
    assert found.nats > APART
    assert np.max(np.abs(np.array(found.places) - [300, 700, 1100])) <= 3
    assert found.white == pytest.approx(1.0, abs=0.1)


@pytest.mark.long
def test_a_reading_that_loses_counts_is_an_unknown_effect_of_it(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    read, lost = whole.signals[NAME].copy(), 1.5 * whole.planned_noise[NAME]
    for place, sign in ((900, 1.0), (1600, 1.0), (2100, -1.0), (3000, -1.0), (3500, 1.0)):
        read[place:] += sign * lost
    found = diagnose({"slave": replace(whole, signals=whole.signals | {NAME: read})}, {})["slave"].report
    assert (found.status, [place.site for place in found.where]) == ("unknown_effect", [f"sensor.{NAME}"])
    assert any(one.startswith(f"The zero of {NAME} jumps at ") for one in found.warnings)
