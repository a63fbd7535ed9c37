"""One part alone: recorded inputs through its model, to the readings that model would have given.

Reading k is taken before the command of tick k acts, as in the test.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from laboratories.column import model as column_lab
from laboratories.column import specimen
from laboratories.column.kind import COLUMN
from laboratories.column.specimen import Specimen
from laboratories.kind import Kind
from laboratories.sensors import readings
from laboratories.sensors.readings import Readings
from laboratories.table import model as table_lab
from laboratories.table.kind import TABLE
from loop import site, substructure
from loop.site import Site
from loop.substructure import Substructure
from models.compiled import jit
from models.registry import Array
from models.system import System

STROKE = TABLE.channels.names.index("damper_stroke")  # channel


def laboratory_a(system: System, command: Array, start: float = 0.0) -> Array:
    """Readings (ticks, 2) of laboratory A without noise for actuator commands (ticks,) m.

    From rest at a command of `start` m that has been there for long.
    """
    interval, played = system.plan.test.interval, silent(COLUMN, system, command.size)
    if start != 0.0:
        column_lab.begin(played.lab, start, interval)
        played.truth[:] = played.lab.state[[column_lab.DISPLACEMENT, column_lab.FORCE]]
    site.play(played, np.stack([command, np.zeros_like(command)], axis=1), interval, 0, command.size)
    return played.measured


def laboratory_b(system: System, command: Array, motor: Array, anew: Array | None = None) -> Array:
    """Readings (ticks, 4) of laboratory B without noise for table (m) and motor (N) commands, from rest.

    `anew` (m, 3) are ticks, ascending, at which the damper begins anew with a stroke (m) and its rate (m/s).
    """
    interval, played = system.plan.test.interval, silent(TABLE, system, command.size)
    drive, state = np.stack([command, motor], axis=1), played.lab.state
    begun = np.zeros((0, 3)) if anew is None else anew
    begun = begun[begun[:, 0] < command.size]
    borders = [0, *begun[:, 0].astype(int).tolist(), command.size]
    site.play(played, drive, interval, 0, borders[1])
    for place, (_, stroke, rate) in enumerate(begun.tolist(), 1):
        state[table_lab.STROKE], state[table_lab.STROKE_RATE] = stroke, rate
        played.truth[STROKE] = stroke
        site.play(played, drive, interval, borders[place], borders[place + 1])
    return played.measured


def silent(kind: Kind, system: System, ticks: int) -> Site:
    """A laboratory at rest whose sensors are free of noise."""
    return site.build(kind, system, site.errors(kind, system, ticks))


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


def building(
    system: System, ground: Array, displacement: Array, force: Array, dampers: Array
) -> dict[str, Array]:
    """What the building computes, by signal, for the measurements (ticks,) used.

    `dampers` are the dampers' forces (N) used, (ticks,), or (ticks, slaves) where there are several.
    """
    arrays = substructure.build(system.plan, ground, system.effects.p_delta)
    result = np.zeros((force.size, arrays.output.size))
    roles = system.plan.roles
    play_building(arrays, displacement, force, dampers.reshape(force.size, len(roles)), result)
    return substructure.named(result, system.plan, roles)


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
    building: Substructure, displacement: Array, force: Array, dampers: Array, result: Array
) -> None:
    """Fill the output rows `result` (ticks, width) from the measurements."""
    for tick in range(force.size):
        for slave in range(dampers.shape[1]):
            substructure.receive(building, slave, dampers[tick, slave])
        substructure.advance(building, tick, displacement[tick], force[tick])
        for place in range(building.output.size):
            result[tick, place] = building.output[place]
