"""How much delay a partition bears."""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial import Polynomial

from common.errors import InputError
from models.registry import Array

ON_AXIS = 1e-4  # imaginary part of a root over its size up to which it counts as real
SAME = 1e-9  # delays below this share of a period count as none


def critical_delay(
    M: Array,
    C: Array,
    K: Array,
    direction: Array,
    stiffness: float,
    damping: float = 0.0,
    mass: float = 0.0,
) -> float:
    """Smallest delay (s) of the experimental force at which the loop vibrates undamped; inf where there is none.

    `det[M·s² + C·s + K + e·eᵀ·(m·s² + c·s + k)·e^(−s·τ)] = 0` on `s = jω`. M, C, K (n, n) of the numerical
    part in kg, N·s/m, N/m; `direction` e (n,) takes displacements to the specimen's; k N/m, c N·s/m, m kg of
    the specimen. With `G = eᵀ·D⁻¹·e·(k + c·s + m·s²)` the crossings are the roots of `|G(jω)| = 1`, a
    polynomial in ω².

    Raises:
        InputError: M is singular, or the undelayed loop is unstable.

    Source: Maghareh, Dyke, Prakash and Rhoads, Establishing a predictive performance indicator for real-time
    hybrid simulation, Earthq. Eng. Struct. Dyn. 43 (2014).
    """
    if np.linalg.matrix_rank(M) < M.shape[0]:
        raise InputError("The numerical mass matrix is singular: give every degree of freedom a mass.")
    outer = np.outer(direction, direction)
    unit = math.sqrt(float(np.max(np.abs(np.linalg.eigvals(np.linalg.solve(M, K + stiffness * outer))))))
    whole = determinant(M + mass * outer, C + damping * outer, K + stiffness * outer, unit)
    if np.any(whole.roots().real > 1e-9):
        raise InputError("The loop is unstable without any delay.")
    below = determinant(M, C, K, unit)
    scale = float(np.max(np.abs(K))) or stiffness
    difference = determinant(M, C, K + scale * outer, unit) - below
    lower = difference.coef[: below.degree() - 1]  # what is above cancels but for rounding
    above = Polynomial(lower) * (1.0 / scale)
    above *= Polynomial([stiffness, damping * unit, mass * unit**2])
    delays = [delay_at(above, below, x) / unit for x in crossings(above, below)]
    return min(delays, default=math.inf)


def determinant(M: Array, C: Array, K: Array, unit: float) -> Polynomial:
    """`det(M·s² + C·s + K)` as a polynomial of s over `unit` (rad/s)."""
    n = M.shape[0]
    inverse = np.linalg.inv(M)
    companion = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K / unit**2, -inverse @ C / unit]])
    coefficients = np.poly(companion)[::-1].real * np.linalg.det(M)
    return Polynomial(coefficients * unit ** (2 * n))


def crossings(above: Polynomial, below: Polynomial) -> list[float]:
    """Frequencies (over the unit) at which numerator and denominator are of one size on the imaginary axis."""
    difference = size_squared(above) - size_squared(below)
    roots: list[complex] = difference.roots().tolist()
    return sorted(
        math.sqrt(root.real) for root in roots if root.real > 0.0 and abs(root.imag) <= ON_AXIS * abs(root)
    )


def size_squared(p: Polynomial) -> Polynomial:
    """`|p(jx)|²` as a polynomial of x²."""
    even = Polynomial([value * (-1) ** k for k, value in enumerate(p.coef[0::2])])
    odd = Polynomial([value * (-1) ** k for k, value in enumerate(p.coef[1::2])] or [0.0])
    return even**2 + Polynomial([0.0, 1.0]) * odd**2


def delay_at(above: Polynomial, below: Polynomial, x: float) -> float:
    """Smallest positive delay (over the unit's inverse) for which `1 + G·e^(−jxτ) = 0` at a crossing."""
    turn = float(np.angle(-above(1j * x) / below(1j * x))) % (2.0 * math.pi)
    return (turn if turn > SAME else 2.0 * math.pi) / x


def predictive_stability_indicator(critical: float) -> float:
    """`log10` of the critical delay in ms (Maghareh et al. 2014); inf where no delay is critical."""
    return math.log10(critical * 1e3) if math.isfinite(critical) else math.inf


def sensitivity(indicator: float) -> str:
    """How sensitive a partition with that indicator is to delay: slightly, moderately or extremely."""
    if indicator > 0.7:
        return "slightly"
    return "moderately" if indicator >= 0.0 else "extremely"
