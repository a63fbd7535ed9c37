"""Whether the forces beyond the matrices are the same all over a segment, so that shorter ones would say the same."""

from __future__ import annotations

from laboratories.column.model import SUBSTEP
from laboratories.table.forces import rubbing, with_forces
from laboratories.table.linear import BASE_RATE, INPUTS, STROKE, STROKE_RATE, TABLE_RATE
from laboratories.table.record import (
    BRISTLES,
    FRICTION,
    PLAY,
    PLAYED,
    PRESLIDING,
    SHAPE,
    STOP,
    STOP_STIFFNESS,
    TABLE_BRISTLES,
    TABLE_FRICTION,
    TABLE_PRESLIDING,
    TABLE_SHAPE,
    TABLE_VELOCITY,
    VELOCITY,
    TableLab,
)
from models.compiled import jit
from models.registry import Array

# Share of a friction by which it may change over a segment. With it, frictions that depend on speed or on bristles err
# no more than with usual segments throughout (compared with segments of 8 µs), in half the time.
EVEN = 0.005
RESTING = 1e-9  # m/s, below which a part that friction holds is at rest
ROUNDED = 1e-12  # m


@jit
def steady(
    columns: Array,
    lab: TableLab,
    length: float,
    bristles: tuple[float, float],
    played: float,
    moved: float,
) -> bool:
    """Whether the forces that `resist` has found hold all over a segment of `length` s.

    `bristles` (N of the rail, m/s² of the bearings) and `played` (m) are those at its beginning, and `moved` (m) is the
    way of the table's command.
    """
    limits, state, size = lab.limits, lab.state, columns.shape[0] - INPUTS
    usual = length < 1.001 * SUBSTEP
    if limits[PLAY] > 0.0 and not usual:
        way = state[size + INPUTS + PLAYED] - played
        if way != 0.0 and abs(way - moved) > ROUNDED:
            return False
    if limits[STOP_STIFFNESS] > 0.0 and not usual and touches(columns, lab):
        return False
    if limits[TABLE_FRICTION] > 0.0:
        base = BASE_RATE if size > BASE_RATE else TABLE_RATE
        bent = state[size + INPUTS + TABLE_BRISTLES] - bristles[1] if limits[TABLE_PRESLIDING] > 0.0 else 0.0
        if abs(bent) > EVEN * limits[TABLE_FRICTION] or not slides(
            columns, lab, base, TABLE_SHAPE, limits[TABLE_VELOCITY], usual
        ):
            return False
    if limits[FRICTION] == 0.0:
        return True
    bent = state[size + INPUTS + BRISTLES] - bristles[0] if limits[PRESLIDING] > 0.0 else 0.0
    if abs(bent) > EVEN * limits[FRICTION]:
        return False
    return slides(columns, lab, STROKE_RATE, SHAPE, limits[VELOCITY], usual)


@jit
def touches(columns: Array, lab: TableLab) -> bool:
    """Whether the damper is beyond an end stop at a segment's beginning, middle or end."""
    begin, stop = lab.state[STROKE], lab.limits[STOP]
    middle = begin + 0.5 * columns[STROKE_RATE, STROKE] * lab.state[STROKE_RATE]
    end = with_forces(columns, lab.state, lab.free, STROKE)
    return bool(max(abs(begin), abs(middle), abs(end)) > stop)


@jit
def slides(columns: Array, lab: TableLab, rate: int, shape: int, velocity: float, usual: bool) -> bool:
    """Whether a part slides one way all over a segment under a friction that hardly changes.

    Over a usual segment it may also rest: over a long one it creeps while the force changes that holds it.
    """
    limits, begin = lab.limits, lab.state[rate]
    end = with_forces(columns, lab.state, lab.free, rate)
    if min(abs(begin), abs(end)) < RESTING:
        return bool(usual and max(abs(begin), abs(end)) < RESTING)
    if begin * end < 0.0:
        return False
    change = rubbing(limits, shape, end, velocity) - rubbing(limits, shape, begin, velocity)
    return bool(abs(change) <= EVEN)
