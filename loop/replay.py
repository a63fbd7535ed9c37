"""Replay of one part: its model computes the readings for recorded inputs.

Reading k is taken before the command of tick k acts, as in the test.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from laboratories.column import model as column_lab
from laboratories.column import specimen
from laboratories.column.specimen import Specimen
from laboratories.kind import Kind
from laboratories.sensors import readings
from laboratories.sensors.readings import Readings
from loop import assembly, site, substructure
from loop.site import Site
from loop.substructure import Substructure
from models.compiled import jit
from models.registry import Array
from models.system import System


def laboratory(
    kind: Kind, system: System, drive: Array, start: float = 0.0, anew: Array | None = None
) -> Array:
    """Readings (ticks, channels) of a laboratory without noise under its commands, from rest.

    `drive` (ticks, 2) holds the transfer system's command (m) and a motor's (N), zero for a kind without one. `start`
    is a constant command (m) before the first tick, whose steady state is the initial one. `anew` (m, 3) holds
    ascending ticks at which the kind's free motion is set to a position (m) and a rate (m/s).
    """
    return read(kind, system, motion(kind, system, drive, start, anew))


def motion(
    kind: Kind, system: System, drive: Array, start: float = 0.0, anew: Array | None = None, steps: int = 0
) -> Array:
    """What sensors without error would read, (ticks, channels), as `laboratory`; the same for any sensors.

    With `steps` an interval is played in so many, and the command of a tick is reached there: a logger sampled it.
    """
    if steps > 0:
        return motion(kind, *sampled(system, drive, anew, start, steps))[::steps]
    ticks, interval = drive.shape[0], system.plan.test.interval
    played = silent(kind, system.unread, ticks)
    if start != 0.0:
        kind.settle(played.lab, played.truth, start, interval)
    begun = np.zeros((0, 3)) if anew is None else anew
    begun = begun[begun[:, 0] < ticks]
    borders = [0, *begun[:, 0].astype(int).tolist(), ticks]
    site.play(played, drive, interval, 0, borders[1])
    for place, (_, position, rate) in enumerate(begun.tolist(), 1):
        kind.resume(played.lab, played.truth, position, rate)
        site.play(played, drive, interval, borders[place], borders[place + 1])
    return played.measured


def sampled(
    system: System, drive: Array, anew: Array | None, start: float, steps: int
) -> tuple[System, Array, float, Array | None]:
    """System, commands, start and beginnings, as `motion` takes them, of commands that a logger sampled.

    Between its rows they go on a cubic spline. The transfer system's command goes straight to its value at the end of
    each of the `steps` of an interval, and a motor's is held at that in the middle, with a single step at the row's.
    """
    test, ticks = system.plan.test, len(drive)
    plan = replace(system.plan, test=replace(test, interval=test.interval / steps))
    places = np.arange((ticks - 1) * steps + 1, dtype=np.float64)
    spline = CubicSpline(np.arange(ticks), drive)
    ahead = (1.0, 0.0 if steps == 1 else 0.5)
    rows = [spline(np.minimum((places + part) / steps, ticks - 1))[:, k] for k, part in enumerate(ahead)]
    begun = None if anew is None else anew * np.array([steps, 1.0, 1.0])
    return replace(system, plan=plan), np.column_stack(rows), start, begun


def read(kind: Kind, system: System, values: Array) -> Array:
    """Readings without noise of what sensors without error would read, both (ticks, channels)."""
    if not system.effects.sensors:
        return values.copy()
    interval, result = system.plan.test.interval, np.empty(values.shape)
    play_readings(
        readings.build(interval, kind.channels.names, system.effects.sensors), values, interval, result
    )
    return result


def silent(kind: Kind, system: System, ticks: int) -> Site:
    """A laboratory at rest whose sensors are free of noise."""
    return site.build(kind, system, site.errors(kind, system, ticks))


def column(system: System, deformation: Array) -> Array:
    """Force readings (ticks,) of the specimen without noise for its true deformation (ticks,) m at the ticks.

    The forces of a mass and of dashpots beside the specimen follow from central differences, because a motion that is
    linear between ticks has no acceleration, and its rate is that of half an interval before.
    """
    force, result = np.empty(deformation.size), np.empty((deformation.size, 1))
    interval, effects, column = system.plan.test.interval, system.effects, system.plan.column
    sensors = readings.build(interval, ("column_force",), effects.sensors)
    steps = column_lab.substeps(interval) if specimen.depends_on_steps(effects.column) else 1
    parts = specimen.without_rates(column, effects.column)
    play_column(parts, deformation, interval, steps, force)
    whole = specimen.with_rates(column, effects.column, force, deformation, interval)
    play_readings(sensors, whole.reshape(-1, 1), interval, result)
    return result[:, 0]


def building(
    system: System, ground: Array, displacement: Array, force: Array, dampers: Array
) -> dict[str, Array]:
    """The signals that the building computes from the measurements (ticks,) used, by name.

    `dampers` are the dampers' forces (N) used, (ticks,), or (ticks, slaves) where there are several.
    """
    arrays = assembly.build(system.plan, ground, system.effects.p_delta)
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
def play_readings(sensors: Readings, values: Array, interval: float, result: Array) -> None:
    """Fill `result` (ticks, channels) with the sensors' readings of the values (ticks, channels)."""
    for tick in range(values.shape[0]):
        for channel in range(values.shape[1]):
            result[tick, channel] = readings.step(
                sensors, channel, values[tick, channel], 0.0, tick * interval
            )


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
