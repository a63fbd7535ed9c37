"""The numerical substructure of a plan, assembled at rest from its building and its laboratories."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.building import is_matrix
from common.plan.plan import Plan
from common.roles import MASTER, title
from laboratories.kind import Coupling, Follows
from laboratories.kinds import kinds_of
from loop.nominal import partition
from loop.substructure import (
    DELAYED,
    DRIFT,
    EXERTED,
    FLOOR,
    MATRIX,
    OF_SLAVES,
    SENT_VALUES,
    STOREY_VALUES,
    Substructure,
)
from models import compensators, force_correction, integrators, specimens, trend
from models.compensators import Built as Compensator
from models.registry import Array


def build(plan: Plan, rows: Array, p_delta: float = 0.0, *, slaves: bool = True) -> Substructure:
    """The numerical substructure of a plan at rest; `rows` are those of `ground_rows`.

    `p_delta` is the stiffness (N/m, negative) that gravity adds to every storey. Without `slaves` nothing is computed
    for them.

    Raises:
        InputError: a kind, model, method or parameter is unknown, or a laboratory's storey or floor is not in the
            building.
    """
    if plan.served:
        raise InputError(
            "The plan's building is a client's, so there is none to compute: leave out model in [structure], or start "
            "the test with rths serve."
        )
    if plan.foreign:
        raise InputError(
            f"'{plan.structure.model}' computes the plan's building, which only a running test does: use rths run, "
            "with --virtual on a virtual clock, or leave out model in [structure] for the linear building of its "
            "tables."
        )
    mass, n, interval = np.array(plan.structure.mass), plan.storeys, plan.test.interval
    columns, method = numerical_columns(plan), integration(plan)
    hosted = {role: kind for role, kind in kinds_of(plan).items() if slaves or role == MASTER}
    couplings = {role: kind.coupling(plan.of(role)) for role, kind in hosted.items()}
    for role, coupling in couplings.items():
        check_place(plan, role, coupling)
    labs = [laboratory(coupling, interval) for coupling in couplings.values()]
    sent = SENT_VALUES * sum(role != MASTER for role in hosted)
    return Substructure(
        own_compensator(plan),
        np.array([method.code, columns.code, int(MASTER in hosted)]),
        np.array([interval, p_delta]),
        np.array([placed(coupling) for coupling in couplings.values()], dtype=np.int64)
        .reshape(-1, 2)
        .T.copy(),
        np.array(labs).reshape(-1, EXERTED + 1).T.copy(),
        mass,
        method.coefficients,
        columns.params,
        rows,
        method.start(np.zeros(n), np.zeros(n), -mass * rows[0, 0]),
        columns.memory,
        np.zeros((len(labs), trend.RECENT)),
        np.zeros((len(labs), DELAYED + 1)),
        np.zeros(SENT_VALUES),
        np.zeros(n),
        np.zeros(OF_SLAVES + sent + STOREY_VALUES * n),
    )


def check_place(plan: Plan, role: str, coupling: Coupling) -> None:
    """Raise InputError where a laboratory's storey or floor is not in the building."""
    if coupling.place > plan.storeys:
        what = "storey" if coupling.follows is Follows.DRIFT else "floor"
        raise InputError(
            f"The laboratory of the {title(role)} stands at {what} {coupling.place}, but the structure has "
            f"{plan.storeys}: correct its place in the plan."
        )


def own_compensator(plan: Plan) -> Compensator:
    """The compensator of the master's laboratory; `none` where it has no laboratory."""
    interval, kind = plan.test.interval, kinds_of(plan).get(MASTER)
    if kind is None:
        return compensators.build("none", {}, interval)
    chosen = kind.compensator(plan)
    return compensators.build(chosen.kind, chosen.parameters, interval, chosen.where)


def placed(coupling: Coupling) -> tuple[int, int]:
    """A laboratory's column of `places`."""
    return (DRIFT if coupling.follows is Follows.DRIFT else FLOOR, coupling.place - 1)


def laboratory(coupling: Coupling, interval: float) -> list[float]:
    """A laboratory's column of `labs` at an interval (s), before any force."""
    memory, gain = force_correction.coefficients(coupling.correction, interval)
    delayed = float(coupling.correction.unit_delay)
    return [coupling.ratio, coupling.scale, coupling.effort, memory, gain, delayed, 0.0, 0.0]


class NumericalColumns(NamedTuple):
    """The numerical columns of every storey at rest."""

    code: int  # of their model, or MATRIX
    params: Array  # (n, parameters), or (n, n) N/m
    memory: Array  # (n, memory)


def numerical_columns(plan: Plan) -> NumericalColumns:
    """The numerical columns of a plan; raises InputError where their model or a parameter is unknown."""
    if is_matrix(plan.structure.stiffness):
        K = np.ascontiguousarray(partition.numerical(plan).K)
        return NumericalColumns(MATRIX, K, np.zeros((plan.storeys, specimens.STATE_SIZE)))
    model, own = plan.structure.columns, partition.storey_stiffnesses(plan)
    packed = [specimens.pack(model.model, stiffness=float(k), **model.parameters) for k in own]
    params, memory = (np.stack([parts[place] for parts in packed]) for place in (1, 2))
    return NumericalColumns(packed[0][0], params, memory)


def integration(plan: Plan) -> integrators.Method:
    """The plan's method for the numerical part; raises InputError where it is unknown or would diverge."""
    structure, (whole, numerical) = plan.structure, partition.parts(plan)
    chosen = integrators.INTEGRATORS.get(structure.integrator)
    K = numerical.K if chosen and chosen.of_numerical else whole.K
    return integrators.build(
        structure.integrator, numerical.M, numerical.C, K, plan.test.interval, structure.rho_infinity
    )
