"""The sensor readings of the trial's laboratories."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import bilinear, lfilter

from tests.rths.trial.played_labs import (
    CLEAN,
    DT,
    RISE,
    SIGNALS_A,
    SIGNALS_B,
    TIMES,
    effect,
    near,
    play,
    play_a,
    play_b,
)
from validation.blind.labs import (
    SIGNALS,
)
from validation.blind.labs.column_lab import TrueColumnLab


@pytest.mark.parametrize("signal", SIGNALS)
def test_readings_are_falsified_independently(signal: str) -> None:
    clean, size = CLEAN[signal], float(np.max(np.abs(CLEAN[signal])))
    other = [name for name in (SIGNALS_A if signal in SIGNALS_A else SIGNALS_B) if name != signal]
    wanted = {
        f"sensor.{signal}.gain": ({"factor": 1.1}, 1.1 * clean),
        f"sensor.{signal}.bias": ({"offset": 0.1 * size}, clean + 0.1 * size),
        f"sensor.{signal}.drift": ({"rate": 0.01 * size}, clean + 0.01 * size * TIMES),
        f"sensor.{signal}.quantization": (
            {"step": 0.05 * size},
            0.05 * size * np.floor(clean / (0.05 * size) + 0.5),
        ),
        f"sensor.{signal}.saturation": ({"limit": size}, size * np.tanh(clean / size)),
    }
    for name, (parameters, values) in wanted.items():
        found = play(effect(name, "", **parameters))
        assert np.allclose(found[signal], values, rtol=0.0, atol=1e-9 * size), name
        assert all(np.array_equal(found[item], CLEAN[item]) for item in other)
    noisy = play(effect(f"sensor.{signal}.noise", rms=0.01 * size))
    assert np.std(noisy[signal] - clean) == pytest.approx(0.01 * size, rel=0.05)


def test_a_lag_acts_as_a_delay_at_low_frequency() -> None:
    slow = RISE * 1e-3 * np.sin(4.0 * TIMES)
    clean = play_a(command=slow)["column_displacement"]
    for formula in ("butterworth", "first_order"):
        found = play_a(effect("sensor.column_displacement.lag", formula, time_constant=0.008), command=slow)
        late = np.interp(TIMES - 0.008, TIMES, clean)
        assert near(found["column_displacement"][50:], late[50:], 2e-3), formula
        assert not near(found["column_displacement"], clean, 5e-3)


def test_a_high_pass_passes_what_is_fast_and_forgets_what_stands() -> None:
    constant = 0.5
    for signal, player in (
        ("column_force", play_a),
        ("table_acceleration", play_b),
        ("damper_force", play_b),
    ):
        clean = CLEAN[signal]
        found = player(effect(f"sensor.{signal}.high_pass", time_constant=constant))[signal]
        numerator, denominator = bilinear([constant, 0.0], [constant, 1.0], 1.0 / DT)
        assert near(found, lfilter(numerator, denominator, clean), 1e-6)
        assert not near(found, clean, 1e-3)


def test_readings_have_crosstalk_and_missing_samples() -> None:
    leak = play_b(effect("x.sensor.table_acceleration.crosstalk", coefficient=1e-3))
    extra = leak["table_acceleration"] - CLEAN["table_acceleration"]
    assert np.allclose(extra, 1e-3 * CLEAN["damper_force"], atol=1e-12)
    lost = play_a(effect("x.sensor.column_force.missing", probability=0.2))["column_force"]
    repeated = np.diff(lost[100:]) == 0.0
    assert np.mean(repeated) == pytest.approx(0.2, abs=0.03)
    assert np.array_equal(lost[101:][~repeated], CLEAN["column_force"][101:][~repeated])


def test_noise_is_white_has_its_level_and_depends_on_the_seed() -> None:
    still = np.zeros(TIMES.size)
    found = play_b(command=still, motor=still, sensors={})
    for name, level in zip(SIGNALS_B, (10e-6, 0.01, 2e-6, 0.2), strict=True):
        assert np.std(found[name]) == pytest.approx(level, rel=0.05)
        assert abs(np.corrcoef(found[name][1:], found[name][:-1])[0, 1]) < 0.06
    again = play_b(command=still, motor=still, sensors={})
    assert all(np.array_equal(values, again[name]) for name, values in found.items())
    assert TrueColumnLab(DT, 4).read() != TrueColumnLab(DT, 5).read()
