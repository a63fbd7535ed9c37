"""Histories of the emulated laboratories alone under given commands, for the tests of their effects."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.plan.laboratory_tables import Actuator, Column, Damper, ShakingTable
from laboratories.column import model as column_lab
from laboratories.column import specimen
from laboratories.table import linear
from laboratories.table import model as table_lab
from models.system import ActuatorEffects, ColumnEffects, DamperEffects, TableEffects

Array = NDArray[np.floating[Any]]
DT = 0.002  # s, interval
SHORT = 0.25e-3  # s, for what a longer interval would blur
K = 12.5e6  # N/m, of the specimen


def run_a(
    command: Array,
    actuator: Actuator | None = None,
    column: Column | None = None,
    actuator_effects: ActuatorEffects | None = None,
    column_effects: ColumnEffects | None = None,
) -> Array:
    """True displacement and force of laboratory A at the ends of the intervals."""
    lab = column_lab.build(
        DT, actuator or Actuator(), column or Column(stiffness=K), actuator_effects, column_effects
    )
    return np.array([column_lab.advance(lab, float(value)) for value in command])


def tones(ticks: int, seed: int = 1, size: float = 1.0) -> Array:
    """A smooth random command with amplitudes of about `size`."""
    random = np.random.default_rng(seed)
    t = np.arange(1, ticks + 1) * DT
    frequency, phase = random.uniform(0.5, 5.0, size=4), random.uniform(0.0, 6.0, size=4)
    waves = (np.sin(2.0 * np.pi * f * t + p) for f, p in zip(frequency, phase, strict=True))
    result: Array = size * sum(waves) * np.tanh(2.0 * t)
    return result


def ramped(values: Array, lag: float) -> Callable[[float], float]:
    """The command as the controller ramps it, `lag` s later."""
    times, reached = DT * np.arange(values.size + 1), np.concatenate([[0.0], values])
    return lambda t: float(np.interp(t - lag, times, reached))


def there_and_back(top: float, back: float, ticks: int) -> Array:
    return np.concatenate([np.linspace(0.0, top, ticks)[1:], np.linspace(top, top - back, ticks)[1:]])


def run_b(
    command: Array,
    motor: Array | None = None,
    table: ShakingTable | None = None,
    damper: Damper | None = None,
    table_effects: TableEffects | None = None,
    damper_effects: DamperEffects | None = None,
    interval: float = DT,
) -> Array:
    """Table displacement, acceleration, stroke, force, and both velocities at the ends of the intervals."""
    lab = table_lab.build(
        interval, table or ShakingTable(), damper or Damper(), table_effects, damper_effects
    )
    pushes = np.zeros(command.size) if motor is None else motor
    rows = []
    for value, push in zip(command.tolist(), pushes.tolist(), strict=True):
        result = table_lab.advance(lab, value, push)
        rows.append((*result, lab.state[linear.TABLE_RATE], lab.state[linear.STROKE_RATE]))
    return np.array(rows)


Y, ACCELERATION, STROKE, FORCE, RATE, STROKE_RATE = range(6)


def phasor(values: Array, t: Array, frequency: float, after: float) -> complex:
    """Complex amplitude over whole cycles from `after` s on: value = Re(phasor·e^(jωt))."""
    late = t > after + 1e-9
    cycles_ = math.floor(np.sum(late) * DT * frequency + 1e-6)
    count = round(cycles_ / (frequency * DT))
    turning = np.exp(-2j * np.pi * frequency * t[-count:])
    return complex(2.0 * np.mean(values[-count:] * turning))


def specimen_under(
    path: Array, effects: ColumnEffects, step: float = SHORT, column: Column | None = None
) -> Array:
    """Force at each deformation of a path, from rest at its first point."""
    parts = specimen.build(column or Column(stiffness=K), effects)
    return np.array([specimen.force(parts, float(deformation), step) for deformation in path])


def cycles(amplitude: float, frequency: float, count: int = 3) -> tuple[Array, Array]:
    """Times and deformations of a sine, in short steps, whole cycles."""
    steps = round(1.0 / (frequency * SHORT))
    t = np.arange(count * steps + 1) * SHORT
    return t, amplitude * np.sin(2.0 * np.pi * frequency * t)
