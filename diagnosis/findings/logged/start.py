"""When a data logger began against the plan's ground motion, and how fast its clock ran.

A logger rarely begins with the first tick of a test. What it shows of the ground motion then lies between the ticks of
the plan's, as all its other channels do. No machine can cause that. A master reads the motion tick by tick, so that an
error of its own moves it by whole intervals.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from common.roles import MASTER
from diagnosis.recorded.record import LEAST_TICKS, LoggerStart, Record
from diagnosis.signals import clock
from diagnosis.signals.mask import Mask
from models.registry import Array

MOST = 1.0  # intervals by which a logger begins early or late: more would be a wrong start in its map
ROUNDS = 6  # of Gauss and Newton, which begin at most an interval away
NOTICED = 1e-3  # share of the motion's rms from which on a difference is worth a look
EXPLAINED = 0.5  # share of that difference which must be left at most


def begun(record: Record) -> Record:
    """An imported record with the plan's ground motion as its logger saw it, where that lies between the ticks.

    `ground` is moved by the time at which the logger began, and by what its clock gained until each tick.
    """
    name = "ground_acceleration"
    if record.stated is None or record.static or record.ground is None or not record.has(name):
        return record
    if record.ticks < LEAST_TICKS:
        return record
    interval, measured = record.plan.test.interval, record.signals[name]
    believed = record.stated.channel(MASTER, name).through(record.ground[0], interval)
    found = least(measured, believed, record.present[name])
    if found is None:
        return record
    late, fast = found
    smooth, straight = (moved(believed, found, kind)[: record.ticks] for kind in (True, False))
    smoothly = left(measured - smooth, record.present[name]) < left(measured - straight, record.present[name])
    ground = np.stack([moved(row, found, smoothly) for row in record.ground])
    blur = float(np.sqrt(np.mean(np.square(smooth - straight))))
    return replace(record, ground=ground, start=LoggerStart(late * interval, fast, blur))


def least(measured: Array, believed: Array, there: Mask) -> tuple[float, float] | None:
    """By how many ticks the recorded motion is late at the first tick, and how many more in each tick after.

    None where nothing is to be seen of it, or where that is not why the two differ.
    """
    size = float(np.sqrt(np.mean(np.square(believed))))
    before = left(measured - believed[: measured.size], there)
    if size == 0.0 or before < NOTICED * size:
        return None
    ticks = np.arange(measured.size, dtype=np.float64)
    found = np.zeros(2)
    for _ in range(ROUNDS):
        here = moved(believed, (float(found[0]), float(found[1])), smooth=False)
        slope = np.gradient(here)[: measured.size]
        columns = -np.column_stack([slope, ticks * slope])[there]
        scale = np.maximum(np.sqrt(np.mean(np.square(columns), axis=0)), 1e-300)
        found += np.linalg.lstsq(columns / scale, (measured - here[: measured.size])[there])[0] / scale
    late, fast = float(found[0]), float(found[1])
    if max(abs(late), abs(late + fast * measured.size)) > MOST or abs(fast) > clock.MOST:
        return None
    after = left(measured - moved(believed, (late, fast), smooth=False)[: measured.size], there)
    return (late, fast) if after < EXPLAINED * before else None


def moved(values: Array, found: tuple[float, float], smooth: bool) -> Array:
    """Values at the ticks that come `found` later: by so many ticks at the first one, and so many more at each after.

    On straight lines between the ticks, or `smooth` on a cubic spline, as what a converter makes of them.
    """
    ticks = np.arange(values.size, dtype=np.float64)
    places = np.clip(ticks - (found[0] + found[1] * ticks), 0.0, values.size - 1.0)
    if smooth:
        return np.asarray(CubicSpline(ticks, values)(places))
    return np.asarray(np.interp(places, ticks, values))


def left(residual: Array, there: Mask) -> float:
    """Rms of a residual where there is one."""
    return math.sqrt(float(np.mean(np.square(residual[there])))) if there.any() else 0.0
