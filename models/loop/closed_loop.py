"""The whole test as one compiled rollout: building, both laboratories, the exchange between them.

It is the simulation that a recording is compared with, and the reference for the real loops.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common import signals as table
from common.plan.plan import Plan
from models import compensators
from models.compensators import Built as Compensator
from models.compensators import Wanted
from models.compiled import jit
from models.labs import column_lab, noise, readings, table_lab
from models.labs.readings import Readings
from models.loop import substructure
from models.loop.substructure import (
    ACTUATOR_COMMAND,
    COLUMN_TARGET,
    DAMPER_COMMAND,
    STOREYS,
    TABLE_ACCELERATION,
    TABLE_JERK,
    TABLE_TARGET,
    TABLE_VELOCITY,
    Substructure,
)
from models.registry import Array
from models.system import Effects, System

Index = NDArray[np.int64]

MEASURED_A = ("column_displacement", "column_force")
MEASURED_B = ("table_displacement", "table_acceleration", "damper_stroke", "damper_force")


class Rows(NamedTuple):
    """What a rollout fills: one row per tick."""

    outputs: Array  # (ticks, 8 + 5·storeys): the master's, in the order of `substructure`
    measured_a: Array  # (ticks, 2)
    measured_b: Array  # (ticks, 4)
    damper_force_used: Array  # (ticks,)
    table_command: Array  # (ticks,)


class Rollout(NamedTuple):
    """What a rollout gives: one row per tick."""

    outputs: Array  # (ticks, 8 + 5·storeys): the master's, in the order of `substructure`
    measured_a: Array  # (ticks, 2)
    measured_b: Array  # (ticks, 4)
    damper_force_used: Array  # (ticks,)
    table_command: Array  # (ticks,)
    finite: bool  # False where the loop diverged; the rows from there on are zero
    ticks: int  # rows filled


class Exchange(NamedTuple):
    """Which message each tick used: the link's whole effect on the loop."""

    command: Index  # (ticks,): command in force at the slave's tick, −1 for none yet
    feedback: Index  # (ticks,): feedback used at the master's tick, −1 for none yet


class Loop(NamedTuple):
    """Everything that moves in a closed loop, at rest, and the messages that its ticks use."""

    building: Substructure
    lab_a: column_lab.ColumnLab
    lab_b: table_lab.TableLab
    compensator_b: Compensator
    sensors_a: Readings
    sensors_b: Readings
    exchange: Exchange


def on_time(ticks: int) -> Exchange:
    """Every message there in time: command k at tick k, feedback k at tick k + 1."""
    return Exchange(np.arange(ticks), np.arange(ticks) - 1)


def simulate(
    plan: Plan,
    ground: Array,
    *,
    effects: Effects | None = None,
    seed: int | None = None,
    exchange: Exchange | None = None,
) -> Rollout:
    """Closed loop of a plan with one slave: its models over the whole test, with effects laid over them where given.

    `ground` as `substructure.ground_rows` gives it. Without a `seed` the sensors are free of noise; with
    one they read what the emulated laboratories read under that seed of the plan. Of the link's effects
    only the `exchange` counts: which message was used at which tick.
    """
    ticks, system = plan.ticks, System(plan, effects or Effects())
    loop = at_rest(system, ground, exchange or on_time(ticks))
    width = loop.building.output.size
    rows = Rows(
        np.zeros((ticks, width)),
        np.zeros((ticks, len(MEASURED_A))),
        np.zeros((ticks, len(MEASURED_B))),
        np.zeros(ticks),
        np.zeros(ticks),
    )
    filled = roll(loop, *noises(system, seed), np.zeros(width), rows)
    return Rollout(*rows, filled == ticks, filled)


def at_rest(system: System, ground: Array, exchange: Exchange) -> Loop:
    """The closed loop of a system with one slave before its first tick."""
    plan, effects = system.plan, system.effects
    interval, follow = plan.test.interval, plan.table.compensator
    return Loop(
        substructure.build(plan, ground, effects.p_delta),
        build_a(system),
        build_b(system),
        compensators.build(follow.kind, follow.parameters, interval, plan.follows_in),
        readings.build(interval, MEASURED_A, effects.sensors),
        readings.build(interval, MEASURED_B, effects.sensors),
        exchange,
    )


def build_a(system: System) -> column_lab.ColumnLab:
    """Laboratory A of a system, at rest."""
    plan, effects = system.plan, system.effects
    return column_lab.build(plan.test.interval, plan.actuator, plan.column, effects.actuator, effects.column)


def build_b(system: System) -> table_lab.TableLab:
    """Laboratory B of a system, at rest."""
    plan, effects = system.plan, system.effects
    return table_lab.build(plan.test.interval, plan.table, plan.damper, effects.table, effects.damper)


def noises(system: System, seed: int | None) -> tuple[Array, Array]:
    """Noise of both laboratories' readings, (ticks, 2) and (ticks, 4); zero without a seed."""
    ticks, sensors, more = system.plan.ticks, system.plan.sensors, system.effects.sensors
    if seed is None:
        return noise_a(system, seed), np.zeros((ticks, len(MEASURED_B)))
    b = readings.levels(MEASURED_B, noise.levels_b(sensors), more)
    return noise_a(system, seed), noise.Noise(noise.lab_seed(seed, noise.LAB_B), b).rows(ticks)


def noise_a(system: System, seed: int | None) -> Array:
    """Noise of laboratory A's readings, (ticks, 2); zero without a seed."""
    ticks, sensors, more = system.plan.ticks, system.plan.sensors, system.effects.sensors
    if seed is None:
        return np.zeros((ticks, len(MEASURED_A)))
    levels = readings.levels(MEASURED_A, noise.levels_a(sensors), more)
    return noise.Noise(noise.lab_seed(seed, noise.LAB_A), levels).rows(ticks)


@jit
def roll(loop: Loop, noise_a: Array, noise_b: Array, nothing: Array, rows: Rows) -> int:
    """Fill the rows tick by tick; return how many ticks stayed finite.

    `noise_a` (ticks, 2) and `noise_b` (ticks, 4) are what errs in the readings; `nothing` is a row of zeros: what the
    slave follows before its first command.
    """
    building = loop.building
    displacement, force = 0.0, 0.0
    y, y_acceleration, stroke, damper_force, present = 0.0, 0.0, 0.0, 0.0, 0.0
    interval = building.scalars[substructure.INTERVAL]
    measured_a, measured_b = rows.measured_a, rows.measured_b
    for tick in range(rows.outputs.shape[0]):
        t = tick * interval
        measured_a[tick, 0] = readings.step(loop.sensors_a, 0, displacement, noise_a[tick, 0], t)
        measured_a[tick, 1] = readings.step(loop.sensors_a, 1, force, noise_a[tick, 1], t)
        answered = loop.exchange.feedback[tick]
        rows.damper_force_used[tick] = measured_b[answered, 3] if answered >= 0 else 0.0
        building.dampers[substructure.FORCE_USED, 0] = rows.damper_force_used[tick]
        substructure.advance(building, tick, measured_a[tick, 0], measured_a[tick, 1])
        if not np.isfinite(building.output[ACTUATOR_COMMAND]):
            return tick
        for place in range(building.output.size):
            rows.outputs[tick, place] = building.output[place]
        displacement, force = column_lab.advance(loop.lab_a, building.output[ACTUATOR_COMMAND])
        measured_b[tick, 0] = readings.step(loop.sensors_b, 0, y, noise_b[tick, 0], t)
        measured_b[tick, 1] = readings.step(loop.sensors_b, 1, y_acceleration, noise_b[tick, 1], t)
        measured_b[tick, 2] = readings.step(loop.sensors_b, 2, stroke, noise_b[tick, 2], t)
        measured_b[tick, 3] = readings.step(loop.sensors_b, 3, damper_force, noise_b[tick, 3], t)
        sent = loop.exchange.command[tick]
        row = rows.outputs[sent] if sent >= 0 else nothing
        wanted = Wanted(
            row[TABLE_TARGET],
            row[TABLE_VELOCITY],
            row[TABLE_ACCELERATION],
            row[TABLE_JERK],
            present,
            measured_b[tick, 0],
        )
        rows.table_command[tick] = compensators.step(loop.compensator_b, wanted, interval)
        present = row[TABLE_TARGET]
        y, y_acceleration, stroke, damper_force = table_lab.advance(
            loop.lab_b, rows.table_command[tick], row[DAMPER_COMMAND]
        )
    return rows.outputs.shape[0]


def signals(plan: Plan, rollout: Rollout) -> dict[str, Array]:
    """The rollout's signals by name, as a recording names them; (ticks,) or (ticks, storeys) each."""
    n, rows = plan.storeys, slice(0, rollout.ticks)
    result: dict[str, Array] = {
        "t": np.arange(rollout.ticks, dtype=np.float64) * plan.test.interval,
        "ground_acceleration": rollout.outputs[rows, substructure.GROUND_ACCELERATION],
        "column_target": rollout.outputs[rows, COLUMN_TARGET],
        "actuator_command": rollout.outputs[rows, ACTUATOR_COMMAND],
        "table_target": rollout.outputs[rows, TABLE_TARGET],
        "table_target_velocity": rollout.outputs[rows, TABLE_VELOCITY],
        "table_target_acceleration": rollout.outputs[rows, TABLE_ACCELERATION],
        "table_target_jerk": rollout.outputs[rows, TABLE_JERK],
        "damper_command": rollout.outputs[rows, DAMPER_COMMAND],
        "table_command": rollout.table_command[rows],
        "damper_force_used": rollout.damper_force_used[rows],
    }
    for place, name in enumerate(substructure.STOREY_ROWS):
        start = STOREYS + place * n
        values = rollout.outputs[rows, start : start + n]
        result[name] = values[:, 0] if n == 1 else values
    for place, name in enumerate(MEASURED_A):
        result[name] = rollout.measured_a[rows, place]
    for place, name in enumerate(MEASURED_B):
        result[name] = rollout.measured_b[rows, place]
    return result


def rows(plan: Plan, rollout: Rollout) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """The rollout's messages as a recording holds them: topic and values in the order of the signal table."""
    columns: dict[str, Any] = signals(plan, rollout)
    ticks = rollout.ticks
    feedback = np.arange(ticks) - 1
    columns |= {
        "seq": np.arange(ticks),
        "command_seq": np.arange(ticks),
        "damper_force_seq": feedback,
        "damper_force_age": np.where(feedback < 0, 0.0, plan.test.interval),
    }
    tables = {
        topic: list(zip(*(columns[row.name].tolist() for row in table.TOPICS[topic]), strict=True))
        for topic in ("master", "slave")
    }
    for tick in range(ticks):
        for topic, values in tables.items():
            yield topic, values[tick]
