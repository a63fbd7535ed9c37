"""The example of a user's kind, a viscous damper under an actuator, compared with closed forms."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from common.plan import read as plans
from common.plan.plan import Plan
from laboratories.completeness import driven
from laboratories.device import Device
from laboratories.effects.effect import Effect
from laboratories.kinds import kind_of
from models.registry import Array
from models.system import System
from tests.helpers import ROOT

FILE = ROOT / "examples" / "viscous_damper.py"
INTERVAL = 2e-3
NOMINAL = {
    "stiffness": 25e6,
    "coefficient": 232.7e3,
    "exponent": 0.35,
    "delay": 0.008,
    "time_constant": 0.012,
}


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plans.load(FILE.with_suffix(".toml"))


@pytest.fixture(scope="module")
def damper(plan: Plan) -> Device:
    kind = kind_of(plan, "slave")
    assert isinstance(kind, Device)
    return kind


def moved(
    kind: Device,
    command: Callable[[float], float],
    ticks: int,
    faults: dict[str, float] | None = None,
    **given: float,
) -> Array:
    """The readings of the kernel, without compilation, under a command over time; (ticks, 2)."""
    values = (NOMINAL | given).values()
    row = np.array([INTERVAL, *values, *({"leak": 0.0, "air": 0.0} | (faults or {})).values()])
    state, truth = np.zeros(kind.states), np.zeros(2)
    read = []
    for tick in range(1, ticks + 1):
        type(kind).step(row, state, truth, command(tick * INTERVAL), 0.0)
        read.append(truth.copy())
    return np.array(read)


def amplitude(signal: Array, frequency: float) -> complex:
    """Complex amplitude by sin ωt of the last two periods, tick 1 at one interval."""
    ticks = round(2.0 / frequency / INTERVAL)
    t = np.arange(signal.size - ticks + 1, signal.size + 1) * INTERVAL
    return complex(2j * np.mean(signal[-ticks:] * np.exp(-2j * math.pi * frequency * t)))


def test_the_example_of_a_users_kind_has_at_most_120_lines() -> None:
    assert len(FILE.read_text(encoding="utf-8").splitlines()) <= 120


@pytest.mark.parametrize("frequency", [0.5, 2.0, 10.0])
def test_a_linear_damper_has_the_storage_and_loss_stiffness_of_a_maxwell_element(
    damper: Device, frequency: float
) -> None:
    stiffness, coefficient = 25e6, 1.2e6  # relaxation in 48 ms: both parts count at 0.5 to 10 Hz
    omega = 2.0 * math.pi * frequency
    read = moved(
        damper,
        lambda t: 5e-3 * math.sin(omega * t),
        round((0.5 + 4.0 / frequency) / INTERVAL),
        coefficient=coefficient,
        exponent=1.0,
    )
    found = amplitude(read[:, 1], frequency) / amplitude(read[:, 0], frequency)
    relaxation = omega * coefficient / stiffness
    storage, loss = (stiffness * relaxation**power / (1.0 + relaxation**2) for power in (2, 1))
    assert found.real == pytest.approx(storage, rel=2e-3)
    assert found.imag == pytest.approx(loss, rel=2e-3)


@pytest.mark.parametrize("frequency", [1.0, 5.0])
def test_the_examples_actuator_is_a_lag_with_dead_time(damper: Device, frequency: float) -> None:
    omega = 2.0 * math.pi * frequency
    read = moved(
        damper, lambda t: 5e-3 * math.sin(omega * t), round(4.0 / frequency / INTERVAL), delay=0.0071
    )
    wanted = 5e-3 * cmath.exp(-1j * omega * 0.0071) / (1.0 + 1j * omega * 0.012)
    assert abs(amplitude(read[:, 0], frequency) - wanted) < 1e-3 * abs(wanted)


def test_at_constant_speed_the_force_is_that_of_the_dashpot(damper: Device) -> None:
    for speed in (0.02, -0.2):
        read = moved(damper, lambda t, v=speed: v * t, 1000)  # type: ignore[misc]
        assert read[-1, 1] == pytest.approx(math.copysign(232.7e3 * abs(speed) ** 0.35, speed), rel=1e-6)


def test_an_oil_leak_lowers_the_force_of_the_dashpot(damper: Device) -> None:
    read = moved(damper, lambda t: 0.1 * t, 1000, {"leak": 0.3})
    assert read[-1, 1] == pytest.approx(0.7 * 232.7e3 * 0.1**0.35, rel=1e-6)


def test_trapped_air_gives_a_zero_force_over_its_width_in_each_direction(damper: Device) -> None:
    read = moved(damper, lambda t: 0.05 * min(t, 1.0 - t), 500, {"air": 2e-3})
    piston, force = read.T
    assert np.all(force[: int(np.argmax(piston > 1e-3))] == 0.0)
    top = int(np.argmax(piston))
    zero = np.flatnonzero(force[top:] == 0.0) + top
    assert zero.size
    assert piston[zero[0]] - piston[zero[-1]] == pytest.approx(2e-3, abs=0.25e-3)


def test_the_compiled_kernel_gives_the_same_readings(damper: Device, plan: Plan) -> None:
    lab = damper.build(System(plan))
    truth = np.zeros(2)
    driven(lab.step, lab.parameters, lab.state, truth, 5e-3, 250)
    read = moved(damper, lambda t: 5e-3 * math.sin(2.0 * math.pi * t / (250 * INTERVAL)), 250)
    assert truth == pytest.approx(read[-1], rel=1e-9)


def test_the_examples_effects_change_the_kernels_parameters(damper: Device, plan: Plan) -> None:
    effects: dict[str, Effect] = {effect.name: effect for effect in damper.effects}
    assert list(effects) == ["device.leak", "device.air"]
    system = effects["device.leak"].apply(System(plan), share=0.25)
    system = effects["device.air"].apply(system, width=1e-3)
    assert damper.build(system).parameters.tolist() == [INTERVAL, *NOMINAL.values(), 0.25, 1e-3]
    null: Any = effects["device.leak"].apply(System(plan), share=0.0)
    assert damper.build(null).parameters.tolist() == damper.build(System(plan)).parameters.tolist()
