"""What a logger's filter sees of table and damper between ticks, against steps a hundred times shorter."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy import signal

from common.plan.plan import Plan
from common.recording.logger.low_pass import LoggerFilter
from common.recording.logger.passing import later
from laboratories.table import between
from models.registry import Array
from models.system import System

TICKS, FINER, SETTLED = 1500, 100, 100


def behind_filter(finely: Array, bend: Array, interval: float) -> tuple[float, float]:
    """Rms of what a logger's filter sees of a signal (ticks·FINER,) beyond its ticks, and of what a bend leaves of it.

    `bend` (ticks,) is added at the ticks. The first `SETTLED` ticks, in which the filter settles, do not count.
    """
    low_pass, settled = LoggerFilter("bessel", 4, 90.0), slice(SETTLED, -5)
    seen = low_pass.filtered(finely, interval / FINER)[::FINER]
    at_ticks = low_pass.filtered(finely[::FINER], interval)
    bent = low_pass.filtered(finely[::FINER] + bend, interval)
    return float(np.std((seen - at_ticks)[settled])), float(np.std((seen - bent)[settled]))


@pytest.mark.parametrize(("lag", "share_left"), [(0.0, 0.02), (1e-3, 0.005), (3e-3, 0.005)])
def test_a_filter_sees_the_force_of_a_motor_whose_command_is_held(lag: float, share_left: float) -> None:
    plan = Plan()
    system = System(
        dataclasses.replace(plan, damper=dataclasses.replace(plan.damper, motor_time_constant=lag))
    )
    interval = plan.test.interval
    t = interval * np.arange(TICKS)
    command = 20.0 * np.sin(2.0 * np.pi * 2.0 * t) + 5.0 * np.sin(2.0 * np.pi * 7.0 * t)
    step = 1.0 if lag == 0.0 else -math.expm1(-interval / FINER / lag)
    force, now = np.zeros(TICKS * FINER), 0.0
    for place in range(1, force.size):
        now += step * (command[(place - 1) // FINER] - now)
        force[place] = now
    missed, left = behind_filter(force, between.motor_bend(system, command), interval)
    assert left < share_left * missed


def test_a_motor_at_the_end_of_its_force_does_not_change_between_ticks() -> None:
    plan = Plan()
    limited = System(plan)
    limited = dataclasses.replace(
        limited,
        effects=dataclasses.replace(
            limited.effects, damper=dataclasses.replace(limited.effects.damper, force_limit=5.0)
        ),
    )
    assert np.all(np.abs(between.motor_bend(limited, np.full(200, 30.0))[100:]) < 1e-9)
    assert np.max(np.abs(between.motor_bend(System(plan), 10.0 * np.sin(np.arange(200))))) > 0.1


@pytest.mark.parametrize("delay", [0.0, 1e-3, 5.3e-3])
def test_a_filter_sees_the_acceleration_of_a_table_whose_command_is_ramped(delay: float) -> None:
    plan = Plan()
    table = dataclasses.replace(plan.table, frequency=16.0, damping_ratio=0.6, delay=delay)
    system = System(dataclasses.replace(plan, table=table))
    interval = plan.test.interval
    t = interval * np.arange(TICKS)
    command = 0.01 * np.sin(2.0 * np.pi * 2.0 * t) + 5e-4 * np.sin(2.0 * np.pi * 7.0 * t)
    finely = interval / FINER * np.arange(TICKS * FINER)
    reached = np.interp(finely - delay - interval, t, command)
    omega = 2.0 * np.pi * table.frequency
    loop = signal.lti([omega**2, 0.0, 0.0], [1.0, 2.0 * table.damping_ratio * omega, omega**2])
    acceleration = signal.lsim(loop, reached, finely)[1]
    missed, left = behind_filter(acceleration, between.acceleration_bend(system, command), interval)
    assert left < 0.1 * missed


def test_a_filter_sees_the_force_of_a_motor_of_second_order() -> None:
    plan = Plan()
    more = dataclasses.replace(System(plan).effects.damper, motor_damping=0.6)
    system = System(plan)
    system = dataclasses.replace(system, effects=dataclasses.replace(system.effects, damper=more))
    interval, lag = plan.test.interval, plan.damper.motor_time_constant
    t = interval * np.arange(TICKS)
    command = 20.0 * np.sin(2.0 * np.pi * 2.0 * t) + 5.0 * np.sin(2.0 * np.pi * 7.0 * t)
    omega, finely = 1.2 / lag, interval / FINER * np.arange(TICKS * FINER)
    held = np.repeat(command, FINER)
    force = signal.lsim(([omega**2], [1.0, 1.2 * omega, omega**2]), held, finely, interp=False)[1]
    missed, left = behind_filter(force, between.motor_bend(system, command), interval)
    assert left < 0.1 * missed
    inside = force[FINER // 4 :: FINER] - later(force[::FINER], -0.25)
    bend = between.motor_bend(system, command, 0.25)
    assert np.std((bend - inside)[50:-50]) < 0.05 * np.std(inside[50:-50])


@pytest.mark.parametrize("late", [0.25, 1.5, 2.8])
def test_a_delay_by_a_part_of_an_interval_sees_what_lies_between_ticks(late: float) -> None:
    system = System(Plan())
    interval, lag = system.plan.test.interval, system.plan.damper.motor_time_constant
    command = 20.0 * np.sin(2.0 * np.pi * 2.0 * interval * np.arange(TICKS))
    force, now = np.zeros(TICKS * FINER), 0.0
    for place in range(1, force.size):
        now += -math.expm1(-interval / FINER / lag) * (command[(place - 1) // FINER] - now)
        force[place] = now
    seen = np.roll(force, round(late * FINER))[::FINER]
    at_ticks = later(force[::FINER], late)
    bent = later(force[::FINER] + between.motor_bend(system, command, -late % 1.0), late)
    missed, left = (float(np.std((seen - one)[50:-5])) for one in (at_ticks, bent))
    assert left < 0.1 * missed
    assert not between.motor_bend(system, command, 0.0).any()


@pytest.mark.parametrize("late", [0.25, 1.5, 2.8])
def test_a_delay_sees_the_arcs_of_an_acceleration(late: float) -> None:
    plan = Plan()
    system = System(plan)
    interval, omega = plan.test.interval, 2.0 * np.pi * plan.table.frequency
    command = 0.01 * np.sin(2.0 * np.pi * 2.0 * interval * np.arange(TICKS))
    finely = interval / FINER * np.arange(TICKS * FINER)
    reached = np.interp(finely - plan.table.delay - interval, interval * np.arange(TICKS), command)
    loop = signal.lti([omega**2, 0.0, 0.0], [1.0, 2.0 * plan.table.damping_ratio * omega, omega**2])
    acceleration = signal.lsim(loop, reached, finely)[1]
    seen = np.roll(acceleration, round(late * FINER))[::FINER]
    at_ticks = later(acceleration[::FINER], late)
    bent = later(acceleration[::FINER] + between.acceleration_bend(system, command, -late % 1.0), late)
    missed, left = (float(np.std((seen - one)[100:-5])) for one in (at_ticks, bent))
    assert left < 0.2 * missed
