"""The whole test as one compiled rollout: building, both laboratories, the exchange between them.

It is the simulation that a recording is compared with, and the reference for the real loops.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from common import signals as table
from common.plan import Plan
from models import compensators, substructure
from models.compiled import jit
from models.labs import column_lab, noise, readings, table_lab
from models.registry import Array
from models.substructure import (
    ACTUATOR_COMMAND,
    COLUMN_TARGET,
    DAMPER_COMMAND,
    STOREYS,
    TABLE_ACCELERATION,
    TABLE_JERK,
    TABLE_TARGET,
    TABLE_VELOCITY,
)
from models.system import Effects, System

Index = NDArray[np.int64]

MEASURED_A = ("column_displacement", "column_force")
MEASURED_B = ("table_displacement", "table_acceleration", "damper_stroke", "damper_force")


class Rollout(NamedTuple):
    """What a rollout gives: one row per tick."""

    outputs: Array  # (ticks, 5 + 5·storeys): the master's, in the order of `substructure`
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
    ticks, more = plan.ticks, effects or Effects()
    master = substructure.build(plan, ground, more.p_delta)
    outputs = np.zeros((ticks, master.output.size))
    measured_a, measured_b, used = np.zeros((ticks, 2)), np.zeros((ticks, 4)), np.zeros(ticks)
    follow = plan.table.compensator
    compensator_b = compensators.build(follow.kind, follow.parameters, plan.test.interval, plan.follows_in)
    written = np.zeros(ticks)
    filled = roll(
        *master,
        *build_a(System(plan, more)),
        *build_b(System(plan, more)),
        *compensator_b,
        *(exchange or on_time(ticks)),
        *readings.build(plan.test.interval, MEASURED_A, more.sensors),
        *readings.build(plan.test.interval, MEASURED_B, more.sensors),
        *noises(System(plan, more), seed),
        np.zeros(master.output.size),
        outputs,
        measured_a,
        measured_b,
        used,
        written,
    )
    return Rollout(outputs, measured_a, measured_b, used, written, filled == ticks, filled)


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
def roll(
    codes: Index,
    scalars: Array,
    dampers: Array,
    mass: Array,
    coefficients: Array,
    column_params: Array,
    compensator_params: Array,
    ground: Array,
    state: Array,
    column_memory: Array,
    compensator_memory: Array,
    recent: Array,
    filtered: Array,
    target: Array,
    balance: Array,
    output: Array,
    taps_a: Array,
    rows_a: Array,
    lengths_a: Array,
    limits_a: Array,
    history_a: Array,
    state_a: Array,
    specimen: int,
    specimen_params: Array,
    specimen_memory: Array,
    specimen_effects: Array,
    yielding: Array,
    yielded: Array,
    cell: Array,
    taps_b: Array,
    matrices: Array,
    spring: Array,
    limits_b: Array,
    history_b: Array,
    state_b: Array,
    scratch: Array,
    code_c: int,
    params_c: Array,
    memory_c: Array,
    command: Index,
    feedback: Index,
    sensors_a: Array,
    sensed_a: Array,
    sensors_b: Array,
    sensed_b: Array,
    noise_a: Array,
    noise_b: Array,
    nothing: Array,
    outputs: Array,
    measured_a: Array,
    measured_b: Array,
    used: Array,
    written: Array,
) -> int:
    """Fill the last five arrays tick by tick; return how many ticks stayed finite.

    `nothing` is a row of zeros: what the slave follows before its first command.
    """
    displacement, force = 0.0, 0.0
    y, y_acceleration, stroke, damper_force, present = 0.0, 0.0, 0.0, 0.0, 0.0
    interval = scalars[substructure.INTERVAL]
    for tick in range(outputs.shape[0]):
        t = tick * interval
        measured_a[tick, 0] = readings.step(sensors_a, sensed_a, 0, displacement, noise_a[tick, 0], t)
        measured_a[tick, 1] = readings.step(sensors_a, sensed_a, 1, force, noise_a[tick, 1], t)
        used[tick] = measured_b[feedback[tick], 3] if feedback[tick] >= 0 else 0.0
        dampers[substructure.FORCE_USED, 0] = used[tick]
        substructure.advance(
            codes,
            scalars,
            dampers,
            mass,
            coefficients,
            column_params,
            compensator_params,
            ground,
            state,
            column_memory,
            compensator_memory,
            recent,
            filtered,
            target,
            balance,
            output,
            tick,
            measured_a[tick, 0],
            measured_a[tick, 1],
        )
        if not np.isfinite(output[ACTUATOR_COMMAND]):
            return tick
        for place in range(output.size):
            outputs[tick, place] = output[place]
        displacement, force = column_lab.advance(
            taps_a,
            rows_a,
            lengths_a,
            limits_a,
            history_a,
            state_a,
            specimen,
            specimen_params,
            specimen_memory,
            specimen_effects,
            yielding,
            yielded,
            cell,
            output[ACTUATOR_COMMAND],
        )
        measured_b[tick, 0] = readings.step(sensors_b, sensed_b, 0, y, noise_b[tick, 0], t)
        measured_b[tick, 1] = readings.step(sensors_b, sensed_b, 1, y_acceleration, noise_b[tick, 1], t)
        measured_b[tick, 2] = readings.step(sensors_b, sensed_b, 2, stroke, noise_b[tick, 2], t)
        measured_b[tick, 3] = readings.step(sensors_b, sensed_b, 3, damper_force, noise_b[tick, 3], t)
        sent = command[tick]
        row = outputs[sent] if sent >= 0 else nothing
        written[tick] = compensators.step(
            code_c,
            params_c,
            memory_c,
            row[TABLE_TARGET],
            row[TABLE_VELOCITY],
            row[TABLE_ACCELERATION],
            row[TABLE_JERK],
            present,
            measured_b[tick, 0],
            interval,
        )
        present = row[TABLE_TARGET]
        y, y_acceleration, stroke, damper_force = table_lab.advance(
            taps_b,
            matrices,
            spring,
            limits_b,
            history_b,
            state_b,
            scratch,
            written[tick],
            row[DAMPER_COMMAND],
        )
    return outputs.shape[0]


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
