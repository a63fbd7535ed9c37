"""Smooth hysteresis of Bouc, Wen, Baber and Noori, which degrades and pinches.

    f = α·k·δ + (1 − α)·k·δ_y·z,    dz/dδ = h·(1 − ν·|z|ⁿ·(γ + β·sgn(z·dδ))) / (η·δ_y)
    ε = (1 − α)·∫ z dδ/δ_y,    ν = 1 + δ_ν·ε,    η = 1 + δ_η·ε
    h = 1 − ζ₁·exp(−(z·sgn(dδ) − q·z_u)²/ζ₂²),    z_u = (ν·(β + γ))^(−1/n)
    ζ₁ = ζ_s·(1 − exp(−p·ε)),    ζ₂ = (ψ + δ_ψ·ε)·(λ + ζ₁)

T. T. Baber and M. N. Noori, Random vibration of degrading, pinching systems, J. Eng. Mech. ASCE 111 (1985),
1010-1026, with the pinching of G. C. Foliente, Hysteresis modeling of wood joints and structural systems,
J. Struct. Eng. ASCE 121 (1995), 1013-1022; A = 1, and z and ε made dimensionless by the yield displacement.
ε is the hysteretic spring's work over k·δ_y², what it still stores included.

z and ε are integrated together over δ by the classic Runge-Kutta method of order 4 in substeps short against
the steepest slope; a substep that would cross the kink at z = 0 ends there instead. Of an increment longer
than `MOST` substeps the rest is covered at once on the bound z = z_u, where ν has a closed form: any
increment takes a bounded time.

Not to be confused with `bouc_wen`, which this is with δ_ν = δ_η = ζ_s = 0; nor with the convention where ε
is in joules and the rates in 1/J, as in OpenSees's BWBN, which also has its own law of pinching.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from common.plan.schema import Rule
from models.compiled import jit
from models.registry import Array


class BwbnParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_y, m
    hardening: float = 0.0  # α, stiffness after yielding over elastic stiffness
    n: float = 2.0  # sharpness of yielding
    beta: float = 0.5  # β, with the sign of z·dδ
    gamma: float = 0.5  # γ
    delta_nu: float = 0.01  # δ_ν, loss of strength per energy
    delta_eta: float = 0.02  # δ_η, loss of stiffness per energy
    zeta_s: float = 0.5  # ζ_s, depth of pinching at last
    q: float = 0.1  # where pinching is deepest, over z_u
    p: float = 0.1  # rate at which pinching sets in
    psi: float = 0.3  # ψ, width of pinching
    delta_psi: float = 0.005  # δ_ψ, its growth per energy
    lambda_: float = 0.5  # λ, width over depth of pinching


RULES = {
    "stiffness": Rule("elastic stiffness", "N/m", least=0.0),
    "yield_displacement": Rule("yield displacement", "m", above=0.0),
    "hardening": Rule("stiffness after yielding over elastic stiffness", above=-1.0, most=1.0),
    "n": Rule("sharpness of yielding", least=1.0, most=1000.0),
    "beta": Rule("share of the loop's width", above=0.0),
    "gamma": Rule("share of the loop's shape"),
    "delta_nu": Rule("loss of strength per energy", least=0.0),
    "delta_eta": Rule("loss of stiffness per energy", least=0.0),
    "zeta_s": Rule("depth of pinching at last", least=0.0, most=0.99),
    "q": Rule("where pinching is deepest, over the bound of z", least=-1.0, most=1.0),
    "p": Rule("rate at which pinching sets in", least=0.0),
    "psi": Rule("width of pinching", above=0.0),
    "delta_psi": Rule("growth of the width of pinching", least=0.0),
    "lambda_": Rule("width over depth of pinching", above=0.0),
}
STIFFNESS, YIELD_DISPLACEMENT, HARDENING, SHARPNESS, BETA, GAMMA = range(6)
DELTA_NU, DELTA_ETA, ZETA_S, Q, RATE, PSI, DELTA_PSI, LAMBDA = range(6, 14)

DEFORMATION, HYSTERETIC, ENERGY = range(3)  # δ (m), z and ε of the last call
STATE_SIZE = 3

STEEPNESS = 0.05  # longest substep times the steepest slope: the global error of z is then about 1e-7
MOST = 4000  # substeps of one increment at most: they take 0.9 ms and cover some hundred yield displacements


def fault(p: BwbnParams) -> str:
    """What is wrong with a combination of parameters that are each in their range; empty where nothing is."""
    if p.beta + p.gamma <= 0.0:
        return f"beta + gamma is {p.beta + p.gamma:g}, but must be above 0, or the force has no bound"
    return ""


@jit
def pinching(p: Array, z: float, energy: float, nu: float) -> float:
    """The factor h of pinching on the slope of z while δ grows."""
    depth = p[ZETA_S] * (1.0 - math.exp(-p[RATE] * energy))
    if depth == 0.0:
        return 1.0
    width = (p[PSI] + p[DELTA_PSI] * energy) * (p[LAMBDA] + depth)
    bound = (nu * (p[BETA] + p[GAMMA])) ** (-1.0 / p[SHARPNESS])
    return 1.0 - depth * math.exp(-(((z - p[Q] * bound) / width) ** 2))


@jit
def slope(p: Array, z: float, energy: float) -> float:
    """Slope of z over δ/δ_y while δ grows."""
    # work stored and given back may leave the sum a rounding below zero
    energy = max(energy, 0.0)
    n = p[SHARPNESS]
    nu = 1.0 + p[DELTA_NU] * energy
    size = abs(z)
    power = size if n == 1.0 else size * size if n == 2.0 else size**n
    flow = 1.0 - nu * power * (p[GAMMA] + p[BETA] if z > 0.0 else p[GAMMA] - p[BETA])
    return flow * pinching(p, z, energy, nu) / (1.0 + p[DELTA_ETA] * energy)


@jit
def runge_kutta(p: Array, z: float, energy: float, h: float) -> tuple[float, float]:
    """Change of z, and of ε, over a substep h of δ/δ_y, to order 4; the slope of ε is share·z."""
    share = 1.0 - p[HARDENING]
    k1 = slope(p, z, energy)
    z2 = z + 0.5 * h * k1
    k2 = slope(p, z2, energy + 0.5 * h * share * z)
    z3 = z + 0.5 * h * k2
    k3 = slope(p, z3, energy + 0.5 * h * share * z2)
    z4 = z + h * k3
    k4 = slope(p, z4, energy + h * share * z3)
    change = h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return change, share * h / 6.0 * (z + 2.0 * z2 + 2.0 * z3 + z4)


@jit
def longest(p: Array, energy: float) -> float:
    """Longest substep of δ/δ_y."""
    energy = max(energy, 0.0)
    total = p[BETA] + p[GAMMA]
    nu = 1.0 + p[DELTA_NU] * energy
    steepest = p[SHARPNESS] * max(1.0, nu * total) * max(1.0, abs(p[GAMMA] - p[BETA]) / total)
    depth = p[ZETA_S] * (1.0 - math.exp(-p[RATE] * energy))
    steepest += 2.0 * depth / ((p[PSI] + p[DELTA_PSI] * energy) * (p[LAMBDA] + depth))
    return STEEPNESS / steepest * (1.0 + p[DELTA_ETA] * energy)


@jit
def slide(p: Array, energy: float, way: float) -> tuple[float, float]:
    """Z and ε after `way` on the bound: `dν/dx = δ_ν·share·(ν·(β + γ))^(−1/n)`."""
    energy = max(energy, 0.0)
    share, total, power = 1.0 - p[HARDENING], p[BETA] + p[GAMMA], 1.0 / p[SHARPNESS]
    nu = 1.0 + p[DELTA_NU] * energy
    if p[DELTA_NU] > 0.0:
        rate = (1.0 + power) * p[DELTA_NU] * share * total**-power
        nu = (nu ** (1.0 + power) + rate * way) ** (1.0 / (1.0 + power))
        energy = (nu - 1.0) / p[DELTA_NU]
    else:
        energy += share * total**-power * way
    return (nu * total) ** -power, energy


@jit
def advance(p: Array, z: float, energy: float, way: float) -> tuple[float, float]:
    """Z and ε after δ/δ_y has grown by `way` ≥ 0."""
    for _ in range(MOST):
        if not way > 0.0:
            return z + way, energy
        h = min(way, longest(p, energy))
        change, work = runge_kutta(p, z, energy, h)
        if z < 0.0 < z + change:
            # secant steps on the length of the substep, until it ends at zero
            for _ in range(4):
                h *= -z / change
                change, work = runge_kutta(p, z, energy, h)
            change = -z
        z += change
        energy += work
        way -= h
    return slide(p, energy, max(way, 0.0))


@jit
def step(p: Array, s: Array, deformation: float) -> float:
    """Force (N) at a deformation (m) reached from that of the last call; `s` (3,) moves on."""
    way = (deformation - s[DEFORMATION]) / p[YIELD_DISPLACEMENT]
    # a deformation that shrinks is one that grows, seen in the mirror
    sign = 1.0 if way >= 0.0 else -1.0
    z, energy = advance(p, sign * s[HYSTERETIC], s[ENERGY], abs(way))
    z *= sign
    s[DEFORMATION] = deformation
    s[HYSTERETIC] = z
    s[ENERGY] = energy
    plastic = (1.0 - p[HARDENING]) * p[YIELD_DISPLACEMENT] * z
    force: float = p[STIFFNESS] * (p[HARDENING] * deformation + plastic)
    return force
