"""The benchmark control problem for real-time hybrid simulation, written from its publication.

Silva, Gomez, Maghareh, Dyke and Spencer, Mechanical Systems and Signal Processing 135 (2020) 106381: three storeys of
which a part of the first stands in the laboratory, a servo-hydraulic actuator and its specimen as one linear plant,
sensors with noise, one tick of delay of the measured force, 4096 ticks a second.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import linalg

from models import compensators, trend
from models.compensators import Built, Wanted
from models.compiled import jit
from models.ground_motion import load
from models.registry import Array

DT = 1.0 / 4096.0
STIFFNESS = 1e6 * np.array(
    [[26.0549, -23.1339, 5.9370], [-23.1339, 32.5608, -14.4200], [5.9370, -14.4200, 9.2673]]
)
CASES = {1: (1000.0, 0.05), 2: (1100.0, 0.04), 3: (1300.0, 0.03), 4: (1000.0, 0.03)}  # kg per floor, ζ
M_E, C_E, K_E = 29.13, 114.6, 1.19e6  # the specimen: kg, N·s/m, N/m
NOISE = (0.016e-3, 2.2)  # rms: m, N
TAIL = 10.0  # s of rest after the record
MOTIONS = {
    "el_centro_1940_ns": 0.4,
    "loma_prieta_1989_corralitos_000": 0.2,
    "san_fernando_1971_pacoima_dam_164": 0.2,
}


@dataclass(frozen=True)
class Plant:
    """q̈ + β₁·q̇ + β₂·q = a₁β₀·(g·u − x), ḟ = −a₃·f + q − a₂·ẋ, m·ẍ + c·ẋ + k·x = f."""

    a3: float = 3.3
    beta1: float = 425.0
    beta2: float = 9.9976e4
    specimen: float = K_E

    def discrete(self) -> tuple[Array, Array]:
        """Transition over one tick of the states q, q̇, f, x, ẋ, and what a command held adds."""
        a = np.zeros((6, 6))
        a[0, 1] = 1.0
        a[1, [0, 1, 3, 5]] = -self.beta2, -self.beta1, -2.1283e13, 2.1283e13 * 1.0261
        a[2, [0, 2, 4]] = 1.0, -self.a3, -4.2297e6
        a[3, 4] = 1.0
        a[4, [2, 3, 4]] = 1.0 / M_E, -self.specimen / M_E, -C_E / M_E
        whole = linalg.expm(a * DT)
        return np.ascontiguousarray(whole[:5, :5]), np.ascontiguousarray(whole[:5, 5])


def perturbed(seed: int) -> Plant:
    """A plant drawn from the published spreads."""
    a3, beta1, beta2, k = np.random.default_rng(seed).standard_normal(4).tolist()
    return Plant(3.3 + 1.3 * a3, 425.0 + 3.3 * beta1, 9.9976e4 + 3.3e3 * beta2, K_E + 5e4 * k)


def runge_kutta(
    mass: Array, damping: Array, stiffness: Array, shaken: Array
) -> tuple[Array, Array, Array, Array]:
    """Fourth-order step of [x, ẋ]: transition (6, 6), the first floor's force (6,), the ground at both ends (6, 2).

    Last the derivative of the state, of state, force and ground (6, 8).
    """
    n = 3
    inverse = np.linalg.inv(mass)
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])
    force = np.concatenate([np.zeros(n), -inverse[:, 0]])
    ground = np.concatenate([np.zeros(n), -inverse @ shaken @ np.ones(n)])

    def step(y: Array, early: Array, late: Array) -> Array:
        middle = 0.5 * (early + late)
        k1 = a @ y + early
        k2 = a @ (y + 0.5 * DT * k1) + middle
        k3 = a @ (y + 0.5 * DT * k2) + middle
        k4 = a @ (y + DT * k3) + late
        result: Array = y + DT / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return result

    zero = np.zeros(2 * n)
    transition = np.stack([step(row, zero, zero) for row in np.eye(2 * n)], axis=1)
    sides = np.stack([step(zero, ground, zero), step(zero, zero, ground)], axis=1)
    return transition, step(zero, force, force), sides, np.column_stack([a, force, ground])


@dataclass(frozen=True)
class Run:
    """Target, measurement and measured force at every tick, and the reference's first floor."""

    target: Array
    measured: Array
    force: Array
    reference: Array

    @property
    def j1(self) -> float:
        """Delay (ms) of the best of 50 correlations."""
        n = self.target.size
        fits = [np.corrcoef(self.target[: n - k], self.measured[k:])[0, 1] for k in range(50)]
        return float(1e3 * DT * np.argmax(fits))

    @property
    def j2(self) -> float:
        """Tracking error, rms in percent."""
        return float(100.0 * np.std(self.measured - self.target) / np.std(self.target))

    @property
    def j4(self) -> float:
        """Error of the first floor against the reference, rms in percent."""
        return float(100.0 * np.std(self.measured - self.reference) / np.std(self.reference))


@cache
def shaking(record: str, scale: float) -> Array:
    """Ground acceleration (m/s²) at every tick, with the tail at rest."""
    motion = load(record, Path())
    values = np.asarray(motion.acceleration)
    time = np.arange(values.size) * motion.interval
    ticks = np.arange(round((time[-1] + TAIL) / DT)) * DT
    return scale * np.interp(ticks, time, values, right=0.0)


def matrices(case: int) -> tuple[Array, Array]:
    """Mass and modal damping of a case."""
    m, zeta = CASES[case]
    squares, modes = np.linalg.eigh(STIFFNESS / m)
    return m * np.eye(3), m * modes @ np.diag(2.0 * zeta * np.sqrt(squares)) @ modes.T


def run(
    kind: str,
    parameters: Mapping[str, float],
    case: int = 1,
    record: str = "el_centro_1940_ns",
    plant: Plant | None = None,
    seed: int = 1,
    force_delay: int = 1,
) -> Run:
    """One test; the numerical part leaves out the specimen that the plant has."""
    plant = plant or Plant()
    ground = shaking(record, MOTIONS[record])
    mass, damping = matrices(case)
    at = np.zeros((3, 3))
    at[0, 0] = 1.0
    whole = runge_kutta(mass, damping, STIFFNESS, mass)
    part = runge_kutta(mass - M_E * at, damping - C_E * at, STIFFNESS - plant.specimen * at, mass)
    built = compensators.build(kind, parameters, DT)
    noise = np.random.default_rng(seed).standard_normal((ground.size, 2)) * NOISE
    out = np.zeros((4, ground.size))
    states = np.zeros((4, 6))  # numerical part, reference, plant and a row of work
    forces = np.zeros(force_delay + 1)
    advance(
        Loop(part, whole, plant.discrete(), built, forces, np.zeros(trend.RECENT)), ground, noise, states, out
    )
    return Run(*out)


class Loop(NamedTuple):
    """What a test consists of: steps of `runge_kutta` for two buildings, the plant's, and what they remember."""

    numerical: tuple[Array, Array, Array, Array]
    reference: tuple[Array, Array, Array, Array]
    plant: tuple[Array, Array]
    compensator: Built
    forces: Array  # N, measured, newest first
    recent: Array  # accelerations of the first floor, newest first, m/s²


@jit
def move(transition: Array, s: Array, work: Array) -> None:
    """One step of the transition alone, for the first values of `s`."""
    n = transition.shape[0]
    for i in range(n):
        work[i] = 0.0
        for j in range(n):
            work[i] += transition[i, j] * s[j]
    for i in range(n):
        s[i] = work[i]


@jit
def advance(loop: Loop, ground: Array, noise: Array, states: Array, out: Array) -> None:
    """The whole test into the rows of `out`: target, measured, measured force, reference."""
    transition, pushed, sides, slope = loop.numerical
    transition_0, _pushed_0, sides_0, _slope_0 = loop.reference
    plant, held = loop.plant
    forces, recent = loop.forces, loop.recent
    y, whole, x, work = states[0], states[1], states[2], states[3]
    for k in range(ground.size):
        early = ground[k]
        late = ground[min(k + 1, ground.size - 1)]
        out[0, k], out[3, k] = y[0], whole[0]
        out[1, k] = x[3] + noise[k, 0]
        out[2, k] = x[2] + noise[k, 1]
        for i in range(forces.size - 1, 0, -1):
            forces[i] = forces[i - 1]
        forces[0] = out[2, k]
        force = forces[forces.size - 1]
        acceleration = slope[3, 6] * force + slope[3, 7] * early
        for i in range(6):
            acceleration += slope[3, i] * y[i]
        trend.remember(recent, acceleration)
        move(transition, y, work)
        move(transition_0, whole, work)
        for i in range(6):
            y[i] += pushed[i] * force + sides[i, 0] * early + sides[i, 1] * late
            whole[i] += sides_0[i, 0] * early + sides_0[i, 1] * late
        wanted = Wanted(y[0], y[3], trend.ahead(recent), trend.slope(recent, DT), out[0, k], out[1, k])
        command = compensators.step(loop.compensator, wanted, DT)
        move(plant, x, work)
        for i in range(5):
            x[i] += held[i] * command
        if not abs(x[3]) < 1.0:
            out[1, k:] = np.inf
            return
