"""The motion of a building and of the ground as a data logger's rows show them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_interp_spline

from common.recording.imported import ImportedData
from common.roles import MASTER
from diagnosis.recorded.logger.unseen import shown
from diagnosis.recorded.record import Record
from models.registry import Array

MOTION = ("displacement", "velocity", "acceleration")
GROUND = "ground_acceleration"
# Degree of the spline of which slopes at slow rows are taken: at ten rows in a period the slope of a cubic one errs by
# 0.1 %, its bend by 3 %, those of this one by 2e-7 and 2e-6.
DEGREE = 7


def of_storeys(record: Record, rows: Mapping[str, Array]) -> dict[str, Array]:
    """Displacement, velocity and acceleration of all storeys (ticks, storeys); `rows` are those that were recorded.

    What was not recorded follows from the displacement: by differences, or from slopes at the rows where these are
    slower than ticks. A velocity that such rows show without the acceleration counts as not recorded, since they take
    motion faster than half their rate for a slower one, of which a velocity has more than a displacement.
    """
    interval, seen = record.plan.test.interval, shown(record, MASTER, "displacement")
    if seen is None or seen.size <= DEGREE:
        return differences(rows["displacement"], interval) | dict(rows)
    found = slopes(rows["displacement"], seen, interval)
    return found | dict(rows) if MOTION[-1] in rows else found


def slopes(displacement: Array, seen: NDArray[np.int64], interval: float) -> dict[str, Array]:
    """Displacements (ticks, storeys), and their slopes at the ticks `seen`, on cubic splines between these."""
    when, found = seen * interval, {MOTION[0]: displacement}
    smooth = make_interp_spline(when, displacement[seen], k=DEGREE)
    for order, name in enumerate(MOTION[1:], 1):
        spline = CubicSpline(when, smooth.derivative(order)(when))
        found[name] = np.asarray(spline(interval * np.arange(len(displacement))))
    return found


def differences(displacement: Array, interval: float) -> dict[str, Array]:
    """Displacements (ticks, storeys), and velocities and accelerations by central differences.

    These are the explicit Newmark method's own; others differ from them by the share (ω·interval)²/12.
    """
    velocity = np.gradient(displacement, interval, axis=0)
    bends = np.diff(displacement, 2, axis=0) / interval**2
    return {
        "displacement": displacement,
        "velocity": velocity,
        "acceleration": np.pad(bends, ((1, 1), (0, 0)), mode="edge"),
    }


def of_ground(record: Record) -> Array:
    """The recorded ground acceleration (ticks,), between the ticks that rows showed as the motion is there.

    An import follows the plan's ground motion between these, and has all other numbers of the master by a cubic spline.
    Equations of motion hold of what they all are by one. An acceleration that follows from slow displacements has none
    of the ground's motion above half the rate of the rows.
    """
    values, seen = record.signals[GROUND], shown(record, MASTER, GROUND)
    channel = (record.stated or ImportedData("")).channel(MASTER, GROUND)
    if not channel.followed or seen is None:
        return values
    if not record.has(MOTION[-1]):
        values = slower(values, 0.5 * channel.rate * record.plan.test.interval)
    return np.asarray(CubicSpline(seen, values[seen])(np.arange(record.ticks)))


def slower(values: Array, highest: float) -> Array:
    """Values (ticks,) without what is faster than `highest`, periods in a tick; they turn back at both ends."""
    lines = np.fft.rfft(np.concatenate([values, values[::-1]]))
    lines[np.fft.rfftfreq(2 * values.size) > highest] = 0.0
    return np.asarray(np.fft.irfft(lines, 2 * values.size)[: values.size])
