"""Delay, amplitude and damping equivalent of the command path, the force path and the exchange."""

from __future__ import annotations

import numpy as np

from common.errors import InputError
from common.plan.kinds import COLUMN
from common.roles import MASTER
from diagnosis.recorded.record import Record
from diagnosis.report.evidence import ForcePathEntry, LoopPath, Paths
from loop import force_path as force
from loop.nominal.partition import damping_lost
from models import indicators
from models.indicators import FrequencyEvaluation
from models.registry import Array


def paths(record: Record, nominal: dict[str, Array] | None) -> Paths:
    """Delay, amplitude and damping of the three paths of the loop, as recorded and in the nominal simulation.

    The command path runs from the building's drift to the specimen's deformation, the force path from the deformation
    to the force that the master used, the exchange from the damper's force in its laboratory to its use.
    Delay and amplitude by Guo's frequency evaluation index, the effect in points added to the first mode's damping.
    """
    own, other = record.own, record.other
    command = force = exchange = None
    if own is not None:
        channels = own.kind.channels
        damped = (
            own.kind.coupling(own.plan).stiffness > 0.0
        )  # the damping that a delay adds is that of a stiffness
        command = path(record, nominal, channels.target.name, channels.position, damped=damped)
        if own.kind.name == COLUMN:
            force = path(record, nominal, channels.position, channels.force)
    if other is not None:
        measured = other.kind.channels
        exchange = path(record, nominal, other.signal(measured.force), measured.used, damped=False)
    return Paths(command=command, force=force, exchange=exchange)


def path(
    record: Record, nominal: dict[str, Array] | None, start: str, end: str, *, damped: bool = True
) -> LoopPath | None:
    """One path, None where it was not recorded; with its effect on the damping only where it is `damped`."""
    here = measured(record, record.signals, start, end)
    if here is None:
        return None
    there = measured(record, nominal, start, end) if nominal else None
    return LoopPath(
        delay=here.delay,
        amplitude=here.amplitude,
        damping_points=points(record, here) if damped else None,
        nominal_delay=there.delay if there else None,
        nominal_damping_points=points(record, there) if there and damped else None,
    )


def points(record: Record, path: FrequencyEvaluation) -> float:
    """Damping ratio that a path adds to the first mode, in percentage points."""
    return -100.0 * damping_lost(record.plans[MASTER], path)


def measured(record: Record, signals: dict[str, Array], start: str, end: str) -> FrequencyEvaluation | None:
    """Amplitude and delay from one signal to another, None where one is missing; forces over the stiffness."""
    if start not in signals or end not in signals or not record.has(start, end):
        return None
    target, reached = signals[start], signals[end]
    if record.own is not None and record.own.kind.name == COLUMN and end == record.own.kind.channels.force:
        reached = reached / record.plans[MASTER].column.stiffness
    try:
        return indicators.frequency_evaluation_index(
            np.asarray(target), np.asarray(reached), record.plan.test.interval
        )
    except InputError:
        return None


def force_path(record: Record) -> ForcePathEntry | None:
    """Delay (s) with its interval of 95 % and gain of the column force beside the plan's specimen, if known."""
    own = record.own
    if own is None or own.kind.name != COLUMN or not record.has("column_displacement", "column_force"):
        return None
    found = force.force_path(own.plan, record.signals["column_displacement"], record.signals["column_force"])
    return None if found is None else ForcePathEntry(**found._asdict())
