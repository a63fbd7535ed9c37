"""The building's response storey by storey, and the modes of the plan's building."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from common.plan.plan import Plan
from common.recording.reader import Run, Values
from common.roles import MASTER
from loop.nominal.partition import matrices
from models.structures import shear_building

UNITS = {"drift": "m", "displacement": "m", "absolute_acceleration": "m/s²", "shear": "N"}


def storeys(run: Run, plan: Plan) -> list[dict[str, Any]]:
    """Peaks of every storey from the lowest up, each with its time; of quantities without signals nothing.

    The drift is that between a storey's two floors, displacement and absolute acceleration are of the floor above it.
    The shear is the restoring force of the storey's columns: of the numerical ones, and in the specimen's storey what
    was measured times the columns that the specimen stands for.
    """
    columns = run.columns.get(MASTER, {})
    t = columns.get("t", np.array([]))
    if "displacement" not in columns or not t.size:
        return []
    found = quantities(columns, plan)
    return [
        {"storey": place + 1}
        | {name: peak(values[:, place], t, UNITS[name]) for name, values in found.items()}
        for place in range(plan.storeys)
    ]


def quantities(columns: dict[str, Values], plan: Plan) -> dict[str, Values]:
    """Each quantity over time and storeys, (n, storeys)."""
    shape = (columns["t"].size, plan.storeys)
    displacement = columns["displacement"].reshape(shape)
    found = {"drift": np.diff(displacement, axis=1, prepend=0.0), "displacement": displacement}
    if "absolute_acceleration" in columns:
        found["absolute_acceleration"] = columns["absolute_acceleration"].reshape(shape)
    if {"numerical_force", "column_force"} <= columns.keys():
        shear = columns["numerical_force"].reshape(shape).copy()
        shear[:, plan.column.storey - 1] += plan.column.represents * columns["column_force"]
        found["shear"] = shear
    return found


def peak(values: Values, t: Values, unit: str) -> dict[str, Any] | None:
    """Largest magnitude and its time, None where no value is finite."""
    if not np.isfinite(values).any():
        return None
    place = int(np.nanargmax(np.abs(values)))
    return {"peak": float(abs(values[place])), "t": float(t[place]), "unit": unit}


def modes(plan: Plan) -> list[dict[str, float | None]]:
    """Period (s) and damping ratio of the plan's building without its dampers, the longest period first."""
    found = shear_building.modes(*matrices(plan))
    return [
        {
            "period": float(period) if math.isfinite(period) else None,
            "damping_ratio": float(ratio) if math.isfinite(ratio) else None,
        }
        for period, ratio in zip(found.periods, found.damping_ratios, strict=True)
    ]
