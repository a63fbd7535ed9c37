"""The building's response storey by storey, and the modes of the plan's building."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from common.plan.plan import Plan
from common.recording.run import Run, Values
from common.roles import MASTER
from laboratories.kind import Follows
from loop.nominal.partition import matrices
from models.structures import shear_building
from report.facts.laboratories import LaboratoryFacts

UNITS = {"drift": "m", "displacement": "m", "absolute_acceleration": "m/s²", "shear": "N"}


def storeys(run: Run, plan: Plan, labs: list[LaboratoryFacts]) -> list[dict[str, Any]]:
    """Peaks of every storey from the lowest up, each with its time; quantities without signals are left out.

    The drift is that between a storey's two floors; displacement and absolute acceleration are those of the floor above
    the storey. The shear is the restoring force of the storey's columns: of the numerical columns, plus the specimen's
    force times the number of columns that it represents; a slave's specimen enters with the force that the master used.
    """
    columns = run.columns.get(MASTER, {})
    t = columns.get("t", np.array([]))
    if "displacement" not in columns or not t.size:
        return []
    found = quantities(run, plan, labs)
    return [
        {"storey": place + 1}
        | {name: peak(values[:, place], t, UNITS[name]) for name, values in found.items()}
        for place in range(plan.storeys)
    ]


def quantities(run: Run, plan: Plan, labs: list[LaboratoryFacts]) -> dict[str, Values]:
    """Each quantity over time and storeys, (n, storeys)."""
    columns = run.columns[MASTER]
    shape = (columns["t"].size, plan.storeys)
    displacement = columns["displacement"].reshape(shape)
    found = {"drift": np.diff(displacement, axis=1, prepend=0.0), "displacement": displacement}
    if "absolute_acceleration" in columns:
        found["absolute_acceleration"] = columns["absolute_acceleration"].reshape(shape)
    parts = [resisting(run, lab) for lab in labs if follows_drift(lab)]
    known = [part for part in parts if part is not None]
    if "numerical_force" in columns and len(known) == len(parts) and all(lab.coupling for lab in labs):
        shear = columns["numerical_force"].reshape(shape).copy()
        for place, force in known:
            shear[:, place - 1] += force
        found["shear"] = shear
    return found


def follows_drift(lab: LaboratoryFacts) -> bool:
    """Whether a laboratory's force is part of a storey's shear."""
    return lab.coupling is not None and lab.coupling.follows is Follows.DRIFT


def resisting(run: Run, lab: LaboratoryFacts) -> tuple[int, Values] | None:
    """The storey of a laboratory and the force (n,) N with which it resists there; None where it is not recorded."""
    columns, coupling = run.columns[MASTER], lab.coupling
    force = lab.channels.force if lab.topic == MASTER else lab.channels.used
    if coupling is None or force not in columns:
        return None
    values = columns[force]
    if values.ndim > 1:
        values = values[:, run.shared[force].index(lab.role)]
    return coupling.place, coupling.scale * values


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
