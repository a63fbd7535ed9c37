"""Noise of a part's sensors that is not as loud at all times: it grows with what they read, or comes in bursts."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from diagnosis.fits import residuals
from diagnosis.fits.noise.inputs import inputs, motions
from diagnosis.fits.noise.remainder import Remainder
from diagnosis.fits.residuals import Data
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.parts import LaboratoryPart, Part
from diagnosis.signals.noise.bursts import bursting
from diagnosis.signals.noise.growth import growing
from diagnosis.signals.noise.rounding import SHOWS
from models.registry import Array
from models.system import System

Why = Literal["grows", "bursts"]


class Unsteady(NamedTuple):
    """How loud the noise of one reading is at every tick."""

    loudness: Array  # (ticks,) with a mean square of one
    why: Why


def evened(data: Data, rest: Remainder, system: System) -> tuple[Data, Remainder]:
    """The data with how loud unsteady noise is, and the remainder as if that noise were steady."""
    data = replace(data, loudness=None)
    found = by_reading(data, rest.single, system)
    uneven = [place for place, one in enumerate(found) if one is not None]
    if not uneven:
        return data, rest
    steady = np.ones(len(data.part.measured))
    loudness = np.column_stack([steady if one is None else one.loudness for one in found])
    single = rest.single / loudness[: len(rest.single)]
    data = replace(data, loudness=loudness)
    noise = rest.noise if data.louder is None else rest.noise / data.louder
    even = rest._replace(noise=noise, single=single)
    white = data.white.copy()
    white[uneven] = data.white_part(single)[uneven]
    return residuals.measured_by(data, white), even


def by_reading(data: Data, single: Array, system: System) -> list[Unsteady | None]:
    """How loud the noise (ticks, signals) of each reading is; None where it is steady."""
    first = data.part.pieces[0] if isinstance(data.part, JoinedPart) else data.part
    if data.static or not isinstance(first, LaboratoryPart | ColumnAlone | LoggedBuilding):
        return [None] * single.shape[1]
    reading, others = readings(data.part, system), motions(inputs(data.part, system))
    sizes, interval = data.together(len(single)), data.system.plan.test.interval
    result: list[Unsteady | None] = []
    for place, one in enumerate(single.T):
        size, found = int(sizes[place]), None
        if data.live[place]:
            found = unsteady(growing(one, reading[:, place], others, size), "grows")
            if found is None and data.rounded[place] <= SHOWS * data.white[place]:
                found = unsteady(bursting(one, others, size, interval), "bursts")
        result.append(found)
    return result


def readings(part: Part, system: System) -> Array:
    """What is read by each sensor of a part, or its balance holds, from where that begins, (ticks, signals)."""
    if isinstance(part, JoinedPart):
        return np.concatenate([readings(piece, system) for piece in part.pieces])
    said = part.read if isinstance(part, LoggedBuilding) else np.nan_to_num(part.predict(system))
    return said - said[0]


def unsteady(loudness: Array | None, why: Why) -> Unsteady | None:
    """Noise of a loudness (ticks,), None where it is steady."""
    return None if loudness is None else Unsteady(loudness, why)
