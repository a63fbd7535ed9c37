"""Shear building: rigid floors, one horizontal displacement each, storeys as springs and dashpots between.

Floor 0 is the lowest that moves; storey i stands below floor i. A. K. Chopra, Dynamics of Structures
(4th ed. 2012), chapters 9 and 10.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from models.compiled import jit
from models.registry import Array


class Modes(NamedTuple):
    """Undamped modes, the longest period first."""

    periods: Array  # (n,) s
    damping_ratios: Array  # (n,)
    shapes: Array  # (n, n): column j is mode j, with modal mass 1 kg


def matrices(mass: Array, stiffness: Array, damping: Array) -> tuple[Array, Array, Array]:
    """Mass (kg, diagonal), damping (N·s/m) and stiffness (N/m, both tridiagonal), in this order, (n, n) each.

    The arguments hold one value per storey, (n,): floor masses kg, storey stiffnesses N/m, dashpots N·s/m.

    Raises:
        InputError: their lengths differ or are zero, a mass is not positive, or a value is negative.
    """
    rows = {"mass": mass, "stiffness": stiffness, "damping": damping}
    for name, row in rows.items():
        if row.ndim != 1 or row.size != mass.size or row.size == 0:
            raise InputError(f"{name} has the shape {row.shape}: give one value per storey, as for mass.")
        if not np.isfinite(row).all() or (row < 0.0).any():
            raise InputError(f"{name} is {row.tolist()}, but must be finite and not negative.")
    if (mass == 0.0).any():
        raise InputError(f"mass is {mass.tolist()}, but must be above 0 kg on every floor.")
    return np.diag(mass).astype(np.float64), tridiagonal(damping), tridiagonal(stiffness)


def tridiagonal(storeys: Array) -> Array:
    """Matrix (n, n) of one value per storey, each acting on the drift between two floors."""
    above = np.append(storeys[1:], 0.0)
    return np.diag(storeys + above) - np.diag(storeys[1:], 1) - np.diag(storeys[1:], -1)


def modal_damping(M: Array, K: Array, ratio: float) -> Array:
    """Damping matrix (n, n) N·s/m that gives every mode of M (kg) and K (N/m) the same damping ratio.

    `C = M·Φ·diag(2ζω)·Φᵀ·M` with Φ of modal mass 1 (Chopra, section 11.4.2).
    """
    found = modes(M, np.zeros_like(M), K)
    weighted = M @ found.shapes
    C: Array = (weighted * (4.0 * math.pi * ratio / found.periods)) @ weighted.T
    return C


@jit
def storey_drift(x: Array, i: int) -> float:
    """Drift (m) of storey i from the floors' displacements `x` (n,); velocities give its rate."""
    drift: float = x[i] if i == 0 else x[i] - x[i - 1]
    return drift


@jit
def add_nodal(storey_force: float, i: int, out: Array) -> None:
    """Add storey i's restoring force (N) to the floors' `out` (n,): +F on floor i, −F on the one below."""
    out[i] += storey_force
    if i > 0:
        out[i - 1] -= storey_force


def modes(M: Array, C: Array, K: Array) -> Modes:
    """Periods, damping ratios and shapes of matrices (n, n) in kg, N·s/m and N/m; rigid modes last inf.

    The damping ratio is the share of C on the modal diagonal, `φᵀCφ/(2ω)`: exact where the modes decouple
    C, else the usual estimate. For a rigid mode it is nan.
    """
    root = np.linalg.inv(np.linalg.cholesky(M))
    eigenvalues, vectors = np.linalg.eigh(root @ K @ root.T)
    shapes = root.T @ vectors
    rounding = np.finfo(np.float64).eps * M.shape[0] * float(np.max(np.abs(eigenvalues), initial=0.0))
    omega = np.sqrt(np.where(eigenvalues > rounding, eigenvalues, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        periods = 2.0 * math.pi / omega
        ratios = np.where(omega > 0.0, np.diag(shapes.T @ C @ shapes) / (2.0 * omega), math.nan)
    return Modes(periods, ratios, shapes)
