"""What the residuals of a part may follow from, and how much of them a flexible model of that foresees."""

from __future__ import annotations

import numpy as np

from diagnosis.fits.residuals import Data
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.parts import LaboratoryPart, Part
from diagnosis.signals.predictors.ceiling import Crosswise
from diagnosis.signals.predictors.features import features
from models.registry import Array
from models.system import System

LEAST = 4.0  # s of a recording without which no flexible model is asked


def inputs(part: Part, system: System) -> Array:
    """What a part's residuals may depend on, (ticks, inputs): its commands and its readings as predicted.

    Targets stand in for the commands of transfer systems: these hold noise that a controller fed back. A
    building's own motion, without the noise of forces in it, stands in for what is predicted from that noise.
    """
    columns = dependencies(part, system)
    return columns[:, np.ptp(columns, axis=0) > 0.0]


def dependencies(part: Part, system: System) -> Array:
    """The inputs with those that stand still."""
    if isinstance(part, JoinedPart):
        return np.concatenate([dependencies(piece, system) for piece in part.pieces])
    if isinstance(part, LoggedBuilding):
        return np.column_stack([part.ground, part.smooth])
    if isinstance(part, LaboratoryPart):
        columns = list(part.wanted.values())
        part = part.replaced(inputs=part.inputs | part.wanted)
    else:
        columns = [part.inputs] if isinstance(part, ColumnAlone) else []
    return np.column_stack([*columns, *np.nan_to_num(part.predict(system)).T])


def motions(moving: Array) -> Array:
    """Inputs (ticks, inputs) from where they begin, with their slopes and bends beside them, (ticks, 3·inputs)."""
    begun = moving - moving[0]
    slope = np.gradient(begun, axis=0)
    return np.asarray(np.concatenate([begun, slope, np.gradient(slope, axis=0)], axis=1))


def related(data: Data, system: System) -> Crosswise | None:
    """A flexible model of averaged residuals from the part's inputs, None where too little was recorded for one."""
    columns = [data.averaged(values) for values in inputs(data.part, system).T]
    interval = data.system.plan.test.interval * data.group
    if not columns or data.groups * interval < LEAST:
        return None
    everywhere = np.ones(data.groups, dtype=bool)
    return Crosswise(features(np.column_stack(columns), interval, everywhere, timeless=True))


def predictable(data: Data, averaged: Array) -> Array:
    """What of averaged residuals (groups, signals) follows from the part's inputs, stretch by stretch unseen."""
    if data.related is None or data.related.count != len(averaged):
        return np.zeros_like(averaged)
    return data.related.predict(averaged / data.sigma) * data.sigma
