"""Checks that the building, the specimens and the actuators of a plan fit together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from common.errors import PlanError
from common.plan.kinds import COLUMN, OWN, TABLE, known_kind
from common.plan.laboratory_tables import Actuator, ServoHydraulics
from common.plan.plan import Plan
from common.plan.schema import StoreysOrMatrix
from common.plan.tables import FMU, OF_CLIENT, OF_PLAN, OPENSEES, Experimental, Structure
from common.roles import name_of

ASYMMETRY = 1e-9  # of the largest entry: far above double precision, far below the digits that a user writes
OF_FOPDT = ("gain", "delay", "time_constant")


def with_modal_damping(structure: Structure, given: dict[str, Any]) -> Structure:
    """The structure from the values `given`.

    Where they hold a damping ratio, the default of the dashpots is dropped.
    """
    if structure.damping_ratio == 0.0 or "damping" in given:
        return structure
    return replace(structure, damping=(0.0,) * len(structure.mass))


def check_model(structure: Structure, given: Mapping[str, Any]) -> None:
    """Raise PlanError for a model that is none of those known, and for keys that do not fit it.

    A model that another program computes needs the masses and stiffnesses `given`: they say how many floors there are,
    and the pre-flight checks reckon with them.
    """
    model = structure.model
    foreign = model.startswith(OPENSEES) or model.endswith(FMU)
    if not foreign and model not in (OF_PLAN, OF_CLIENT):
        raise PlanError(
            f"model in [structure] is '{model}', but must be one of {OF_PLAN}, {OF_CLIENT}, {OPENSEES}FILE.py, "
            f"FILE{FMU}."
        )
    if structure.options and not foreign:
        raise PlanError("options in [structure] are for a model of OpenSees or an FMU: leave them out.")
    missing = [name for name in ("mass", "stiffness") if foreign and name not in given]
    if missing:
        raise PlanError(
            f"[structure] names the model '{model}' without {' and '.join(missing)}: give floor masses and storey "
            "stiffnesses near those of the model, from which the margins before the start are computed."
        )
    if foreign and structure.experimental is not None:
        raise PlanError(
            f"[structure.experimental] says what a specimen takes over of the plan's building, but '{model}' is the "
            "building: leave it out, and leave the specimen out of the model."
        )


def check(plan: Plan) -> None:
    """Raise PlanError where parts of the plan contradict each other."""
    check_storeys(plan)
    check_damping(plan.structure)
    columns = specimens(plan)
    for where, seen in columns.items():
        check_column(seen, where)
    check_shares(plan, columns)
    if plan.structure.experimental is not None:
        check_experimental(plan, columns, plan.structure.experimental)
    for where, seen in columns.items():
        check_actuator(seen, where)


def specimens(plan: Plan) -> dict[str, Plan]:
    """The plan as each role with a column sees it, by the prefix of its tables' names in the file."""
    return of_kind(plan, COLUMN)


def of_kind(plan: Plan, kind: str) -> dict[str, Plan]:
    """The plan as each role with that kind of laboratory sees it, by the prefix of its tables' names in the file."""
    hosting = [role for role, one in plan.kinds.items() if known_kind(one) == kind]
    return {f"{role}." if name_of(role) else "": plan.of(role) for role in hosting}


def is_matrix(stiffness: StoreysOrMatrix) -> bool:
    """Whether a stiffness is a matrix rather than one value per storey."""
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
            instead = ", or damping_ratio in their place" if name == "damping" else ""
            raise PlanError(
                f"[structure] has {storeys} masses but {len(given)} values of {name}: give one per storey{instead}."
            )
    check_places(plan)


def check_places(plan: Plan) -> None:
    """The storey or floor of every laboratory must be in the building."""
    places = ((COLUMN, "column", "storey"), (TABLE, "damper", "floor"), (OWN, "device", "place"))
    for kind, table, key in places:
        for where, seen in of_kind(plan, kind).items():
            place = getattr(getattr(seen, table), key)
            if place > plan.storeys:
                raise PlanError(
                    f"{key} in [{where}{table}] is {place}, but the structure has {plan.storeys}."
                )


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
            "stiffness in [structure] is a matrix that is not positive definite, so the building would be unstable: "
            "check its signs."
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
    """Stiffness (N/m) `1/(eᵀ·K⁻¹·e)` of a matrix K against the drift e of a storey, counted from 1.

    0 where K is singular.
    """
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
    """Raise PlanError where both dashpots and a damping ratio of all modes are given."""
    if structure.damping_ratio > 0.0 and any(structure.damping):
        raise PlanError(
            f"[structure] has damping and a damping_ratio of {structure.damping_ratio:g}: give one of them, because "
            "the ratio replaces the dashpots."
        )


def check_column(plan: Plan, where: str) -> None:
    """Raise PlanError where a specimen represents more columns than its storey has, or a share of a matrix."""
    column = plan.column
    if column.represents > column.columns_per_storey:
        raise PlanError(
            f"represents in [{where}column] is {column.represents}, but the storey has "
            f"{column.columns_per_storey} columns."
        )
    if is_matrix(plan.structure.stiffness) and plan.structure.experimental is None:
        raise PlanError(
            "stiffness in [structure] is a matrix, of which no share of a storey's columns can be taken: say in "
            "[structure.experimental] what the specimen takes over."
        )


def check_shares(plan: Plan, columns: Mapping[str, Plan]) -> None:
    """Raise PlanError where the specimens of one storey together represent more columns than it has."""
    by_storey: dict[int, list[tuple[str, Fraction]]] = {}
    for where, seen in columns.items():
        share = Fraction(seen.column.represents, seen.column.columns_per_storey)
        by_storey.setdefault(seen.column.storey, []).append((f"[{where}column]", share))
    for storey, shares in by_storey.items():
        if sum(share for _, share in shares) > 1:
            parts = ", ".join(f"{share} by {where}" for where, share in shares)
            raise PlanError(
                f"The specimens of storey {storey} represent more columns than it has ({parts}): lower represents, or "
                "place one of them in another storey."
            )


def check_experimental(plan: Plan, columns: Mapping[str, Plan], experimental: Experimental) -> None:
    """Raise PlanError where [structure.experimental] does not fit the one specimen or the building.

    A device of the user's own may be the specimen, because only its class knows whether it follows a drift.
    """
    devices = of_kind(plan, OWN)
    if len(columns) > 1 or not (columns or devices):
        raise PlanError(
            f"[structure.experimental] says what one specimen takes over, but the plan has {len(columns)} columns: "
            "leave it out, or leave one column."
        )
    storeys = [seen.column.storey for seen in columns.values()]
    for storey in storeys or [seen.device.place for seen in devices.values()]:
        check_taken_over(plan, storey, experimental)


def check_taken_over(plan: Plan, storey: int, experimental: Experimental) -> None:
    """Raise PlanError where a specimen takes over more of a storey than there is, or all of a mass or of a matrix."""
    place = storey - 1
    matrix = is_matrix(plan.structure.stiffness)
    limits = {"mass": ("floor", plan.structure.mass[place])}
    if matrix:
        limits["stiffness"] = ("the drift of storey", stiffness_of_drift(plan.structure.stiffness, storey))
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


def check_actuator(plan: Plan, where: str) -> None:
    """Raise PlanError for parameters of the model not chosen, and for servo-hydraulics without a specimen's mass."""
    actuator, plain = plan.actuator, Actuator()
    if actuator.model == "fopdt":
        if actuator.servo != ServoHydraulics():
            raise PlanError(
                f"[{where}actuator.servo] is given, but model in [{where}actuator] is 'fopdt': choose "
                "'servo_hydraulic' or leave the table out."
            )
        return
    for name in OF_FOPDT:
        if getattr(actuator, name) != getattr(plain, name):
            raise PlanError(
                f"{name} in [{where}actuator] belongs to the model 'fopdt', but 'servo_hydraulic' is chosen: leave it "
                f"out and use [{where}actuator.servo]."
            )
    if plan.column.mass == 0.0:
        raise PlanError(
            f"mass in [{where}column] is 0, but the actuator 'servo_hydraulic' moves the specimen by its force: "
            "give the moving mass."
        )


def parameters(actuator: Actuator) -> dict[str, Any]:
    """The parameters of the actuator's model as a plan has them."""
    if actuator.model == "fopdt":
        return {name: getattr(actuator, name) for name in OF_FOPDT}
    return {"servo": vars(actuator.servo)}
