"""The partition of a plan's building: the numerical part, the part of its specimens, and the margin of their paths.

    M = M_N + Σ m_e·1_s·1_sᵀ,    C = C_N + Σ c_e·e·eᵀ,    K = K_N + Σ k_e·e·eᵀ

with the whole building's matrices on the left and one term for every laboratory that follows a drift: e the drift of
its storey as a row over the floors and 1_s the floor above it. The kind gives the specimen's stiffness, dashpot and
mass at the building's scale: those of a column are multiplied by `represents` and the deformation ratio.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.tables import Experimental
from common.roles import MASTER
from laboratories.kind import Coupling, Follows
from laboratories.kinds import kind_of, kinds_of
from loop.nominal import critical
from loop.nominal.path import NO_PATH, TransferPath, path_at
from models import indicators
from models.registry import Array
from models.structures import shear_building


class Matrices(NamedTuple):
    """Mass (kg), damping (N·s/m) and stiffness (N/m), (n, n) each."""

    M: Array
    C: Array
    K: Array


class Felt(NamedTuple):
    """The nominal specimen at the building's scale, against its storey's drift."""

    stiffness: float  # N/m
    damping: float  # N·s/m
    mass: float  # kg


def matrices(plan: Plan) -> Matrices:
    """The whole building, specimen included; with a damping ratio ζ of all modes `C = M·Φ·diag(2ζω)·Φᵀ·M`.

    Raises:
        InputError: a mass, stiffness or dashpot is not valid.
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


def drifts(plan: Plan) -> dict[str, Coupling]:
    """The laboratories that follow the drift of a storey, by role; raises InputError where a kind cannot be loaded."""
    couplings = {role: kind.coupling(plan.of(role)) for role, kind in kinds_of(plan).items()}
    return {role: one for role, one in couplings.items() if one.follows is Follows.DRIFT}


def numerical(plan: Plan) -> Matrices:
    """The numerical part: the whole building without the part of the specimens; raises InputError as `parts`."""
    return parts(plan)[1]


def parts(plan: Plan) -> tuple[Matrices, Matrices]:
    """The whole building and its numerical part, which lacks the part that the specimens take over.

    Raises:
        InputError: a mass, stiffness or dashpot is not valid, a specimen takes over all of the modal damping, or
            `[structure.experimental]` does not belong to exactly one specimen.
    """
    found = drifts(plan)
    check_experimental(plan, len(found))
    whole = matrices(plan)
    M, C, K = whole.M.copy(), whole.C, whole.K
    for role, coupling in found.items():
        left_out = taken_over(plan, role)
        if plan.structure.damping_ratio > 0.0 and left_out.damping > 0.0:
            check_damping(plan, whole, left_out.damping, role)
        M[coupling.place - 1, coupling.place - 1] -= left_out.mass
        direction = drift_direction(plan, role)
        outer = np.outer(direction, direction)
        C, K = C - left_out.damping * outer, K - left_out.stiffness * outer
    return whole, Matrices(M, C, K)


def check_experimental(plan: Plan, specimens: int) -> None:
    """Raise InputError where `[structure.experimental]` does not belong to exactly one specimen."""
    if plan.structure.experimental is not None and specimens != 1:
        raise InputError(
            f"[structure.experimental] says what one specimen takes over, but {specimens} laboratories follow a "
            "storey's drift: leave it out, or leave one such laboratory."
        )


def check_damping(plan: Plan, whole: Matrices, damping: float, role: str) -> None:
    """Raise InputError where a dashpot (N·s/m) is not below that of the modal damping against the storey's drift.

    The latter is `1/(eᵀ·C⁻¹·e)`, with `C⁻¹ = Φ·diag(1/(2ζω))·Φᵀ` and Φ of modal mass 1; with a dashpot of that size or
    more C_N would not be positive definite.
    """
    modes = shear_building.modes(*whole)
    parts = (drift_direction(plan, role) @ modes.shapes) ** 2
    takes_part = parts > np.finfo(np.float64).eps * parts.sum()  # leaves out rigid modes without this drift
    rate = float(parts[takes_part] @ modes.periods[takes_part]) / (
        4.0 * math.pi * plan.structure.damping_ratio
    )
    if damping * rate >= 1.0:
        storey = coupling_of(plan, role).place
        raise InputError(
            f"damping in [structure.experimental] is {damping:g}, but with damping_ratio "
            f"{plan.structure.damping_ratio:g} the drift of storey {storey} of the whole building has "
            f"{1.0 / rate:g}: give less than that."
        )


def coupling_of(plan: Plan, role: str) -> Coupling:
    """The coupling of a role's laboratory to the building; raises InputError where the role has no laboratory."""
    return kind_of(plan, role).coupling(plan.of(role))


def taken_over(plan: Plan, role: str = MASTER) -> Experimental:
    """The part that a role's specimen takes over: that of `[structure.experimental]`, else its share of the columns."""
    if plan.structure.experimental is not None:
        return plan.structure.experimental
    share = coupling_of(plan, role).share
    return Experimental(stiffness=storey_stiffness(plan, role) * share if share else 0.0)


def storey_stiffnesses(plan: Plan) -> Array:
    """Stiffness (N/m) of the numerical columns of every storey, (n,); of a plan that has no matrix."""
    own, shares = np.array(plan.structure.stiffness), np.zeros(plan.storeys)
    for coupling in drifts(plan).values():
        if plan.structure.experimental is None:
            shares[coupling.place - 1] += coupling.share
        else:
            own[coupling.place - 1] -= plan.structure.experimental.stiffness
    own[shares > 0.0] *= 1.0 - shares[shares > 0.0]
    return own


def storey_stiffness(plan: Plan, role: str = MASTER) -> float:
    """Stiffness (N/m) of the whole building's storey in which a role's specimen stands.

    For a stiffness matrix it is that against a pair of forces on the storey's two floors, `1/(eᵀ·K⁻¹·e)`, which in a
    shear building is the storey's own stiffness.
    """
    value = plan.structure.stiffness[coupling_of(plan, role).place - 1]
    if not isinstance(value, tuple):
        return value
    direction = drift_direction(plan, role)
    return 1.0 / float(direction @ np.linalg.solve(np.array(plan.structure.stiffness), direction))


def drift_direction(plan: Plan, role: str = MASTER) -> Array:
    """The drift of a role's storey as a row over the floors' displacements, (n,)."""
    storey = coupling_of(plan, role).place - 1
    direction = np.zeros(plan.storeys)
    direction[storey] = 1.0
    if storey > 0:
        direction[storey - 1] = -1.0
    return direction


def felt(plan: Plan, role: str = MASTER) -> Felt:
    """A role's nominal specimen, scaled to the building."""
    coupling = coupling_of(plan, role)
    return Felt(coupling.stiffness, coupling.damping, coupling.mass)


def critical_delay_of(plan: Plan) -> float:
    """Smallest common delay (s) of all specimens' forces that makes the linear loop unstable; inf without a specimen.

    Raises:
        InputError: no specimen could stabilise the numerical part.
    """
    found = drifts(plan)
    if not found:
        return math.inf
    directions = np.stack([drift_direction(plan, role) for role in found])
    specimens = np.array([felt(plan, role) for role in found])
    if np.all(directions == directions[0]):  # one storey: the specimens act as one
        stiffness, damping, mass = specimens.sum(axis=0).tolist()
        return indicators.critical_delay(*numerical(plan), directions[0], stiffness, damping, mass)
    return critical.critical_delay(*numerical(plan), directions, specimens)


def damping_lost(
    plan: Plan, path: indicators.FrequencyEvaluation | TransferPath, role: str = MASTER
) -> float:
    """Damping ratio that the building's first mode loses by the amplitude and the delay of a specimen's path.

    For a specimen `k + jω·c − ω²·m` after a path `A·e^(−jωd)` it consists of the damping equivalent of the spring and
    the mass, and of the share `1 − A·cos(ωd)` of its dashpot.
    """
    modes = shear_building.modes(*matrices(plan))
    omega = 2.0 * math.pi / float(modes.periods[0])
    specimen = felt(plan, role)
    drift = float(drift_direction(plan, role) @ modes.shapes[:, 0]) ** 2
    share = (specimen.stiffness - omega**2 * specimen.mass) * drift
    lost, _ = indicators.damping_equivalent(share, path.amplitude, path.delay, omega)
    lost += specimen.damping * drift * (1.0 - path.amplitude * math.cos(omega * path.delay))
    return indicators.damping_points(lost, 1.0, omega**2)


class Partition(NamedTuple):
    """Margins of the specimens' paths, from nominal models; amplitude and delay are those of the latest path."""

    frequency: float  # Hz, of the building's first mode
    critical_delay: float  # s, inf where no delay makes the loop unstable
    sensitivity: float  # predictive stability indicator, log10 of it in ms
    amplitude: float  # of that compensated transfer system at that frequency
    delay: float  # s, there, with the intervals by which the force is late; inf where a path is unstable
    damping_points: (
        float  # damping ratio that the first mode loses by the paths, inf where the loop is unstable
    )
    stable: bool = True  # whether every compensated transfer system comes to rest without the building
    role: str = MASTER  # the role with the latest path, or the first with an unstable one
    paths: Mapping[str, TransferPath] = {}  # of every laboratory that follows a drift, by role

    @property
    def unstable(self) -> bool:
        """Whether the loop of building and specimens is unstable, by an unstable path or by its delay."""
        return not self.stable or self.delay >= self.critical_delay


def assess(plan: Plan) -> Partition:
    """The partition of a plan; raises InputError where a model or parameter is unknown."""
    modes = shear_building.modes(*matrices(plan))
    frequency = 1.0 / float(modes.periods[0])
    bearable = critical_delay_of(plan)
    paths = {role: path_at(plan, frequency, role) for role in drifts(plan)}
    role = max(paths, key=lambda one: paths[one].delay, default=MASTER)
    path = paths.get(role, NO_PATH)
    borne = all(one.stable for one in paths.values()) and path.delay < bearable
    lost = sum(damping_lost(plan, one, of) for of, one in paths.items()) if borne else math.inf
    return Partition(
        frequency,
        bearable,
        indicators.predictive_stability_indicator(bearable),
        path.amplitude,
        path.delay,
        lost,
        path.stable,
        role,
        paths,
    )
