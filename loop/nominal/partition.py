"""A plan's building cut in two: the numerical part, what the specimen takes over, and what its path can bear.

    M = M_N + m_e·1_s·1_sᵀ,    C = C_N + c_e·e·eᵀ,    K = K_N + k_e·e·eᵀ

with the whole building's matrices on the left, e the drift of the specimen's storey as a row over the floors and 1_s
the floor above it. What the specimen really is stands in `[column]`: as the building feels it, its stiffness, dashpot
and mass count `represents` times the deformation ratio.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.tables import Experimental
from loop.nominal.path import Path, path_at
from models import indicators
from models.registry import Array
from models.structures import shear_building


class Matrices(NamedTuple):
    """Mass (kg), damping (N·s/m) and stiffness (N/m), (n, n) each."""

    M: Array
    C: Array
    K: Array


class Felt(NamedTuple):
    """The nominal specimen as its storey feels it."""

    stiffness: float  # N/m
    damping: float  # N·s/m
    mass: float  # kg


def matrices(plan: Plan) -> Matrices:
    """The whole building, specimen included; with a damping ratio ζ of all modes `C = M·Φ·diag(2ζω)·Φᵀ·M`.

    Raises:
        InputError: a mass, stiffness or dashpot cannot be.
    """
    structure = plan.structure
    given = np.array(structure.stiffness)
    storeys = np.zeros(plan.storeys) if given.ndim > 1 else given
    M, C, K = shear_building.matrices(np.array(structure.mass), storeys, np.array(structure.damping))
    if given.ndim > 1:
        K = given
    if structure.damping_ratio > 0.0:
        C = shear_building.modal_damping(M, K, structure.damping_ratio)
    return Matrices(M, C, K)


def numerical(plan: Plan) -> Matrices:
    """The numerical part: the whole building without what the specimen takes over.

    Raises:
        InputError: a mass, stiffness or dashpot cannot be, or the specimen takes over all of the modal damping.
    """
    whole, left_out = matrices(plan), taken_over(plan)
    if plan.structure.damping_ratio > 0.0 and left_out.damping > 0.0:
        check_damping(plan, whole, left_out.damping)
    M = whole.M.copy()
    M[plan.column.storey - 1, plan.column.storey - 1] -= left_out.mass
    direction = drift_direction(plan)
    outer = np.outer(direction, direction)
    return Matrices(M, whole.C - left_out.damping * outer, whole.K - left_out.stiffness * outer)


def check_damping(plan: Plan, whole: Matrices, damping: float) -> None:
    """Raise InputError where a dashpot (N·s/m) is not below what the modal damping has against the storey's drift.

    That is `1/(eᵀ·C⁻¹·e)`, with `C⁻¹ = Φ·diag(1/(2ζω))·Φᵀ` and Φ of modal mass 1; at or beyond it C_N would not be
    positive definite.
    """
    modes = shear_building.modes(*whole)
    parts = (drift_direction(plan) @ modes.shapes) ** 2
    takes_part = parts > np.finfo(np.float64).eps * parts.sum()  # rigid modes without this drift have no say
    rate = float(parts[takes_part] @ modes.periods[takes_part]) / (
        4.0 * math.pi * plan.structure.damping_ratio
    )
    if damping * rate >= 1.0:
        raise InputError(
            f"damping in [structure.experimental] is {damping:g}, but with damping_ratio "
            f"{plan.structure.damping_ratio:g} the drift of storey {plan.column.storey} of the whole building has "
            f"{1.0 / rate:g}: give less than that."
        )


def taken_over(plan: Plan) -> Experimental:
    """What the specimen takes over: as the plan says, else its share of the storey's columns."""
    if plan.structure.experimental is not None:
        return plan.structure.experimental
    share = storey_stiffness(plan)
    share *= plan.column.represents / plan.column.columns_per_storey
    return Experimental(stiffness=share)


def storey_stiffnesses(plan: Plan) -> Array:
    """Stiffness (N/m) of the numerical columns of every storey, (n,); of a plan that has no matrix."""
    own = np.array(plan.structure.stiffness)
    place, column = plan.column.storey - 1, plan.column
    if plan.structure.experimental is None:
        own[place] *= 1.0 - column.represents / column.columns_per_storey
    else:
        own[place] -= plan.structure.experimental.stiffness
    return own


def storey_stiffness(plan: Plan) -> float:
    """Stiffness (N/m) of the whole building's storey in which the specimen stands.

    Of a matrix, what a pair of forces on the storey's two floors finds against its drift, `1/(eᵀ·K⁻¹·e)`: in a shear
    building the storey's own stiffness.
    """
    value = plan.structure.stiffness[plan.column.storey - 1]
    if not isinstance(value, tuple):
        return value
    direction = drift_direction(plan)
    return 1.0 / float(direction @ np.linalg.solve(np.array(plan.structure.stiffness), direction))


def drift_direction(plan: Plan) -> Array:
    """The specimen's storey drift as a row over the floors' displacements, (n,)."""
    storey = plan.column.storey - 1
    direction = np.zeros(plan.storeys)
    direction[storey] = 1.0
    if storey > 0:
        direction[storey - 1] = -1.0
    return direction


def felt(plan: Plan) -> Felt:
    """The nominal specimen as its storey feels it."""
    column = plan.column
    scale = column.deformation_ratio * column.represents
    return Felt(scale * column.stiffness, scale * column.damping, scale * column.mass)


def critical_delay_of(plan: Plan) -> float:
    """Smallest delay (s) of the column's force that makes the linear loop unstable.

    Raises:
        InputError: no specimen could stabilise the numerical part.
    """
    part, specimen = numerical(plan), felt(plan)
    return indicators.critical_delay(
        *part, drift_direction(plan), specimen.stiffness, specimen.damping, specimen.mass
    )


def damping_lost(plan: Plan, path: indicators.FrequencyEvaluation | Path) -> float:
    """Damping ratio of the building's first mode that an amplitude and a delay of the column's path cost.

    Of a specimen `k + jω·c − ω²·m` behind a path `A·e^(−jωd)`: what the spring and the mass lose, as damping
    equivalent, and the share `1 − A·cos(ωd)` of its dashpot.
    """
    modes = shear_building.modes(*matrices(plan))
    omega = 2.0 * math.pi / float(modes.periods[0])
    specimen = felt(plan)
    drift = float(drift_direction(plan) @ modes.shapes[:, 0]) ** 2
    share = (specimen.stiffness - omega**2 * specimen.mass) * drift
    lost, _ = indicators.damping_equivalent(share, path.amplitude, path.delay, omega)
    lost += specimen.damping * drift * (1.0 - path.amplitude * math.cos(omega * path.delay))
    return indicators.damping_points(lost, 1.0, omega**2)


class Partition(NamedTuple):
    """Margins of the column's path, from nominal models."""

    frequency: float  # Hz, of the building's first mode
    critical_delay: float  # s, inf where no delay makes the loop unstable
    sensitivity: float  # predictive stability indicator, log10 of it in ms
    amplitude: float  # of the compensated actuator at that frequency
    delay: float  # s, there, with the interval that a unit delay of the force adds; inf where the path is unstable
    damping_points: float  # damping ratio that the path costs the first mode, inf where the loop is unstable
    stable: bool = True  # whether the compensated actuator comes to rest by itself

    @property
    def unstable(self) -> bool:
        """Whether the loop of building and specimen is unstable: its path by itself, or by its delay."""
        return not self.stable or self.delay >= self.critical_delay


def assess(plan: Plan) -> Partition:
    """The partition of a plan; raises InputError where a model or parameter is unknown."""
    modes = shear_building.modes(*matrices(plan))
    frequency = 1.0 / float(modes.periods[0])
    critical = critical_delay_of(plan)
    path = path_at(plan, frequency)
    return Partition(
        frequency,
        critical,
        indicators.predictive_stability_indicator(critical),
        path.amplitude,
        path.delay,
        damping_lost(plan, path) if path.stable and path.delay < critical else math.inf,
        path.stable,
    )
