"""Readings that follow from commands that were recorded: not those that still depend on a gap of the data."""

from __future__ import annotations

import numpy as np

from diagnosis.recorded.parts import MODEL_ERROR, LaboratoryPart
from diagnosis.recorded.record import Record
from models.registry import Array


def with_known_commands(part: LaboratoryPart, record: Record) -> LaboratoryPart:
    """The part with its readings missing where they depend on commands that are not known.

    Straight lines stand where rows are missing. The commands are moved there by half a wave of their rms, and a reading
    counts again where the laboratory of the plan has forgotten it: to what two good solutions of one model differ by.
    """
    gaps = record.stated.gaps if record.stated else ()
    if not gaps:
        return part
    t = record.plan.test.interval * np.arange(record.ticks, dtype=np.float64)
    wave = np.sum([half_wave(t, begin, end) for begin, end in gaps], axis=0)
    moved = {name: values + np.std(values) * wave for name, values in part.inputs.items()}
    system = record.systems[part.role]
    change = np.abs(part.replaced(inputs=moved).predict(system) - part.predict(system))
    return part.replaced(present=part.present & (change <= MODEL_ERROR * part.level))


def half_wave(t: Array, begin: float, end: float) -> Array:
    """Half a sine wave (ticks,) of height one from `begin` to `end`, s."""
    inside = (t > begin) & (t < end)
    return np.where(inside, np.sin(np.pi * (t - begin) / (end - begin)), 0.0)
