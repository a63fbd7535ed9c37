"""Whether the building, the specimen and the actuator of a plan fit together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from common.errors import PlanError
from common.plan.schema import StoreysOrMatrix
from common.plan.tables import Actuator, Experimental, ServoHydraulics, Structure

if TYPE_CHECKING:
    from common.plan.plan import Plan

ASYMMETRY = 1e-9  # of the largest entry, that rounding may make
OF_FOPDT = ("gain", "delay", "time_constant")


def with_modal_damping(structure: Structure, given: dict[str, Any]) -> Structure:
    """The structure as it was `given`, without the dashpots' default where a damping ratio stands in their place."""
    if structure.damping_ratio == 0.0 or "damping" in given:
        return structure
    return replace(structure, damping=(0.0,) * len(structure.mass))


def check(plan: Plan) -> None:
    """Raise PlanError where parts of the plan contradict each other."""
    check_storeys(plan)
    check_damping(plan.structure)
    check_columns(plan)
    if plan.structure.experimental is not None:
        check_experimental(plan, plan.structure.experimental)
    check_actuator(plan)


def is_matrix(stiffness: StoreysOrMatrix) -> bool:
    """Whether a stiffness is a matrix, not one value per storey."""
    return any(isinstance(row, tuple) for row in stiffness)


def check_storeys(plan: Plan) -> None:
    """Masses, stiffnesses, dashpots, the specimen's storey and the dampers' floors must fit together."""
    structure, storeys = plan.structure, plan.storeys
    if is_matrix(structure.stiffness):
        check_matrix(structure.stiffness, storeys)
        if structure.columns.model != "linear":
            raise PlanError(
                f"stiffness in [structure] is a matrix, which has no columns of model '{structure.columns.model}': "
                "leave [structure.columns] linear or give one stiffness per storey."
            )
    values = {"stiffness": structure.stiffness, "damping": structure.damping}
    for name, given in values.items():
        if len(given) != storeys:
            raise PlanError(
                f"[structure] has {storeys} masses but {len(given)} values of {name}: give one per storey."
            )
    if plan.column.storey > storeys:
        raise PlanError(f"storey in [column] is {plan.column.storey}, but the structure has {storeys}.")
    dampers = {f"slave.{name}.damper": lab.damper for name, lab in plan.slaves.items()}
    for where, damper in (dampers or {"damper": plan.damper}).items():
        if damper.floor > storeys:
            raise PlanError(f"floor in [{where}] is {damper.floor}, but the structure has {storeys}.")


def check_matrix(rows: Sequence[Any], storeys: int) -> None:
    """A stiffness matrix must be square, symmetric and positive definite."""
    if len(rows) != storeys or any(len(row) != storeys for row in rows):
        lengths = ", ".join(str(len(row)) for row in rows)
        raise PlanError(
            f"stiffness in [structure] has {len(rows)} rows of {lengths} values, but {storeys} masses need "
            f"{storeys} rows of {storeys}."
        )
    largest = max(abs(value) for row in rows for value in row)
    for i in range(storeys):
        for j in range(i):
            if abs(rows[i][j] - rows[j][i]) > ASYMMETRY * largest:
                raise PlanError(
                    f"stiffness in [structure] must be symmetric, but row {i + 1} has {rows[i][j]:g} in place {j + 1} "
                    f"and row {j + 1} has {rows[j][i]:g} in place {i + 1}."
                )
    if not positive_definite(rows):
        raise PlanError(
            "stiffness in [structure] is a matrix that is not positive definite, so the building would not stand: "
            "look at its signs."
        )


def positive_definite(rows: Sequence[Sequence[float]]) -> bool:
    """Whether a symmetric matrix is positive definite: whether its Cholesky factor exists."""
    return cholesky(rows) is not None


def cholesky(rows: Sequence[Sequence[float]]) -> list[list[float]] | None:
    """Lower Cholesky factor of a symmetric matrix, its rows up to the diagonal; None where it does not exist."""
    factor: list[list[float]] = []
    for i, row in enumerate(rows):
        new: list[float] = []
        for j in range(i):
            inner = math.fsum(new[k] * factor[j][k] for k in range(j))
            new.append((row[j] - inner) / factor[j][j])
        left = row[i] - math.fsum(value * value for value in new)
        if not left > 0.0:
            return None
        factor.append([*new, math.sqrt(left)])
    return factor


def stiffness_of_drift(rows: Sequence[Sequence[float]], storey: int) -> float:
    """Stiffness (N/m) `1/(eᵀ·K⁻¹·e)` of a positive definite matrix against the drift e of a storey, from 1."""
    factor = cholesky(rows)
    if factor is None:
        return 0.0
    solved: list[float] = []
    for i, row in enumerate(factor):
        right = float(i == storey - 1) - float(i == storey - 2)
        inner = math.fsum(row[k] * solved[k] for k in range(i))
        solved.append((right - inner) / row[i])
    return 1.0 / math.fsum(value * value for value in solved)


def check_damping(structure: Structure) -> None:
    """Dashpots and a damping ratio of all modes exclude each other."""
    if structure.damping_ratio > 0.0 and any(structure.damping):
        raise PlanError(
            f"[structure] has damping and a damping_ratio of {structure.damping_ratio:g}: give one of them, as the "
            "ratio stands in place of the dashpots."
        )


def check_columns(plan: Plan) -> None:
    """The specimen cannot stand for more columns than its storey has, nor for a share of a matrix."""
    column = plan.column
    if column.represents > column.columns_per_storey:
        raise PlanError(
            f"represents in [column] is {column.represents}, but the storey has {column.columns_per_storey} columns."
        )
    if is_matrix(plan.structure.stiffness) and plan.structure.experimental is None:
        raise PlanError(
            "stiffness in [structure] is a matrix, of which no share of a storey's columns can be taken: say in "
            "[structure.experimental] what the specimen takes over."
        )


def check_experimental(plan: Plan, experimental: Experimental) -> None:
    """The specimen cannot take over more than the building has; nor all of a floor's mass or of a matrix."""
    place = plan.column.storey - 1
    matrix = is_matrix(plan.structure.stiffness)
    limits = {"mass": ("floor", plan.structure.mass[place])}
    if matrix:
        limits["stiffness"] = (
            "the drift of storey",
            stiffness_of_drift(plan.structure.stiffness, plan.column.storey),
        )
    else:
        limits["stiffness"] = ("storey", plan.structure.stiffness[place])
    if plan.structure.damping_ratio == 0.0:
        limits["damping"] = ("storey", plan.structure.damping[place])
    for name, (part, most) in limits.items():
        value = getattr(experimental, name)
        whole = name == "mass" or (name == "stiffness" and matrix)
        if value > most or (whole and value == most):
            raise PlanError(
                f"{name} in [structure.experimental] is {value:g}, but {part} {place + 1} of the whole building has "
                f"{most:g}: give {'less' if whole else 'no more'} than that."
            )


def check_actuator(plan: Plan) -> None:
    """Parameters belong to the model that is chosen, and servo-hydraulics move a specimen with a mass."""
    actuator, plain = plan.actuator, Actuator()
    if actuator.model == "fopdt":
        if actuator.servo != ServoHydraulics():
            raise PlanError(
                "[actuator.servo] is given, but model in [actuator] is 'fopdt': choose 'servo_hydraulic' or leave the "
                "table out."
            )
        return
    for name in OF_FOPDT:
        if getattr(actuator, name) != getattr(plain, name):
            raise PlanError(
                f"{name} in [actuator] is of the model 'fopdt', but 'servo_hydraulic' is chosen: leave it out and look "
                "at [actuator.servo]."
            )
    if plan.column.mass == 0.0:
        raise PlanError(
            "mass in [column] is 0, but the actuator 'servo_hydraulic' moves the specimen by its force: give the "
            "moving mass."
        )


def parameters(actuator: Actuator) -> dict[str, Any]:
    """The parameters of the actuator's model as a plan has them."""
    if actuator.model == "fopdt":
        return {name: getattr(actuator, name) for name in OF_FOPDT}
    return {"servo": vars(actuator.servo)}
