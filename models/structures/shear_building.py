"""Shear building: one mass per floor, one spring and one dashpot per storey, from the bottom."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from models.compiled import jit
from models.registry import Array


def matrices(mass: Array, stiffness: Array, damping: Array) -> tuple[Array, Array, Array]:
    """Mass (kg), damping (N·s/m) and stiffness (N/m) matrix from one value per storey; shape (n, n) each."""
    return np.diag(mass), coupled(damping), coupled(stiffness)


def coupled(values: Array) -> Array:
    """Matrix of storey elements in series: each acts on its floor and, the other way, on the one below."""
    above = np.append(values[1:], 0.0)
    return np.diag(values + above) - np.diag(values[1:], 1) - np.diag(values[1:], -1)


def modes(M: Array, C: Array, K: Array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Natural periods (s), longest first, and damping ratios as the diagonal of the modal damping gives them."""
    squares, shapes = np.linalg.eig(np.linalg.solve(M, K))
    order = np.argsort(squares.real)
    omega, shapes = np.sqrt(squares.real[order]), shapes.real[:, order]
    modal_mass = np.einsum("ij,ik,kj->j", shapes, M, shapes)
    modal_damping = np.einsum("ij,ik,kj->j", shapes, C, shapes)
    return 2.0 * np.pi / omega, modal_damping / (2.0 * omega * modal_mass)


@jit
def storey_drift(rows: Array, row: int, storey: int) -> float:
    """Drift of a storey, counted from 0, of the floor values in one row of a table; in their unit."""
    if storey == 0:
        return rows[row, 0]
    return rows[row, storey] - rows[row, storey - 1]


@jit
def add_storey_force(force: float, storey: int, floors: Array) -> None:
    """Add a storey's force (N) to its floor, and the reaction to the floor below."""
    floors[storey] += force
    if storey > 0:
        floors[storey - 1] -= force
