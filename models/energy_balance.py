"""Energies of a running hybrid test: the error energy of the interface and the energy error of the integration.

Interface. The specimen is deformed by `d_m` where the numerical part asked for `d_t` (`ratio` is deformation over
storey drift), and its force is `f`, counted `represents` times:

    E_error = Σ represents·½(f_{k−1} + f_k)·Δ(d_m − d_t)/ratio

It is positive where the transfer system puts energy into the loop, as a delay τ does: π·k·A²·sin(ωτ) in each cycle
of amplitude A and frequency ω, from a specimen that is a spring k on the storey's drift.

Source: Mosqueda, Stojadinovic and Mahin, Real-time error monitoring for hybrid simulation, J. Struct. Eng. 133
(2007); Ahmadizadeh and Mosqueda (2009). `indicators.hybrid_simulation_error_energy` computes it from a recording.

Integration. Kinetic energy, what dashpots dissipate, the work of the numerical columns and of the specimen, less
the work of the ground and of the dampers, is zero for exact motion. With works as Σ ½(F_{k−1} + F_k)·Δx, and as
`M·a_k = p_k − C·v_k − f_k` holds at every tick for every method, all but the first add up to that of inertia:

    E_drift = ½·vᵀMv + D + W_columns + W_specimen − W_ground − W_damper = ½·vᵀMv − Σ ½(a_{k−1} + a_k)ᵀM·Δx

so no force has to be known. The explicit Newmark method has `Δx = h/2·(v_{k−1} + v_k) − h²/4·(a_k − a_{k−1})`, hence
`E_drift = h²/8·aᵀMa`, which does not accumulate: it is (ωh/2)² of a mode's strain energy, all of it at ωh = 2. Beyond
that limit it grows with the motion, which no energy input explains. Numerical damping counts as energy lost.

Both are divided by the largest energy input of the ground so far, `Σ −z̈·1ᵀMv·h`, plus a floor.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from models.compiled import jit
from models.registry import Array

# places in `fixed`, the masses from MASS on
INTERVAL, RATIO, REPRESENTS, FLOOR, MASS = range(5)

# places in `sums`
ERROR, INERTIA, INPUT, LARGEST_INPUT, LAST_ERROR, LAST_FORCE, ERROR_SHARE, DRIFT_SHARE = range(8)

# rows of `motion`: three that the caller fills at every tick, then displacement and acceleration of the tick before
DISPLACEMENT, VELOCITY, ACCELERATION, LAST_DISPLACEMENT, LAST_ACCELERATION = range(5)


class EnergyBalance(NamedTuple):
    """The balance with its running sums, which `step` updates."""

    fixed: Array
    sums: Array
    motion: Array  # (5, n)
    most: Array  # (2,) limits of the two shares


def build(
    interval: float, ratio: float, represents: float, floor: float, mass: Array, most: Array
) -> EnergyBalance:
    """The balance of a building at rest, masses (n,) kg; `interval` s, `floor` J, limits (2,) of the shares."""
    fixed = np.concatenate([[interval, ratio, represents, floor], mass])
    return EnergyBalance(fixed, np.zeros(8), np.zeros((5, mass.size)), most)


@jit
def enter(
    balance: tuple[Any, ...], ground_acceleration: float, target: float, measured: float, force: float
) -> bool:
    """`step` for a caller outside compiled code, which holds the balance as `compiled.plain` gives it."""
    return step(EnergyBalance(*balance), ground_acceleration, target, measured, force)


@jit
def step(
    balance: EnergyBalance, ground_acceleration: float, target: float, measured: float, force: float
) -> bool:
    """Update the balance by one tick; `motion` holds the building's motion.

    `ground_acceleration` (m/s²), the specimen's `target` and `measured` deformation (m) and its `force` (N) are those
    of the tick. The shares are written into `sums`; returns whether both are within their limits.
    """
    fixed, sums, motion = balance.fixed, balance.sums, balance.motion
    momentum, kinetic = 0.0, 0.0
    for i in range(motion.shape[1]):
        mass, v, x, a = fixed[MASS + i], motion[VELOCITY, i], motion[DISPLACEMENT, i], motion[ACCELERATION, i]
        mean = 0.5 * (a + motion[LAST_ACCELERATION, i])
        sums[INERTIA] += mass * mean * (x - motion[LAST_DISPLACEMENT, i])
        momentum += mass * v
        kinetic += 0.5 * mass * v * v
        motion[LAST_DISPLACEMENT, i] = x
        motion[LAST_ACCELERATION, i] = a
    sums[INPUT] -= ground_acceleration * momentum * fixed[INTERVAL]
    sums[LARGEST_INPUT] = max(sums[LARGEST_INPUT], sums[INPUT])
    error = (measured - target) / fixed[RATIO]
    mean = 0.5 * fixed[REPRESENTS] * (force + sums[LAST_FORCE])
    sums[ERROR] += mean * (error - sums[LAST_ERROR])
    sums[LAST_ERROR], sums[LAST_FORCE] = error, force
    given = fixed[FLOOR] + sums[LARGEST_INPUT]
    sums[ERROR_SHARE] = sums[ERROR] / given
    sums[DRIFT_SHARE] = (kinetic - sums[INERTIA]) / given
    within = abs(sums[ERROR_SHARE]) <= balance.most[0]  # False for NaN
    return within and abs(sums[DRIFT_SHARE]) <= balance.most[1]
