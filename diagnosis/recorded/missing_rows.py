"""Readings that follow from commands that were recorded: not those that still depend on a gap of the data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from diagnosis.recorded.parts import MODEL_ERROR, LaboratoryPart, Part
from diagnosis.recorded.record import Record
from diagnosis.signals.mask import Mask
from models.registry import Array

USUALLY = 0.95  # of the lines over as long a time, which miss no more than a line over a gap is taken to
FEWEST = 20  # times a half of a gap that a command must last, for that to be known
LEAST = 0.5  # of the ticks, at which a reading must count for its noise to be known


def with_known_commands(part: LaboratoryPart, record: Record) -> LaboratoryPart:
    """The part with its readings missing where they depend on commands that are not known.

    Straight lines stand where rows are missing. The commands are moved there by half a wave as high as what such lines
    miss elsewhere, and a reading counts again once the laboratory of the plan has forgotten it, to what two good
    solutions of one model differ by: not where a motion that it still swings with passes zero.
    """
    gaps = record.stated.gaps if record.stated else ()
    if not gaps:
        return part
    t = record.plan.test.interval * np.arange(record.ticks, dtype=np.float64)
    moved = {
        name: values + np.sum([missed(values, t, *gap) * half_wave(t, *gap) for gap in gaps], axis=0)
        for name, values in part.inputs.items()
    }
    system = record.systems[part.role]
    change = np.abs(part.replaced(inputs=moved).predict(system) - part.predict(system))
    known = [
        remembered(t, [begin for begin, _ in gaps], one) for one in (change > MODEL_ERROR * part.level).T
    ]
    present = part.present & ~np.stack(known, axis=1)
    present[:, present.mean(axis=0) < LEAST] = False
    return part.replaced(present=present)


def missed(values: Array, t: Array, begin: float, end: float) -> float:
    """What a straight line over a gap from `begin` to `end` (s) may miss of a command (ticks,): at most its rms.

    In the middle of as long a time elsewhere all but a twentieth of such lines miss no more.
    """
    half, most = max(1, math.ceil(0.5 * (end - begin) / (t[1] - t[0]) - 1e-6)), float(np.std(values))
    if values.size < FEWEST * half:
        return most
    middle = values[half:-half] - 0.5 * (values[: -2 * half] + values[2 * half :])
    return min(most, float(np.quantile(np.abs(middle), USUALLY)))


def without_readings(parts: Sequence[Part], record: Record) -> list[str]:
    """The readings that were recorded and count nowhere, as their laboratory remembers a gap for too long."""
    return [
        name
        for part in parts
        if isinstance(part, LaboratoryPart)
        for name, there in zip(part.signals, part.present.T, strict=True)
        if record.has(name) and not there.any()
    ]


def unjudged(parts: Sequence[Part], record: Record) -> list[str]:
    """A sentence on readings that count nowhere, as their laboratory remembers a gap for too long."""
    names = without_readings(parts, record)
    if not names:
        return []
    return [
        f"{', '.join(names)}: their laboratory remembers commands that the rows missing held for most of the test, so "
        "that they are not judged. Import the time before or behind the gap by itself (start, stop)."
    ]


def remembered(t: Array, begins: Sequence[float], changed: Mask) -> Mask:
    """From where each gap begins to the last tick (ticks,) before the next one at which it has `changed` a reading."""
    result = np.zeros(t.size, dtype=bool)
    for begin, end in pairwise([*begins, math.inf]):
        here = np.flatnonzero(changed & (t > begin) & (t <= end))
        if here.size:
            result[here[0] : here[-1] + 1] = True
    return result


def half_wave(t: Array, begin: float, end: float) -> Array:
    """Half a sine wave (ticks,) of height one from `begin` to `end`, s."""
    inside = (t > begin) & (t < end)
    return np.where(inside, np.sin(np.pi * (t - begin) / (end - begin)), 0.0)
