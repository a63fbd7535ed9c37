"""The nominal actuator behind a compensator, and closed forms of the expected response."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from common.plan.laboratory_tables import Actuator, Column
from laboratories.column import model as column_lab
from models import compensators
from models.compensators import Built
from models.compensators.wanted import Wanted
from models.registry import Array

DT = 0.002
L, T = 0.014, 0.030  # s; dead time and time constant of the nominal actuator
ADAPTIVE = {"ats": 3, "amb": 4}  # coefficients, which stand first in the memory
GAINS = {"proportional": 1.93, "integral": 0.047, "derivative": 0.0}

Motion = Callable[[Array], tuple[Array, Array, Array, Array]]


class Run(NamedTuple):
    """Target and measurement at every tick, commands reached one tick later, coefficients of adaptive compensators."""

    target: Array
    measured: Array
    command: Array
    coefficients: Array


def clock(ticks: int) -> Array:
    """Times (s) of the first ticks."""
    return np.arange(ticks, dtype=np.float64) * np.float64(DT)


def sine(frequency: float, amplitude: float = 1.0) -> Motion:
    return waves([(frequency, amplitude, 0.0)])


def waves(parts: list[tuple[float, float, float]]) -> Motion:
    """Sum of sines (Hz, m, rad) with its first three derivatives."""

    def at(time: Array) -> tuple[Array, Array, Array, Array]:
        rows = [np.zeros_like(time) for _ in range(4)]
        for frequency, amplitude, phase in parts:
            w = 2.0 * math.pi * frequency
            for order in range(4):
                rows[order] += amplitude * w**order * np.sin(w * time + phase + order * math.pi / 2.0)
        return rows[0], rows[1], rows[2], rows[3]

    return at


def drive(
    kind: str,
    parameters: Mapping[str, float],
    motion: Motion,
    ticks: int,
    actuator: Actuator | None = None,
    noise: Array | None = None,
) -> Run:
    """Run a compensator on the actuator of laboratory A; `noise` (m) is added to what it is told."""
    built = compensators.build(kind, parameters, DT)
    lab = column_lab.build(DT, actuator or Actuator(), Column())
    r, rate, bend, jerk = motion(clock(ticks + 1))
    adaptive = ADAPTIVE.get(kind, 0)
    run = Run(r[:-1], np.zeros(ticks), np.zeros(ticks), np.zeros((ticks, adaptive)))
    measured = 0.0
    for k in range(ticks):
        run.measured[k] = measured
        told = measured + (0.0 if noise is None else float(noise[k]))
        run.command[k] = ask(built, r[k + 1], rate[k + 1], bend[k + 1], jerk[k + 1], r[k], told)
        run.coefficients[k] = built.state[:adaptive]
        measured, _ = column_lab.advance(lab, run.command[k])
    return run


def ask(
    built: Built,
    target: float,
    rate: float = 0.0,
    acceleration: float = 0.0,
    jerk: float = 0.0,
    present: float = 0.0,
    measured: float = 0.0,
) -> float:
    """One command; all numbers zero unless given."""
    wanted = Wanted(target, rate, acceleration, jerk, present, measured)
    return compensators.step(built, wanted, DT)


def response(run: Run, frequency: float, seconds: float = 4.0) -> complex:
    """Measured over target at one frequency, over the last whole seconds."""
    count = round(seconds / DT)
    turn = np.exp(-2j * math.pi * frequency * DT * np.arange(count))
    return complex(np.sum(run.measured[-count:] * turn) / np.sum(run.target[-count:] * turn))


def delay(ratio: complex, frequency: float) -> float:
    """Delay (s) of a frequency response."""
    return -cmath.phase(ratio) / (2.0 * math.pi * frequency)


def theory(kind: str, values: Mapping[str, float], frequency: float) -> complex:
    """Measured over target in steady state: y = G·(F·r + z⁻¹·C·(r − y)), from the transfer functions."""
    s = 2j * math.pi * frequency
    z = cmath.exp(s * DT)
    actuator = cmath.exp(-s * L) / (1.0 + s * T)
    forward: complex = 1.0
    order = int(values.get("order", 1))
    if kind.endswith("taylor"):
        forward = sum((s * values["lead"]) ** j / math.factorial(j) for j in range(order + 1))
    if kind.endswith("inverse"):
        full = [1.0, L + T, L**2 / 2.0 + L * T, L**3 / 6.0 + L**2 * T / 2.0]
        forward = sum(full[j] * s**j for j in range(order + 1))
    if kind == "horiuchi":
        weights = {1: [2, -1], 2: [3, -3, 1], 3: [4, -6, 4, -1]}[order]
        forward = sum(w * cmath.exp(-s * i * values["delay"]) for i, w in enumerate(weights))
    back: complex = 0.0
    if kind.startswith("pid"):
        integral = values["integral"] * DT / 2.0 * (1.0 + 1.0 / z) / (1.0 - 1.0 / z)
        back = (values["proportional"] + integral + values["derivative"] * (1.0 - 1.0 / z) / DT) / z
    return actuator * (forward + back) / (1.0 + actuator * back)
