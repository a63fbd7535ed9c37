"""Cyclic tests of the column against loops of known area."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from common.errors import InputError
from laboratories.identification import column
from models import specimens

Array = NDArray[np.float64]
AMPLITUDES = (0.0015, 0.003, 0.0045, 0.006, 0.0075)
STIFFNESS = 12.5e6


def protocol(ticks: int = 1000, shape: str = "triangle", hold: int = 0) -> Array:
    """Three cycles of each amplitude, `ticks` each, with a rest before."""
    phase = np.arange(ticks) / ticks
    wave = np.sin(2.0 * np.pi * phase)
    if shape == "triangle":
        wave = 2.0 / np.pi * np.arcsin(wave)
    parts = [np.zeros(100)]
    for amplitude in AMPLITUDES:
        for _ in range(3):
            parts.extend([amplitude * wave, np.zeros(hold)])
    return np.concatenate([*parts, np.zeros(100)])


def noisy(deformation: Array, force: Array, seed: int) -> tuple[Array, Array]:
    random = np.random.default_rng(seed)
    return (
        deformation + 5e-6 * random.standard_normal(force.size),
        force + 100.0 * random.standard_normal(force.size),
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("hold", [0, 60])
@pytest.mark.parametrize("shape", ["triangle", "sine"])
def test_a_linear_columns_stiffness_is_found_to_a_thousandth(shape: str, hold: int, sign: float) -> None:
    deformation = sign * protocol(shape=shape, hold=hold)
    found = column.cycles(*noisy(deformation, STIFFNESS * deformation, 1), AMPLITUDES)
    assert found.stiffness.value == pytest.approx(STIFFNESS, rel=1e-3)
    assert found.stiffness.unit == "N/m"
    assert [cycle.nominal for cycle in found.cycles] == list(np.repeat(AMPLITUDES, 3))
    for cycle in found.cycles:
        assert cycle.amplitude == pytest.approx(cycle.nominal, rel=0.01)
        assert cycle.stiffness == pytest.approx(STIFFNESS, rel=0.01)
        assert abs(cycle.damping_ratio) < 2e-3


def test_the_confidence_interval_covers_the_elastic_stiffness() -> None:
    deformation = protocol(400)
    hits = 0
    for seed in range(40):
        random = np.random.default_rng(seed)
        force = STIFFNESS * deformation + 100.0 * random.standard_normal(deformation.size)
        found = column.cycles(
            deformation + 5e-6 * random.standard_normal(deformation.size), force, AMPLITUDES
        )
        hits += found.stiffness.low <= STIFFNESS <= found.stiffness.high
    assert hits >= 34


def test_elliptic_loops_give_their_area_and_equivalent_damping() -> None:
    """`f = k·δ + c·δ̇` on a sine: area `π·c·ω·a²`, equivalent damping `c·ω/(2k)`."""
    ticks, interval = 2000, 0.002
    omega = 2.0 * np.pi / (ticks * interval)
    dashpot = 2e5
    phase = omega * interval * np.arange(3 * ticks + 1)
    deformation = np.concatenate([a * np.sin(phase[:-1]) for a in AMPLITUDES])
    rate = np.concatenate([a * omega * np.cos(phase[:-1]) for a in AMPLITUDES])
    found = column.cycles(*noisy(deformation, STIFFNESS * deformation + dashpot * rate, 2), AMPLITUDES)
    assert len(found.cycles) == 15
    for cycle in found.cycles:
        assert cycle.area == pytest.approx(np.pi * dashpot * omega * cycle.nominal**2, rel=0.03)
        assert cycle.damping_ratio == pytest.approx(dashpot * omega / (2.0 * STIFFNESS), rel=0.04)


def test_a_yielding_columns_dissipated_energy_is_the_area_of_its_loop() -> None:
    """Bilinear: `4·(1 − α)·k·δ_y·(X − δ_y)`, secant `k·(α + (1 − α)·δ_y/X)`."""
    limit, hardening = 0.002, 0.1
    code, params, memory = specimens.pack(
        "bilinear", stiffness=STIFFNESS, yield_displacement=limit, hardening=hardening
    )
    deformation = protocol(2000)
    force = np.array([specimens.step(code, params, memory, float(value)) for value in deformation])
    found = column.cycles(*noisy(deformation, force, 3), AMPLITUDES)
    assert found.stiffness.value == pytest.approx(STIFFNESS, rel=1e-3)
    for number, cycle in enumerate(found.cycles):
        x = cycle.nominal
        if x < limit or number % 3 == 0:  # the first cycle of an amplitude is no closed loop
            continue
        area = 4.0 * (1.0 - hardening) * STIFFNESS * limit * (x - limit)
        assert cycle.area == pytest.approx(area, rel=0.02)
        secant = STIFFNESS * (hardening + (1.0 - hardening) * limit / x)
        assert cycle.stiffness == pytest.approx(secant, rel=0.01)


def test_a_protocol_that_does_not_fit_the_record_is_refused() -> None:
    deformation = protocol(200)
    force = STIFFNESS * deformation
    broken = force.copy()
    broken[5] = np.nan
    cases = [
        (deformation[:10], force[:10], AMPLITUDES, "10 samples"),
        (deformation, force[:-1], AMPLITUDES, "one length"),
        (deformation, broken, AMPLITUDES, "not finite at tick 5"),
        (np.zeros(force.size), force, AMPLITUDES, "constant"),
        (deformation, np.zeros(force.size), AMPLITUDES, "constant"),
        (deformation, force, (), "No amplitude"),
        (deformation, force, (-0.001,), "above 0"),
        (deformation, force, (*AMPLITUDES, 0.009), "no complete cycle of 9 mm"),
        (deformation, force, AMPLITUDES[:3], "does not name"),
        (np.linspace(0.0, 0.0075, force.size), force, AMPLITUDES, "no complete cycle"),
    ]
    for x, f, amplitudes, what in cases:
        with pytest.raises(InputError, match=what):
            column.cycles(x, f, amplitudes)
