"""The critical delay of the forces of specimens in several storeys, all with the same delay."""

from __future__ import annotations

import math

import numpy as np

from common.errors import InputError
from models.indicators.stability import STILL, companion, shaped
from models.registry import Array

PER_DECADE = (
    400  # frequencies searched per decade, steps of 0.6 %; resonances are searched more finely by `BESIDE`
)
# Factors on the lowest and the highest natural frequency of whole and numerical part: below and above that range the
# stiffness or the mass dominates, and |G| no longer crosses 1.
REACH = (1e-3, 10.0)
BESIDE = np.linspace(
    -4.0, 4.0, 81
)  # searched offsets from a resonance in half widths, with a tenth of one per step


def critical_delay(M: Array, C: Array, K: Array, directions: Array, specimens: Array) -> float:
    """Smallest delay (s) of all experimental forces at which the loop vibrates undamped; inf where there is none.

    `det[M·s² + C·s + K + Eᵀ·diag(m·s² + c·s + k)·E·e^(−s·τ)] = 0` on `s = jω`. M, C, K (n, n) of the numerical part
    in kg, N·s/m, N/m; `directions` E (r, n) take displacements to the specimens'; `specimens` (r, 3) are k N/m, c
    N·s/m, m kg. With `G = E·D⁻¹·Eᵀ·diag(k + c·s + m·s²)` that requires an eigenvalue of G(jω) with the modulus 1.
    Zero where the specimens' mass outweighs the numerical part's.

    Raises:
        InputError: shapes do not fit, a value is not finite, M is singular, or the undelayed loop is unstable.
    """
    from scipy.optimize import (
        brentq,
    )  # half a second of every command that only plans of several specimens need

    for direction, specimen in zip(directions, specimens, strict=True):
        shaped(M, C, K, direction, *specimen)
    k, c, m = (directions.T @ np.diag(of) @ directions for of in specimens.T)
    unit = math.sqrt(float(np.max(np.abs(np.linalg.eigvals(np.linalg.solve(M, K + k))))))
    if np.any(np.linalg.eigvals(companion(M + m, C + c, K + k, unit)).real > STILL):
        raise InputError("The loop is unstable without any delay.")
    if np.max(np.abs(np.linalg.eigvals(np.linalg.solve(M, m)))) >= 1.0:
        return 0.0

    def gains(omega: float) -> Array:
        """The eigenvalues of G(jω), by their modulus."""
        dynamic = K - omega**2 * M + 1j * omega * C
        specimen = specimens[:, 0] - omega**2 * specimens[:, 2] + 1j * omega * specimens[:, 1]
        found = np.linalg.eigvals(directions @ np.linalg.solve(dynamic, directions.T) * specimen)
        return np.asarray(sorted(found, key=abs))

    searched = frequencies(M, C, (K, K + k))
    excess = np.array([np.abs(gains(omega)) - 1.0 for omega in searched.tolist()])
    delays = []
    for place, turn in np.argwhere(excess[:-1] * excess[1:] < 0.0).tolist():
        low, high = searched[place], searched[place + 1]
        omega = brentq(lambda at, turn=turn: abs(gains(at)[turn]) - 1.0, low, high)
        angle = float(np.angle(-gains(omega)[turn])) % (2.0 * math.pi)
        delays.append((angle if angle > STILL else 2.0 * math.pi) / omega)
    return min(delays, default=math.inf)


def frequencies(M: Array, C: Array, stiffnesses: tuple[Array, ...]) -> Array:
    """The frequencies (rad/s) to be searched, ascending: over the range of all modes, and densely around each."""
    n = M.shape[0]
    modes = np.concatenate([np.linalg.eigvals(companion(M, C, K, 1.0)) for K in stiffnesses])
    sizes = np.abs(modes)
    low, high = REACH[0] * float(sizes[sizes > STILL * sizes.max()].min()), REACH[1] * float(sizes.max())
    wide = np.geomspace(low, high, round(PER_DECADE * math.log10(high / low)) + 2 * n)
    near = [abs(mode.imag) + BESIDE * max(abs(mode.real), STILL * abs(mode)) for mode in modes.tolist()]
    found = np.unique(np.concatenate([wide, *near]))
    return found[(found >= low) & (found <= high)]
