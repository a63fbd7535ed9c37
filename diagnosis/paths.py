"""Delay, amplitude and damping equivalent of the command path, the force path and the exchange."""

from __future__ import annotations

from typing import Any

import numpy as np

from common.errors import InputError
from diagnosis.record import Record
from models import indicators
from models.indicators import FrequencyEvaluation
from models.labs import force_path as force
from models.registry import Array
from models.structures.partition import damping_lost


def paths(record: Record, nominal: dict[str, Array] | None) -> dict[str, dict[str, Any]]:
    """What the three paths of the loop cost, as recorded and in the nominal simulation.

    The command path runs from the building's drift to the specimen's deformation, the force path from the deformation
    to the force that the master used, the exchange from the damper's force in its laboratory to its use.
    Delay and amplitude by Guo's frequency evaluation index, the effect in points added to the first mode's damping.
    """
    result = {}
    for name, start, end in (
        ("command", "column_target", "column_displacement"),
        ("force", "column_displacement", "column_force"),
        ("exchange", "damper_force", "damper_force_used"),
    ):
        here = measured(record, record.signals, start, end)
        if here is None:
            continue
        entry: dict[str, Any] = {"delay": here.delay, "amplitude": here.amplitude}
        if name != "exchange":
            entry["damping_points"] = -100.0 * damping_lost(record.plan, here)
        there = measured(record, nominal, start, end) if nominal else None
        if there is not None:
            entry["nominal_delay"] = there.delay
            if name != "exchange":
                entry["nominal_damping_points"] = -100.0 * damping_lost(record.plan, there)
        result[name] = entry
    return result


def measured(record: Record, signals: dict[str, Array], start: str, end: str) -> FrequencyEvaluation | None:
    """Amplitude and delay from one signal to another, None where they are not there; forces per stiffness."""
    if start not in signals or end not in signals or not record.has(start, end):
        return None
    target, reached = signals[start], signals[end]
    if end == "column_force":
        reached = reached / record.plan.column.stiffness
    try:
        return indicators.frequency_evaluation_index(
            np.asarray(target), np.asarray(reached), record.plan.test.interval
        )
    except InputError:
        return None


def force_path(record: Record) -> dict[str, Any] | None:
    """Delay (s) with its interval of 95 % and gain of the column force beside the plan's specimen, if known."""
    if not record.has("column_displacement", "column_force"):
        return None
    found = force.force_path(
        record.plan, record.signals["column_displacement"], record.signals["column_force"]
    )
    return None if found is None else {**found._asdict(), "interval": list(found.interval)}
