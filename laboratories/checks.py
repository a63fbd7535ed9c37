"""The checks of a tick in one compiled call: limits of values and of changes, lasting errors, frozen sensors.

NaN is beyond every limit, also beyond an infinite one. Changes and repetitions are found by comparison with values of
earlier ticks, which the arrays keep, so every tick must be checked exactly once.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from models.compiled import jit
from models.registry import Array

Numbers = npt.NDArray[np.int64]

NONE = -1.0  # in place of a limit: the value is not checked
FINE = -1  # returned by `look` where all values are within their limits


# Consecutive intervals for which an error must be beyond its limit to count: one or two late messages cause an error of
# one or two intervals.
PATIENCE = 3
# A sensor is judged when the command has moved by this many times its nominal noise (rms): two readings then differ by
# ten standard deviations.
TRAVEL = 10.0

COMMANDS, CHANGES, POSITION, COUNT = range(4)  # places in `places`
VALUE, MOST = range(2)  # rows of `values`
# places in `scalars`; from ALONE on, for each part of the rig, whether all its sensors are judged and none repeats a
# value
INTERVAL, LASTED, ALONE = range(3)
# rows of `commands`: the command written to the rig, the newest one taken, and its difference from the one before
WRITTEN, LAST, CHANGE = range(3)
FRESH = -1  # the last column: whether the command in the row WRITTEN has not been taken yet
STEP, VELOCITY, ACCELERATION, RATES = range(4)  # places of a command's changes, and their number
# columns of `watched`: index of a reading, of the command that moves it, and of the part of the rig
READ, DRIVE, PART = range(3)
NOISE, REACH, FINEST, READING, SAME, LOW, HIGH, BEFORE = range(8)  # columns of `sensors`


class Checks(NamedTuple):
    """The values of a tick, their limits, and the memory of the checks."""

    # (2, n): the values that the caller fills in at every tick, changes of commands and the error; and their limits.
    # A violation is reported in this order.
    values: Array
    places: Numbers  # (4,): index in `values` of commands, their changes and the position; readings of a frozen sensor
    scalars: Array  # (2 + parts,) interval (s), intervals in a row with an error beyond its limit, ALONE
    commands: Array  # (3, drives + 1)
    watched: Numbers  # (sensors, 3)
    sensors: Array  # (sensors, 8)


def sensors(noise: Array, reach: Array) -> Array:
    """Sensors (n, 8) before their first reading, with nominal `noise` (rms) and the motion `reach` that judges each."""
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
    """Index of the first value of a tick that exceeds its limit; FINE where none does.

    An index beyond the values is that of a frozen sensor. `target` (m) is the target of the measured position.
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
    """Take the command that was written since the last tick, if there is one."""
    commands = checks.commands
    if commands[WRITTEN, FRESH] != 0.0:
        for drive in range(commands.shape[1] - 1):
            commands[CHANGE, drive] = commands[WRITTEN, drive] - commands[LAST, drive]
            commands[LAST, drive] = commands[WRITTEN, drive]
        commands[WRITTEN, FRESH] = 0.0


@jit
def compare_commands(checks: Checks) -> None:
    """Compute step, velocity and acceleration of each command from the last ones written.

    A rig begins at rest at zero.
    """
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
    """Compute the error between target and position, the last value; it is zero until it has lasted for `PATIENCE`."""
    values, most, scalars = checks.values[VALUE], checks.values[MOST], checks.scalars
    place = values.size - 1
    if most[place] == NONE:
        return
    error = target - values[checks.places[POSITION]]
    scalars[LASTED] = 0.0 if abs(error) <= most[place] else scalars[LASTED] + 1.0
    values[place] = error if scalars[LASTED] >= PATIENCE else 0.0


@jit
def still(checks: Checks) -> int:
    """Index of the first frozen sensor, which repeats a value while its command moves; FINE for none."""
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
    """Update the smallest step that each sensor of a part has shown, and its present run of equal readings."""
    alone = True
    for sensor in range(checks.sensors.shape[0]):
        state, read = checks.sensors[sensor], checks.watched[sensor]
        if read[PART] != part:
            continue
        reading, command = checks.values[VALUE, read[READ]], checks.commands[LAST, read[DRIVE]]
        if (
            checks.scalars[ALONE + part] != 0.0
        ):  # all its readings differed so far, so a run begins with the last one
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
    """Begin a run of equal readings."""
    state[READING], state[SAME] = reading, 1.0
    state[LOW], state[HIGH] = command, command
