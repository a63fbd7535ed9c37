"""The checks of a tick in one compiled call: limits of values and changes, errors that last, frozen sensors.

NaN is beyond any limit, and nothing else is beyond an infinite one. What changes and repeats is compared with what the
ticks before have left in the arrays, so that every tick must be checked exactly once.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from models.compiled import jit
from models.registry import Array

Numbers = npt.NDArray[np.int64]

NONE = -1.0  # in place of a limit: the value is not checked
FINE = -1  # what `look` returns where all is well

# intervals in a row by which an error must be beyond its limit: a message or two that is late makes one for a moment
PATIENCE = 3
# by so many times its nominal noise a command has moved: the reading must then differ beyond any doubt
TRAVEL = 10.0

COMMANDS, CHANGES, POSITION, COUNT = range(4)  # places in `places`
VALUE, MOST = range(2)  # rows of `values`
# places in `scalars`: of every part of the rig from ALONE on whether its sensors are all known, and none repeats itself
INTERVAL, LASTED, ALONE = range(3)
# rows of `commands`: what the rig was given, the newest that was taken note of, and how it differed from the one before
WRITTEN, LAST, CHANGE = range(3)
FRESH = -1  # the last column: whether the command in the row WRITTEN has not been taken note of
STEP, VELOCITY, ACCELERATION, RATES = range(4)  # how a command's changes stand one after the other
# columns of `watched`: place of a reading, of the command that moves it, and of the part of the rig
READ, DRIVE, PART = range(3)
NOISE, REACH, FINEST, READING, SAME, LOW, HIGH, BEFORE = range(8)  # columns of `sensors`


class Checks(NamedTuple):
    """What a tick's values are compared with, in the order in which a violation is reported."""

    # what the caller fills in every tick, then changes of commands and the error; their limits: (2, n)
    values: Array
    places: Numbers  # (4,) of commands, of their changes and of the position in `values`; readings too many
    scalars: Array  # (2 + parts,) interval (s), intervals in a row with an error beyond its limit, ALONE
    commands: Array  # (3, drives + 1)
    watched: Numbers  # (sensors, 3)
    sensors: Array  # (sensors, 8)


def sensors(noise: Array, reach: Array) -> Array:
    """Sensors without a reading yet, with their nominal rms `noise` and how far a command must move to judge each."""
    found = np.zeros((noise.size, 8))
    found[:, NOISE], found[:, REACH] = noise, reach
    found[:, FINEST] = np.where(noise > 0.0, np.inf, -np.inf)
    found[:, READING], found[:, SAME] = np.nan, 1.0
    return found


@jit
def enter(checks: tuple[Any, ...], target: float) -> int:
    """`look` for a caller outside compiled code, which holds the checks as `compiled.plain` gives them."""
    return look(Checks(*checks), target)


@jit
def look(checks: Checks, target: float) -> int:
    """Where the first value of a tick is that exceeds its limit, or behind all values a frozen sensor; FINE for none.

    `target` (m) is what the measured position should be.
    """
    values, most = checks.values[VALUE], checks.values[MOST]
    take_written(checks)
    compare_commands(checks)
    last(checks, target)
    frozen = still(checks)
    for place in range(values.size):
        if most[place] != NONE and not abs(values[place]) <= most[place]:
            return place
    return values.size + frozen if frozen != FINE else FINE


@jit
def take_written(checks: Checks) -> None:
    """Take note of the command that was written since the last tick, where one was."""
    commands = checks.commands
    if commands[WRITTEN, FRESH] != 0.0:
        for drive in range(commands.shape[1] - 1):
            commands[CHANGE, drive] = commands[WRITTEN, drive] - commands[LAST, drive]
            commands[LAST, drive] = commands[WRITTEN, drive]
        commands[WRITTEN, FRESH] = 0.0


@jit
def compare_commands(checks: Checks) -> None:
    """How the commands differ from the last ones that were written; a rig begins at rest in its zero."""
    values, places, commands = checks.values[VALUE], checks.places, checks.commands
    interval = checks.scalars[INTERVAL]
    for drive in range(commands.shape[1] - 1):
        change = values[places[COMMANDS] + drive] - commands[LAST, drive]
        first = places[CHANGES] + RATES * drive
        values[first + STEP] = change
        values[first + VELOCITY] = change / interval
        values[first + ACCELERATION] = (change - commands[CHANGE, drive]) / (interval * interval)


@jit
def last(checks: Checks, target: float) -> None:
    """The error between target and position, the last of the values; none before it has lasted for `PATIENCE`."""
    values, most, scalars = checks.values[VALUE], checks.values[MOST], checks.scalars
    place = values.size - 1
    if most[place] == NONE:
        return
    error = target - values[checks.places[POSITION]]
    scalars[LASTED] = 0.0 if abs(error) <= most[place] else scalars[LASTED] + 1.0
    values[place] = error if scalars[LASTED] >= PATIENCE else 0.0


@jit
def still(checks: Checks) -> int:
    """The first sensor that gives one value again and again while its command moves, FINE for none."""
    values, scalars = checks.values[VALUE], checks.scalars
    for part in range(scalars.size - ALONE):
        differ = True
        for sensor in range(checks.sensors.shape[0]):
            if checks.watched[sensor, PART] == part:
                reading = values[checks.watched[sensor, READ]]
                differ = differ and reading != checks.sensors[sensor, BEFORE]
        if scalars[ALONE + part] == 0.0 or not differ:
            compare_readings(checks, part)
    found = FINE
    for sensor in range(checks.sensors.shape[0]):
        state = checks.sensors[sensor]
        state[BEFORE] = values[checks.watched[sensor, READ]]
        judged = 0.0 < state[FINEST] < state[NOISE]
        repeats = state[SAME] >= checks.places[COUNT]
        if found == FINE and judged and repeats and state[HIGH] - state[LOW] > state[REACH]:
            found = sensor
    return found


@jit
def compare_readings(checks: Checks, part: int) -> None:
    """Keep the finest step that each sensor of a part has shown, and count its present run of equal readings."""
    alone = True
    for sensor in range(checks.sensors.shape[0]):
        state, read = checks.sensors[sensor], checks.watched[sensor]
        if read[PART] != part:
            continue
        reading, command = checks.values[VALUE, read[READ]], checks.commands[LAST, read[DRIVE]]
        if checks.scalars[ALONE + part] != 0.0:  # no command has moved it since
            begin(state, state[BEFORE], command)
        if reading == state[READING]:
            state[SAME] += 1.0
            state[LOW], state[HIGH] = min(state[LOW], command), max(state[HIGH], command)
        else:
            change = abs(reading - state[READING])
            if 0.0 < change < state[FINEST]:  # the change at the first reading is NaN and gives no step
                state[FINEST] = change
            begin(state, reading, command)
        judged = 0.0 < state[FINEST] < state[NOISE]
        alone = alone and state[SAME] == 1.0 and (judged or state[NOISE] <= 0.0)
    checks.scalars[ALONE + part] = 1.0 if alone else 0.0


@jit
def begin(state: Array, reading: float, command: float) -> None:
    """A run of equal readings begins."""
    state[READING], state[SAME] = reading, 1.0
    state[LOW], state[HIGH] = command, command
