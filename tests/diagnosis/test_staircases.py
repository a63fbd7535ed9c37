"""Steps of a sensor are told from its noise although noise was added to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diagnosis.diagnose import examine
from diagnosis.findings.sensors.staircases import staircase
from models.registry import Array
from tests.diagnosis.cases import Cases


def motion(amplitude: float) -> Array:
    t = np.arange(6000) * 0.002
    return amplitude * (np.sin(2.0 * np.pi * 0.9 * t) + 0.5 * np.sin(2.0 * np.pi * 2.3 * t + 1.0))


@pytest.mark.long
@given(
    step=st.floats(1e-7, 1e2),
    levels=st.floats(3.0, 60.0),
    noise=st.floats(0.0, 0.3),
    seed=st.integers(0, 99),
)
def test_steps_below_noise_are_found_with_their_size(
    step: float, levels: float, noise: float, seed: int
) -> None:
    predicted = motion(levels * step)
    read = step * np.round(predicted / step) + np.random.default_rng(seed).normal(
        0.0, noise * step, predicted.size
    )
    found = staircase(predicted, read - predicted)
    assert found is not None
    assert found.step == pytest.approx(step, rel=5e-3)
    assert found.low <= step <= found.high


@given(levels=st.floats(2.0, 60.0), seed=st.integers(0, 99))
def test_noise_is_no_staircase(levels: float, seed: int) -> None:
    predicted = motion(levels)
    assert staircase(predicted, np.random.default_rng(seed).normal(0.0, 0.3, predicted.size)) is None
    assert staircase(0.0 * predicted, 0.0 * predicted) is None


@pytest.mark.parametrize(
    "bend", [np.sign, np.square, lambda x: x**3, lambda x: np.clip(x, -0.3, 0.3), np.sin]
)
def test_a_bent_scale_is_no_staircase(bend: Callable[[Array], Array]) -> None:
    predicted = motion(1.0)
    assert staircase(predicted, bend(predicted)) is None
    assert staircase(predicted, -predicted) is None  # a dead reading


@pytest.mark.parametrize("cycles", [1, 15])
def test_a_wrong_gain_of_a_motion_that_mostly_rests_is_no_staircase(cycles: int) -> None:
    phase = np.linspace(0.0, cycles, 12000) % 1.0
    predicted = np.clip(8.0 * phase, 0.0, 1.0) - np.clip(8.0 * (phase - 0.5), 0.0, 1.0)
    noise = np.random.default_rng(1).normal(0.0, 1e-3, predicted.size)
    assert staircase(predicted, -0.07 * predicted + noise) is None


@pytest.mark.long
@pytest.mark.parametrize("rms", [5e-5, 2e-4])
@pytest.mark.parametrize("fault", ["noise", "quantization"])
def test_the_fault_of_a_sensor_is_told_behind_a_loggers_noise(cases: Cases, fault: str, rms: float) -> None:
    whole = cases.record(duration=8.0)
    name, generator = "table_displacement", np.random.default_rng(3)
    true = whole.signals[name]
    step = np.sqrt(12.0) * rms
    values = (
        step * np.round(true / step)
        if fault == "quantization"
        else true + generator.normal(0.0, rms, true.size)
    )
    values = values + generator.normal(0.0, 0.2 * rms, true.size)
    logged = replace(whole, signals=whole.signals | {name: values})
    result = examine(logged)
    found = result.readings
    assert [item.effect for item in found] == [f"sensor.{name}.{fault}"]
    assert {item.outcome for item in result.verdicts} <= {"none", "tolerances"}
    assert found[0].value == pytest.approx(step if fault == "quantization" else rms, rel=0.05)
