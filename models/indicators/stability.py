"""The critical delay of a partition, and the stability indicator that follows from it."""

from __future__ import annotations

import math

import numpy as np

from common.errors import InputError
from models.registry import Array

ON_AXIS = 1e-6  # largest real part over size of an eigenvalue on the imaginary axis: rounding of a nearly double one
STILL = 1e-9  # growth rate, frequency (both over the highest one) and angle (rad) that count as zero: above rounding


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
    the specimen. With `G = eᵀ·D⁻¹·e·(k + c·s + m·s²)` only frequencies of `|G(jω)| = 1` can do so. Zero
    where the specimen's mass outweighs the numerical part's.

    Raises:
        InputError: shapes do not fit, a value is not finite, M is singular, or the undelayed loop is unstable.

    Source: Maghareh, Dyke, Prakash and Rhoads, Establishing a predictive performance indicator for real-time
    hybrid simulation, Earthq. Eng. Struct. Dyn. 43 (2014).
    """
    shaped(M, C, K, direction, stiffness, damping, mass)
    outer = np.outer(direction, direction)
    whole = K + stiffness * outer
    unit = math.sqrt(float(np.max(np.abs(np.linalg.eigvals(np.linalg.solve(M, whole))))))
    undelayed = companion(M + mass * outer, C + damping * outer, whole, unit)
    if np.any(np.linalg.eigvals(undelayed).real > STILL):
        raise InputError("The loop is unstable without any delay.")
    if mass * float(direction @ np.linalg.solve(M, direction)) >= 1.0:
        return (
            0.0  # the specimen's inertia outweighs the numerical one: any delay feeds the highest frequencies
        )
    specimen = (stiffness, damping, mass)
    delays = [
        delay_at(M, C, K, direction, specimen, x * unit)
        for x in crossings(M, C, K, direction, specimen, unit)
    ]
    return min(delays, default=math.inf)


def shaped(M: Array, C: Array, K: Array, direction: Array, *specimen: float) -> None:
    """Raise InputError where shapes do not fit, a value is not finite, or M is singular."""
    n = M.shape[0]
    for name, value in {"M": M, "C": C, "K": K}.items():
        if value.shape != (n, n) or not np.all(np.isfinite(value)):
            raise InputError(f"{name} of the numerical part must be {n} by {n} finite numbers.")
    if direction.shape != (n,) or not np.all(np.isfinite([*direction, *specimen])):
        raise InputError(f"The direction must be {n} finite numbers, and the specimen's parameters finite.")
    if np.linalg.matrix_rank(M) < n:
        raise InputError("The numerical mass matrix is singular: give every degree of freedom a mass.")


def companion(M: Array, C: Array, K: Array, unit: float) -> Array:
    """State matrix (2n, 2n) of `M·ẍ + C·ẋ + K·x = 0` in displacements and velocities, time in units of 1/`unit`."""
    n = M.shape[0]
    lower = np.hstack([-np.linalg.solve(M, K) / unit**2, -np.linalg.solve(M, C) / unit])
    return np.vstack([np.eye(n, 2 * n, k=n), lower])


def crossings(
    M: Array, C: Array, K: Array, direction: Array, specimen: tuple[float, float, float], unit: float
) -> list[float]:
    """Frequencies (over `unit`) at which `|G(jω)| = 1`: imaginary eigenvalues of the Hamiltonian of `1 − |G|²`.

    Boyd, Balakrishnan and Kabamba, A bisection method for computing the H∞ norm of a transfer matrix,
    Math. Control Signals Systems 2 (1989).
    """
    n = M.shape[0]
    stiffness, damping, mass = specimen
    A = companion(M, C, K, unit)
    b = np.concatenate([np.zeros(n), np.linalg.solve(M, direction)]) / unit**2
    row = np.concatenate([stiffness * direction, damping * unit * direction])
    row = row + mass * unit**2 * (direction @ A[n:])
    through = float(mass * unit**2 * (direction @ b[n:]))
    rest = 1.0 - through**2
    size = math.sqrt(float(np.linalg.norm(row) / np.linalg.norm(b)))  # equal sizes keep the matrix balanced
    if size == 0.0:
        return []
    b, row = b * size, row / size
    left = A + np.outer(b, row) * through / rest
    hamiltonian = np.block([[left, np.outer(b, b) / rest], [-np.outer(row, row) / rest, -left.T]])
    values: list[complex] = np.linalg.eigvals(hamiltonian).tolist()
    return sorted(
        value.imag
        for value in values
        if value.imag > STILL and abs(value.real) <= ON_AXIS * max(1.0, abs(value))
    )


def delay_at(
    M: Array, C: Array, K: Array, direction: Array, specimen: tuple[float, float, float], omega: float
) -> float:
    """Smallest positive delay (s) for which `1 + G·e^(−jωτ) = 0` at a crossing (rad/s)."""
    stiffness, damping, mass = specimen
    dynamic = K - omega**2 * M + 1j * omega * C
    gain = (direction @ np.linalg.solve(dynamic, direction)) * (
        stiffness - omega**2 * mass + 1j * omega * damping
    )
    turn = float(np.angle(-gain)) % (2.0 * math.pi)
    return (turn if turn > STILL else 2.0 * math.pi) / omega


def predictive_stability_indicator(critical: float) -> float:
    """`log10` of the critical delay in ms (Maghareh et al. 2014); inf where none is critical, −inf where any is."""
    if critical <= 0.0:
        return -math.inf
    return math.log10(critical * 1e3) if math.isfinite(critical) else math.inf


def sensitivity(indicator: float) -> str:
    """The sensitivity of a partition to delay by that indicator: slightly, moderately or extremely.

    The classes are those of Maghareh et al. (2014): critical delays above 5 ms, 1 to 5 ms, and below 1 ms.
    """
    if indicator > 0.7:
        return "slightly"
    return "moderately" if indicator >= 0.0 else "extremely"
