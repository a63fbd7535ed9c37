"""The column of the independent laboratory A: the force at the load cell under a deformation."""

from __future__ import annotations

import math
from typing import NamedTuple

from validation.blind.labs.parts import friction, yielding
from validation.blind.labs.parts.compiled import Array, jit

LINEAR, EXPONENTIAL = 1, 2  # formulas of the degradation
LORENTZ, SECH = 1, 2  # formulas of the pinching
BY_POWER, MAXWELL = 1, 2  # formulas of the rate-dependent force
# Deformations (m) of the damage, within the peaks of the trial's columns: nothing is lost up to the first; the linear
# loss is complete at the second beyond it; the third is the scale of the exponential loss.
UNDAMAGED, DESTROYED, DAMAGE = 0.5e-3, 4e-3, 1e-3
HARDENED_AT = 2e-3  # m, deformation at which a column has hardened by what is stated
# m/s; the column moves at up to 0.1 m/s, so that friction is Coulomb's but near a reversal.
RUBBING = 0.5e-3  # scale of the regularised friction
STICKING = 1e-3  # scale of the Stribeck effect
# S, damping of the bristles over Coulomb friction, times their presliding: damped within a fraction of an interval.
MICRO = 0.5e-3
POWER = 0.8  # exponent of the rate-dependent force; fluid dampers have 0.3 to 1 (Soong and Dargush)
POWER_AT = 0.02  # m/s, at which it equals the linear force: a usual speed of the default test's column
RELAXATION = 0.03  # s, time constant of the spring and dashpot in series, within a cycle of the default test

# places in `memory`, behind those of the yielding
LARGEST, BRISTLE, RELAXING, DEFORMATION, VELOCITY = range(yielding.SIZE, yielding.SIZE + 5)
SIZE = yielding.SIZE + 5


class TrueSpecimen(NamedTuple):
    """True parameters of the column; zero means that the effect is absent."""

    stiffness: float  # N/m
    yielding: float = 0.0  # formula
    yield_displacement: float = 1.0  # m
    hardening: float = 0.05
    sharpness: float = 2.0
    degrading: float = 0.0  # formula
    degradation: float = 0.0
    pinching: float = 0.0  # formula
    pinched: float = 0.0
    pinched_hardening: float = 0.0
    pinched_width: float = 1e-3  # m
    rubbing: float = 0.0  # formula
    friction: float = 0.0  # N
    presliding: float = 1e-5  # m
    damping: float = 0.0  # formula
    viscous: float = 0.0  # N·s/m
    inertia: float = 0.0  # kg
    slip: float = 0.0  # m
    hardened: float = 0.0  # stiffness gained at HARDENED_AT over k, by the first term of its series
    asymmetry: float = 0.0


@jit
def slipped(deformation: float, gap: float) -> float:
    """Effective deformation behind a rounded gap: `δ − g/2·tanh(2δ/g)`, g the whole gap."""
    if gap <= 0.0:
        return deformation
    return deformation - 0.5 * gap * math.tanh(2.0 * deformation / gap)


@jit
def left_over(formula: float, rate: float, largest: float) -> float:
    """Share of the stiffness left after a largest deformation (m); up to a threshold all of it.

        linear:        1 − rate·(δ_max − 0.5 mm)/4 mm, rate at most
        exponential:   1 − rate·(1 − exp(−(δ_max − 0.5 mm)/1 mm))

    Scalar damage as in J. Lemaitre, A Course on Damage Mechanics, Springer 1996.
    """
    beyond = max(largest - UNDAMAGED, 0.0)
    if formula == LINEAR:
        return 1.0 - rate * min(beyond / DESTROYED, 1.0)
    if formula == EXPONENTIAL:
        return 1.0 - rate * (1.0 - math.exp(-beyond / DAMAGE))
    return 1.0


@jit
def pinch(formula: float, factor: float, hardening: float, width: float, x: float) -> float:
    """Share of the force while cracks close: `1 − p·w + h·(1 − w)` with one of two windows w.

    lorentz: w = 1/(1 + (δ/δ_w)²);   sech: w = 1/cosh(δ/δ_w)
    """
    if formula == LORENTZ:
        window = 1.0 / (1.0 + (x / width) ** 2)
    elif formula == SECH:
        window = 1.0 / math.cosh(min(abs(x) / width, 300.0))
    else:
        return 1.0
    return 1.0 - factor * window + hardening * (1.0 - window)


@jit
def stiffer(share: float, x: float) -> float:
    """Force over stiffness (m) that hardening adds: `6·share·s·(sinh(δ/s) − δ/s)` with s = 2 mm."""
    if share == 0.0:
        return 0.0
    y = min(max(x / HARDENED_AT, -20.0), 20.0)
    return 6.0 * share * HARDENED_AT * (math.sinh(y) - y)


@jit
def maxwell(force: float, stiffness: float, relaxation: float, moved: float, step: float) -> float:
    """Force of spring and dashpot in series after a move at constant speed: `ḟ = k_m·δ̇ − f/τ`, exact."""
    fade = math.exp(-step / relaxation)
    return fade * force + stiffness * moved * (relaxation / step) * (1.0 - fade)


@jit
def power_law(coefficient: float, velocity: float) -> float:
    """Rate-dependent force `c·v0·sgn(v)·|v/v0|^0.8`, equal to c·v at v0 = 20 mm/s.

    T. T. Soong, G. F. Dargush, Passive Energy Dissipation Systems in Structural Engineering, Wiley 1997.
    """
    size = (abs(velocity) / POWER_AT) ** POWER
    return math.copysign(coefficient * POWER_AT * size, velocity)


@jit
def rub(p: TrueSpecimen, memory: Array, moved: float, velocity: float) -> float:
    """Friction (N) of the set-up after a move."""
    memory[BRISTLE] = friction.after(p.rubbing, memory[BRISTLE], moved, velocity, p.presliding, STICKING)
    scale = RUBBING if p.rubbing == friction.TANH else STICKING
    micro = MICRO * p.presliding / 1e-5
    return p.friction * friction.share(p.rubbing, memory[BRISTLE], velocity, p.presliding, scale, micro)


@jit
def restoring(p: TrueSpecimen, memory: Array, x: float) -> float:
    """Force (N) of the column itself at a deformation (m) behind the fixture's slip."""
    result = yielding.force(
        p.yielding, memory, p.stiffness, p.yield_displacement, p.hardening, p.sharpness, x
    )
    memory[LARGEST] = max(memory[LARGEST], abs(x))
    result *= left_over(p.degrading, p.degradation, memory[LARGEST])
    result *= pinch(p.pinching, p.pinched, p.pinched_hardening, p.pinched_width, x)
    return result + stiffer(p.hardened, x) * p.stiffness + p.asymmetry * p.stiffness * abs(x)


@jit
def force(p: TrueSpecimen, memory: Array, deformation: float, step: float) -> tuple[float, float]:
    """Force on the piston and reading of the load cell (N) at a deformation (m) one step later.

    The fixture's mass is between the two.
    """
    inside = slipped(deformation, p.slip)
    moved = deformation - memory[DEFORMATION]
    velocity = moved / step
    result = restoring(p, memory, inside)
    if p.friction > 0.0:
        result += rub(p, memory, moved, velocity)
    if p.damping == MAXWELL:
        memory[RELAXING] = maxwell(memory[RELAXING], p.viscous / RELAXATION, RELAXATION, moved, step)
        result += memory[RELAXING]
    elif p.viscous != 0.0:
        result += power_law(p.viscous, velocity)
    reading = result + p.inertia * (velocity - memory[VELOCITY]) / step
    memory[DEFORMATION] = deformation
    memory[VELOCITY] = velocity
    return result, reading
