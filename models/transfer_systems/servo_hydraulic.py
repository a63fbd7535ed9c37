"""Servo-hydraulic actuator in interaction with its specimen, propagated exactly over segments of its command.

    q̈ + β1·q̇ + β2·q = a1β0·(g·u − x − (c_f + c_v)·f)      controller and servo valve: the flow q as rate of force, N/s
    ḟ = −a3·f + q − a2·(ẋ + c_f·ḟ)                  oil column: leakage, and the oil that the piston's motion takes
    m·ẍ + c·ẋ + k·x + w = f                          specimen: f (N) is what its load cell reads

C. E. Silva, D. Gomez, A. Maghareh, S. J. Dyke and B. F. Spencer, Benchmark control problem for real-time hybrid
simulation, Mech. Syst. Signal Process. 135 (2020) 106381, after S. J. Dyke, B. F. Spencer, P. Quast and M. K. Sain,
J. Eng. Mech. 121 (1995). The compliance c_f (m/N) of oil and frame between piston and specimen is an addition, and
so is c_v, by which the load takes from the error of the loop; they are zero unless an effect sets them.

The equations are linear except for w (N), the part of the specimen's force beyond k·x: it is an input, held constant
over a segment. The command is linear over a segment, so that one matrix exponential propagates the state exactly.

Not to be confused with `first_order`, whose motion does not depend on the specimen.
"""

from __future__ import annotations

import numpy as np

from common.plan.laboratory_tables import ServoHydraulics
from models.compiled import jit
from models.registry import Array

FLOW, FLOW_RATE, FORCE, POSITION, VELOCITY = range(5)  # N/s, N/s², N, m, m/s
STATES = 5
BEFORE, AFTER, EXCESS = range(STATES, STATES + 3)  # columns behind the states: command m at both ends, w N
WIDTH = STATES + 3


def rates(
    servo: ServoHydraulics,
    stiffness: float,
    damping: float,
    mass: float,
    compliance: float = 0.0,
    within: float = 0.0,
) -> tuple[Array, Array]:
    """State matrix (5, 5) and input matrix (5, 2) for command (m) and w (N), dead time apart.

    The specimen's `stiffness` N/m, `damping` N·s/m and `mass` kg; the `compliance` of oil and frame m/N,
    and the one `within` the loop m/N.
    """
    a, b = np.zeros((STATES, STATES)), np.zeros((STATES, 2))
    a[FLOW, FLOW_RATE] = 1.0
    a[FLOW_RATE, FLOW], a[FLOW_RATE, FLOW_RATE] = -servo.valve_stiffness, -servo.valve_damping
    a[FLOW_RATE, POSITION], a[FLOW_RATE, FORCE] = -servo.valve, -servo.valve * (compliance + within)
    yielding = 1.0 + servo.piston * compliance
    a[FORCE, [FLOW, FORCE, VELOCITY]] = np.array([1.0, -servo.leakage, -servo.piston]) / yielding
    a[POSITION, VELOCITY] = 1.0
    a[VELOCITY, [FORCE, POSITION, VELOCITY]] = np.array([1.0, -stiffness, -damping]) / mass
    b[FLOW_RATE, 0] = servo.valve * servo.gain
    b[VELOCITY, 1] = -1.0 / mass
    return a, b


def propagators(a: Array, b: Array, lengths: Array) -> Array:
    """Rows of `step` for segments (m,) s, (m, 40): each the matrix (5, 8) of state, command before and after, and w.

    By one matrix exponential with the inputs as further states (C. F. Van Loan, IEEE Trans. Autom. Control 23 (1978)).
    """
    from scipy.linalg import expm

    rows, scale = [], scales(a)
    for length in lengths:
        big = np.zeros((STATES + 3, STATES + 3))  # state, command, its slope times the length, w
        big[:STATES, :STATES] = a * length
        big[:STATES, STATES] = b[:, 0] * length
        big[STATES, STATES + 1] = 1.0
        big[:STATES, STATES + 2] = b[:, 1] * length
        whole = expm(big * scale / scale[:, None])[:STATES] * scale[:STATES, None] / scale
        late = whole[:, STATES + 1]
        row = np.column_stack([whole[:, :STATES], whole[:, STATES] - late, late, whole[:, STATES + 2]])
        rows.append(row.ravel())
    return np.array(rows)


def scales(a: Array) -> Array:
    """Sizes (8,) of the states and inputs that belong to a position of 1 m.

    They differ by fifteen powers of ten. Scaled by them the matrix is balanced, and its exponential is accurate.
    """
    force = -a[VELOCITY, POSITION] / a[VELOCITY, FORCE] - a[FORCE, VELOCITY]
    speed = np.sqrt(force * a[VELOCITY, FORCE])
    flow = force * speed
    return np.array([flow, flow * speed, force, 1.0, speed, 1.0, 1.0, force])


@jit
def step(row: Array, z: Array, first: int, before: float, after: float, excess: float) -> None:
    """Move the five states of `z` from place `first` on over a segment, under its command (m) and excess force (N)."""
    flow, flow_rate, force = z[first + FLOW], z[first + FLOW_RATE], z[first + FORCE]
    position, velocity = z[first + POSITION], z[first + VELOCITY]
    for i in range(STATES):
        at = WIDTH * i
        z[first + i] = (
            row[at + FLOW] * flow
            + row[at + FLOW_RATE] * flow_rate
            + row[at + FORCE] * force
            + row[at + POSITION] * position
            + row[at + VELOCITY] * velocity
            + row[at + BEFORE] * before
            + row[at + AFTER] * after
            + row[at + EXCESS] * excess
        )
