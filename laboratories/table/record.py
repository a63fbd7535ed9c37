"""What the laboratory of the kind table holds between two ticks: its constants, its states, and their places."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from models.registry import Array

Whole = npt.NDArray[np.int64]  # whole numbers: places of something in an array

# places in `limits`
PRESENT, TABLE_GAIN, PLAY, TABLE_FRICTION, MOTOR_GAIN, FORCE_LIMIT, FRICTION, STOP, STOP_STIFFNESS = range(9)
TABLE_VELOCITY, VELOCITY = 9, 10  # below which the frictions fall off
OFFSET = 12
IDEAL = 11  # interval (s) of a table that follows at once, 0 for any other
TABLE_SHAPE, SHAPE = 13, 16  # of the frictions: asymmetry, what speed takes of them, and that speed
PRESLIDING = 19  # m, of the rail's friction
# of the play behind the loop: a half of it m, drag of the guide 1/s, 2ζ/ω of the flanks s, 1/ω² of them s²
BEHIND, GUIDE, DAMPED, SOFT = 20, 21, 22, 23
STOP_EXPONENT, STOP_DAMPING = 24, 25
FORCE_LIMIT_SHARPNESS = 26
# highest speed of the table's loop m/s, and of that loop ω/(2ζ) and 2ζω, 1/s
FASTEST, OPENING, VALVE = 27, 28, 29
ASYMMETRY = 30  # of the damper's dashpot
# of a mass behind a coupling: itself kg, spring 1/s² and dashpot 1/s over it, a half of the coupling's play m, and the
# whole mass over the first one
SECOND, COUPLING, COUPLED_RATE, GAP, WHOLE = 31, 32, 33, 34, 35
TABLE_PRESLIDING = 36  # m, of the table's friction
# of what is fed forward: the share of a change of rate that passes the filter in an interval, 0 where nothing is fed
# forward, ticks per s, the velocity's time s, and the acceleration's s²
FED, FED_TICKS, FED_VELOCITY, FED_ACCELERATION = 37, 38, 39, 40
FASTEST_SHARPNESS = 41  # of the bend at the loop's highest speed
DAMPING_EXPONENT, STIFFENING = 42, 43  # of the damper's dashpot and spring, the latter 1/m²
# of the constant force on the damper's mass: what has its reaction elsewhere than on the table N, and the acceleration
# by which a compliant table gives way to that m/s²
OUTSIDE, LEANED = 44, 45

# places in `state` behind the states and inputs
PLAYED, LAST_VELOCITY, BRISTLES, APART, APART_RATE, HELD, TABLE_BRISTLES, LAST_COMMAND, FED_RATE = range(9)
MEMORIES = 9
ROWS = 8  # of a column: as many with an oil column as without one, so that they are carried side by side


class TableLab(NamedTuple):
    """The state and constants of the laboratory, which `advance` updates by one interval."""

    taps: Array  # of the delayed command, at the shortest segments' borders
    # (levels, borders, 2): from a border on, by level, the place of the segment's length, -1 for none, and its end
    walk: Whole
    # (m, n + 5, rows), rows = `ROWS`, or n where that is more: what state, command before and after, motor command, g
    # and table friction add to the next state
    columns: Array
    lengths: Array  # (m,) of segments, s
    spring: Array  # (stiffness N/m, dashpot N·s/m) of the damper
    limits: Array  # effects that are not in the matrices
    history: Array  # table commands written, newest first
    # (n + 14,), n = 6, 8 with an oil column, or 10 with a mass that swings on the platform, and one more with a motor
    # of second order: behind the states the inputs, the command after the play, an ideal table's last velocity, the
    # force of the rail's bristles, of a mass behind a coupling how far it is ahead of the first one, the rate of that,
    # and the coupling's force on the first one, what the bearings' bristles brake by, and of what is fed forward the
    # last command and its rate behind the filter
    state: Array
    free: Array  # (rows,): the states at a segment's end without g and the table's friction
    learned: Array  # a law of `models.preisach` of the stroke, empty for none
    learned_memory: Array
    braked: Array  # a law of the table's motion, m/s², empty for none
    braked_memory: Array
