"""Noise of a part's sensors that grows with what they read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.fits import residuals
from diagnosis.fits.noise.inputs import inputs, motions
from diagnosis.fits.noise.remainder import Remainder, spans
from diagnosis.fits.residuals import Data
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals.noise.growth import growing
from models.registry import Array
from models.system import System


def evened(data: Data, rest: Remainder, system: System) -> tuple[Data, Remainder]:
    """The data with how loud noise is that grows with its reading, and the remainder as if it did not grow."""
    data = replace(data, loudness=None)
    first = data.part.pieces[0] if isinstance(data.part, JoinedPart) else data.part
    if data.static or not isinstance(first, LaboratoryPart | ColumnAlone):
        return data, rest
    found = by_reading(data, rest.single, system)
    grown = [place for place, one in enumerate(found) if one is not None]
    if not grown:
        return data, rest
    steady = np.ones(len(data.part.measured))
    loudness = np.column_stack([steady if one is None else one for one in found])
    single = rest.single / loudness[: len(rest.single)]
    data = replace(data, loudness=loudness)
    noise = rest.noise if data.louder is None else rest.noise / data.louder
    even = rest._replace(noise=noise, single=single)
    white = data.white.copy()
    white[grown] = data.white_part(single)[grown]
    return residuals.measured_by(data, white), even


def by_reading(data: Data, single: Array, system: System) -> list[Array | None]:
    """How loud the noise (ticks, signals) of each reading is at every tick (ticks,); None where it does not grow."""
    said = np.nan_to_num(data.part.predict(system))
    begun = np.concatenate([said[span] - said[span][0] for span in spans(data.part)])
    others = motions(np.column_stack([inputs(data.part, system), begun]))
    sizes = data.together(len(single))
    return [
        growing(one, begun[:, place], others, int(sizes[place])) if data.live[place] else None
        for place, one in enumerate(single.T)
    ]
