from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from common.plan.tables import SafetyTable
from common.safety.ramp import ForceRelease, MotionRamp

INTERVAL = 0.002
PLAN = SafetyTable(velocity=0.05, acceleration=10.0, jerk=2000.0, release=0.02)


def run(ramp: MotionRamp, force_of: float | None = None, most: int = 5000) -> list[float]:
    """The ramp's commands until it is done; the specimen is a spring of this stiffness (N/m); None: no reading."""
    commands = [ramp.command]
    while not ramp.done:
        commands.append(ramp.step(None if force_of is None else force_of * commands[-1]))
        assert len(commands) < most
    return commands


@given(st.floats(-0.05, 0.05), st.floats(-0.5, 0.5))
@settings(deadline=None)
def test_the_ramp_stops_within_its_bounds_and_without_a_step(position: float, velocity: float) -> None:
    commands = run(MotionRamp(PLAN, INTERVAL, position, velocity, unload=False))
    speeds = np.diff(commands, prepend=position - velocity * INTERVAL) / INTERVAL
    changes = np.diff(speeds) / INTERVAL
    assert np.abs(speeds).max() <= abs(velocity) + 1e-9
    assert np.abs(changes).max() <= PLAN.acceleration * (1 + 1e-6)
    assert np.abs(np.diff(changes)).max(initial=0.0) / INTERVAL <= PLAN.jerk * (1 + 1e-6)
    travel = abs(commands[-1] - position)
    most = velocity**2 / (2 * PLAN.acceleration) + abs(velocity) * PLAN.acceleration / (2 * PLAN.jerk)
    assert travel <= most + 1e-9
    assert travel >= velocity**2 / (2 * PLAN.acceleration) - 1e-9


@given(st.floats(-0.05, 0.05), st.floats(-0.3, 0.3))
@settings(deadline=None)
def test_the_ramp_unloads_an_elastic_specimen_to_zero_force(position: float, velocity: float) -> None:
    commands = run(MotionRamp(PLAN, INTERVAL, position, velocity, unload=True), 12.5e6)
    held = position + math.copysign(velocity**2 / (2 * PLAN.acceleration), velocity)
    assert abs(commands[-1]) <= 0.01 * abs(held) + 2 * PLAN.velocity * INTERVAL + 5e-4
    speeds = np.abs(np.diff(commands)) / INTERVAL
    assert speeds.max() <= max(abs(velocity), PLAN.velocity) + 1e-9


def test_a_yielded_specimen_is_left_at_the_displacement_of_zero_force() -> None:
    ramp = MotionRamp(PLAN, INTERVAL, 0.010, 0.0, unload=True)
    while not ramp.done:
        ramp.step(1e6 * (ramp.command - 0.006))  # 6 mm of residual deformation
    assert abs(ramp.command - 0.006) < 1e-3


def test_an_elastic_specimen_whose_force_still_lags_at_the_hold_is_unloaded() -> None:
    ramp, late = MotionRamp(PLAN, INTERVAL, 0.001, 0.0, unload=True), 22  # ticks, 44 ms
    forces = [-30e3] * late  # before the hold the specimen was deformed to the other side
    while not ramp.done:
        forces.append(12.5e6 * ramp.step(forces[-late]))
        if len(forces) == late + 3:
            assert ramp.holding
    assert abs(ramp.command) <= 2 * PLAN.velocity * INTERVAL + 5e-4
    assert ramp.left == 0.0


def test_a_force_that_keeps_opposing_the_unloading_leaves_the_specimen_at_the_hold_position() -> None:
    ramp, ticks = MotionRamp(PLAN, INTERVAL, 0.001, 0.0, unload=True), 0
    left = ramp.left
    while not ramp.done:
        ramp.step(-30e3)
        ticks += 1
    assert ramp.command == 0.001
    assert PLAN.settle <= ticks * INTERVAL <= left


def test_without_a_force_reading_the_ramp_holds_its_position() -> None:
    commands = run(MotionRamp(PLAN, INTERVAL, 0.01, 0.0, unload=True))
    assert commands[-1] == 0.01


def test_the_motor_force_reaches_zero_in_its_time_without_a_step() -> None:
    release = ForceRelease(PLAN, INTERVAL, 50.0)
    forces = [release.step() for _ in range(12)]
    assert forces[9] == forces[11] == 0.0
    assert release.done
    assert np.allclose(np.diff([50.0, *forces[:10]]), -5.0)
