"""A plan's building cut in two: whole matrices, the specimen's drift, and what its path costs in damping."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from common.plan import Plan
from models import indicators
from models.structures import shear_building


def matrices(plan: Plan) -> tuple[Any, Any, Any]:
    """Mass, damping and stiffness of the whole building, specimen included."""
    structure = plan.structure
    return shear_building.matrices(
        np.array(structure.mass), np.array(structure.stiffness), np.array(structure.damping)
    )


def drift_direction(plan: Plan) -> Any:
    """The specimen's storey drift as a row over the floors' displacements."""
    storey = plan.column.storey - 1
    direction = np.zeros(plan.storeys)
    direction[storey] = 1.0
    if storey > 0:
        direction[storey - 1] = -1.0
    return direction


def experimental_stiffness(plan: Plan) -> float:
    """Storey stiffness that comes from the laboratory, N/m."""
    column = plan.column
    return column.deformation_ratio * column.represents * column.stiffness


def damping_lost(plan: Plan, path: indicators.FrequencyEvaluation) -> float:
    """Damping ratio of the building's first mode that an amplitude and a delay of the column's path cost."""
    modes = shear_building.modes(*matrices(plan))
    omega = 2.0 * math.pi / float(modes.periods[0])
    share = experimental_stiffness(plan) * float(drift_direction(plan) @ modes.shapes[:, 0]) ** 2
    lost, _ = indicators.damping_equivalent(share, path.amplitude, path.delay, omega)
    return indicators.damping_points(lost, 1.0, omega**2)
