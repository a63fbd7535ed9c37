"""Smooth hysteresis of Bouc and Wen.

    f = α·k·δ + (1 − α)·k·δ_y·z,    dz/dδ = (1 − |z|ⁿ·(γ + β·sgn(z·dδ))) / δ_y

Y. K. Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976), 249-263,
with A = 1 and z made dimensionless by the yield displacement. The bound is
`|z| ≤ (β + γ)^(−1/n)`; with β + γ = 1 the force of the hysteretic part is bounded by `(1 − α)·k·δ_y`.

The equation is autonomous in δ while δ moves one way, so it is integrated over the increment itself, by
the classic Runge-Kutta method of order 4 in substeps short against the equation's steepest slope. Its
right-hand side has a kink at z = 0 for odd and broken n; a substep that would cross it ends there instead.
Close to the bound z_u the distance e = 1 − z/z_u follows Bernoulli's equation,
`de/dδ = −n·e·(1 − (n − 1)·e/2)/(z_u·δ_y)`, whose solution is known: an increment of any size takes a bounded time.

Not to be confused with Bouc-Wen-Baber-Noori, which degrades and pinches; nor with the other convention
in which β and γ carry units of m⁻ⁿ.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from common.plan.schema import Rule
from models.compiled import jit
from models.registry import Array


class BoucWenParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_y, m
    hardening: float = 0.0  # α, stiffness after yielding over elastic stiffness
    n: float = 2.0  # sharpness of yielding
    beta: float = 0.5  # β, with the sign of z·dδ
    gamma: float = 0.5  # γ


RULES = {
    "stiffness": Rule("elastic stiffness", "N/m", least=0.0),
    "yield_displacement": Rule("yield displacement", "m", above=0.0),
    "hardening": Rule("stiffness after yielding over elastic stiffness", above=-1.0, most=1.0),
    "n": Rule("sharpness of yielding", least=1.0, most=1000.0),
    "beta": Rule("share of the loop's width", above=0.0),
    "gamma": Rule("share of the loop's shape"),
}
STIFFNESS, YIELD_DISPLACEMENT, HARDENING, SHARPNESS, BETA, GAMMA = range(6)

DEFORMATION, HYSTERETIC = range(2)  # δ (m) and z of the last call
STATE_SIZE = 2

STEEPNESS = 0.05  # longest substep times the steepest slope: the global error of z is then about 1e-7
CLOSE = 2e-4  # n·e from which on terms of the third order in e are left out: they change z by 1e-12


def fault(p: BoucWenParams) -> str:
    """What is wrong with a combination of parameters that are each in their range; empty where nothing is."""
    if p.beta + p.gamma <= 0.0:
        return f"beta + gamma is {p.beta + p.gamma:g}, but must be above 0, or the force has no bound"
    return ""


@jit
def slope(z: float, n: float, beta: float, gamma: float) -> float:
    """Slope of z over δ/δ_y while δ grows."""
    size = abs(z)
    # a call of pow costs more than the whole of the rest
    power = size if n == 1.0 else size * size if n == 2.0 else size**n
    return 1.0 - power * (gamma + beta if z > 0.0 else gamma - beta)


@jit
def runge_kutta(z: float, h: float, n: float, beta: float, gamma: float) -> float:
    """Change of z over a substep h of δ/δ_y, to order 4."""
    first = slope(z, n, beta, gamma)
    second = slope(z + 0.5 * h * first, n, beta, gamma)
    third = slope(z + 0.5 * h * second, n, beta, gamma)
    fourth = slope(z + h * third, n, beta, gamma)
    return h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)


@jit
def way_to_zero(z: float, n: float, beta: float, gamma: float) -> float:
    """How far δ/δ_y must grow until z < 0 is zero: Simpson's rule on `∫ dz/slope`, for short ways."""
    ends = 1.0 / slope(z, n, beta, gamma) + 1.0
    return -z / 6.0 * (ends + 4.0 / slope(0.5 * z, n, beta, gamma))


@jit
def approached(z: float, bound: float, way: float, n: float) -> float:
    """Z after δ/δ_y has grown by `way`, from close to its bound."""
    missing, bent = 1.0 - z / bound, 0.5 * (n - 1.0)
    if missing == 0.0:
        return z
    return bound * (1.0 - 1.0 / ((1.0 / missing - bent) * math.exp(n * way / bound) + bent))


@jit
def advance(z: float, way: float, n: float, beta: float, gamma: float) -> float:
    """Z after δ/δ_y has grown by `way` ≥ 0."""
    total = beta + gamma
    longest = STEEPNESS / (n * max(1.0, total) * max(1.0, abs(gamma - beta) / total))
    bound = total ** (-1.0 / n)
    while way > 0.0:
        if n * abs(1.0 - z / bound) < CLOSE:
            return approached(z, bound, way, n)
        h = min(way, longest)
        change = runge_kutta(z, h, n, beta, gamma)
        if z < 0.0 < z + change:
            h = min(way_to_zero(z, n, beta, gamma), h)
            change = -z
        z += change
        way -= h
    return z


@jit
def step(p: Array, s: Array, deformation: float) -> float:
    """Force (N) at a deformation (m) reached from that of the last call; `s` (2,) moves on."""
    way = (deformation - s[DEFORMATION]) / p[YIELD_DISPLACEMENT]
    # a deformation that shrinks is one that grows, seen in the mirror
    sign = 1.0 if way >= 0.0 else -1.0
    z = sign * advance(sign * s[HYSTERETIC], abs(way), p[SHARPNESS], p[BETA], p[GAMMA])
    s[DEFORMATION] = deformation
    s[HYSTERETIC] = z
    plastic = (1.0 - p[HARDENING]) * p[YIELD_DISPLACEMENT] * z
    force: float = p[STIFFNESS] * (p[HARDENING] * deformation + plastic)
    return force
