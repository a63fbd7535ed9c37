"""What of a part's residuals no model of the part could explain: lines, spikes, and what inputs do not foresee."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from diagnosis.fits import residuals
from diagnosis.fits.noise.inputs import predictable
from diagnosis.fits.residuals import Data
from diagnosis.recorded.joined import JoinedPart
from diagnosis.recorded.parts import Part
from diagnosis.signals.mask import Mask
from diagnosis.signals.noise import pickup
from diagnosis.signals.noise.spikes import spikes
from models.registry import Array
from models.system import System


class Remainder(NamedTuple):
    """What of a part's residuals no model of the part could explain."""

    noise: Array  # (groups, signals) averaged, in the signals' units
    single: Array  # (groups·group, signals) sample by sample
    lines: Array  # (ticks, signals)
    found: tuple[tuple[pickup.Pickup, ...], ...]  # by signal
    spikes: Mask  # (ticks, signals)


def remainder(data: Data, system: System) -> Remainder:
    """Lines, spikes and what inputs predict taken away from the residuals of a hypothesis.

    Lines that something moving makes are no noise, but no pickup either: a hypothesis has to explain them.
    """
    part, interval = data.part, data.system.plan.test.interval
    raw = part.measured - part.predict(system)
    there = part.present & np.isfinite(raw)
    spiky, lines = np.zeros_like(there), np.zeros_like(raw)
    found: list[tuple[pickup.Pickup, ...]] = [()] * raw.shape[1]
    for place in range(raw.shape[1]):
        if there[:, place].mean() < 0.5:
            raw[:, place] = 0.0
            continue
        whole = residuals.filled(raw[:, place], there[:, place])
        spiky[:, place] = spikes(whole) & there[:, place]
        raw[:, place] = residuals.filled(whole, ~spiky[:, place])
    for number, span in enumerate([] if data.static else spans(part)):  # rows have no frequencies
        lines[span], picked, kept = picked_up(raw[span], interval)
        raw[span] -= lines[span] + kept
        found = picked if number == 0 else found
    averaged = data.averaged(raw)
    said = predictable(data, averaged)
    single = raw[: data.groups * data.group] - np.repeat(said, data.group, axis=0) / math.sqrt(data.group)
    return Remainder(averaged - said, single, lines, tuple(found), spiky)


def spans(part: Part) -> list[slice]:
    """The ticks of each recording of a part: a line's phase is that of one recording."""
    if not isinstance(part, JoinedPart):
        return [slice(None)]
    ends = np.cumsum([0, *(len(piece.measured) for piece in part.pieces)])
    return [slice(int(a), int(b)) for a, b in itertools.pairwise(ends)]


def picked_up(raw: Array, interval: float) -> tuple[Array, list[tuple[pickup.Pickup, ...]], Array]:
    """Waves (ticks, signals) that sensors pick up of residuals of that shape, their lines, and waves that move."""
    found = [pickup.pickups(one, interval, pickup.SLOWEST) for one in raw.T]
    moving = pickup.moving(found, raw, interval)
    picked = [
        tuple(one for one in lines if one not in own and one.frequency > pickup.LOWEST)
        for lines, own in zip(found, moving, strict=True)
    ]
    waves, kept = (
        np.column_stack([pickup.waves(x, lines, interval) for x, lines in zip(raw.T, those, strict=True)])
        for those in (picked, moving)
    )
    return waves, picked, kept
