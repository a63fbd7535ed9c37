"""One part alone: recorded inputs through its model, to the readings that model would have given.

Reading k is taken before the command of tick k acts, as in the test.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models.compiled import jit
from models.labs import column_lab, readings, specimen, table_lab
from models.labs.column_lab import ColumnLab
from models.labs.readings import Readings
from models.labs.specimen import Specimen
from models.labs.table_lab import TableLab
from models.loop import substructure
from models.loop.closed_loop import MEASURED_A, MEASURED_B, build_a, build_b
from models.loop.substructure import Substructure
from models.registry import Array
from models.system import System


def laboratory_a(system: System, command: Array, start: float = 0.0) -> Array:
    """Readings (ticks, 2) of laboratory A without noise for actuator commands (ticks,) m.

    From rest at a command of `start` m that has been there for long.
    """
    result = np.empty((command.size, len(MEASURED_A)))
    interval = system.plan.test.interval
    sensors = readings.build(interval, MEASURED_A, system.effects.sensors)
    lab = build_a(system)
    if start != 0.0:
        column_lab.begin(lab, start, interval)
    play_a(lab, sensors, command, interval, result)
    return result


def laboratory_b(system: System, command: Array, motor: Array, anew: Array | None = None) -> Array:
    """Readings (ticks, 4) of laboratory B without noise for table (m) and motor (N) commands, from rest.

    `anew` (m, 3) are ticks, ascending, at which the damper begins anew with a stroke (m) and its rate (m/s).
    """
    result = np.empty((command.size, len(MEASURED_B)))
    interval = system.plan.test.interval
    sensors = readings.build(interval, MEASURED_B, system.effects.sensors)
    begun = np.zeros((0, 3)) if anew is None else anew
    play_b(build_b(system), sensors, command, motor, begun, interval, result)
    return result


def column(system: System, deformation: Array) -> Array:
    """Force readings (ticks,) of the specimen without noise for its true deformation (ticks,) m at the ticks.

    The plan's mass and dashpot move by central differences, which short steps along straight lines do not give.
    """
    force, result = np.empty(deformation.size), np.empty(deformation.size)
    interval, effects, column = system.plan.test.interval, system.effects, system.plan.column
    sensors = readings.build(interval, ("column_force",), effects.sensors)
    steps = column_lab.substeps(interval) if specimen.needs_substeps(effects.column) else 1
    parts = specimen.build(replace(column, mass=0.0, damping=0.0), effects.column)
    play_column(parts, deformation, interval, steps, force)
    play_reading(sensors, specimen.with_rates(column, force, deformation, interval), interval, result)
    return result


def building(system: System, ground: Array, displacement: Array, force: Array, damper: Array) -> Array:
    """Rows of `substructure` (ticks, 8 + 5·storeys) of a plan with one slave, for the measurements (ticks,) used."""
    arrays = substructure.build(system.plan, ground, system.effects.p_delta)
    result = np.zeros((force.size, arrays.output.size))
    play_building(arrays, displacement, force, damper, result)
    return result


@jit
def play_a(lab: ColumnLab, sensors: Readings, command: Array, interval: float, result: Array) -> None:
    """Fill `result` (ticks, 2) from the commands."""
    displacement, force = lab.state[column_lab.DISPLACEMENT], lab.state[column_lab.FORCE]
    for tick in range(command.size):
        t = tick * interval
        result[tick, 0] = readings.step(sensors, 0, displacement, 0.0, t)
        result[tick, 1] = readings.step(sensors, 1, force, 0.0, t)
        displacement, force = column_lab.advance(lab, command[tick])


@jit
def play_b(
    lab: TableLab,
    sensors: Readings,
    command: Array,
    motor: Array,
    anew: Array,
    interval: float,
    result: Array,
) -> None:
    """Fill `result` (ticks, 4) from the commands."""
    y, acceleration, stroke, force = 0.0, 0.0, 0.0, 0.0
    next_one = 0
    for tick in range(command.size):
        t = tick * interval
        if next_one < anew.shape[0] and tick == int(anew[next_one, 0]):
            stroke = anew[next_one, 1]
            lab.state[table_lab.STROKE] = stroke
            lab.state[table_lab.STROKE_RATE] = anew[next_one, 2]
            next_one += 1
        result[tick, 0] = readings.step(sensors, 0, y, 0.0, t)
        result[tick, 1] = readings.step(sensors, 1, acceleration, 0.0, t)
        result[tick, 2] = readings.step(sensors, 2, stroke, 0.0, t)
        result[tick, 3] = readings.step(sensors, 3, force, 0.0, t)
        y, acceleration, stroke, force = table_lab.advance(lab, command[tick], motor[tick])


@jit
def play_column(tested: Specimen, deformation: Array, interval: float, steps: int, result: Array) -> None:
    """Fill the forces `result` (ticks,) from the deformations, which move on straight lines between the ticks."""
    before = deformation[0]
    for tick in range(deformation.size):
        force = 0.0
        for i in range(steps):
            share = (i + 1) / steps
            reached = (1.0 - share) * before + share * deformation[tick]
            force = specimen.force(tested, reached, interval / steps)
        before = deformation[tick]
        result[tick] = force


@jit
def play_reading(sensors: Readings, values: Array, interval: float, result: Array) -> None:
    """Fill `result` (ticks,) with what the first sensor makes of the values (ticks,)."""
    for tick in range(values.size):
        result[tick] = readings.step(sensors, 0, values[tick], 0.0, tick * interval)


@jit
def play_building(
    building: Substructure, displacement: Array, force: Array, damper: Array, result: Array
) -> None:
    """Fill `result` (ticks, 8 + 5·storeys) from the measurements."""
    for tick in range(force.size):
        building.dampers[substructure.FORCE_USED, 0] = damper[tick]
        substructure.advance(building, tick, displacement[tick], force[tick])
        for place in range(building.output.size):
            result[tick, place] = building.output[place]
