"""The whole test as one compiled rollout: the building, the master's laboratory, and any number of slaves'.

It is the simulation that a recording is compared with, and the reference for the real loops.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numba.core import types
from numba.extending import overload
from numpy.typing import NDArray

from common import signals as table
from common.errors import InputError
from common.plan.plan import Plan
from common.roles import MASTER, name_of
from laboratories import kinds
from laboratories.column.kind import COLUMN
from laboratories.kind import Kind
from laboratories.sensors import noise
from laboratories.table.kind import TABLE
from loop import site, substructure
from loop.site import Site
from loop.substructure import (
    ACTUATOR_COMMAND,
    DAMPER_COMMAND,
    OF_SLAVES,
    TABLE_ACCELERATION,
    TABLE_JERK,
    TABLE_TARGET,
    TABLE_VELOCITY,
    Substructure,
)
from models import compensators
from models.compensators import Built as Compensator
from models.compensators import Wanted
from models.compiled import MERGED, jit
from models.registry import Array
from models.system import Effects, System

Index = NDArray[np.int64]

LARGEST = float(np.finfo(np.float64).max)  # m: every command that is a finite number is below
DISPLACEMENT, FORCE = map(
    COLUMN.channels.names.index, (COLUMN.channels.position, COLUMN.channels.force)
)  # of the master's laboratory


class Exchange(NamedTuple):
    """Which message each tick used: the link's whole effect on the loop."""

    command: Index  # (ticks,): command in force at the slave's tick, −1 for none yet
    feedback: Index  # (ticks,): feedback used at the master's tick, −1 for none yet


class Rollout(NamedTuple):
    """What a rollout gives: signals by name, one row per tick, up to where the loop diverged."""

    master: dict[
        str, Array
    ]  # (ticks,), of several storeys (ticks, storeys), of several slaves (ticks, slaves)
    slaves: dict[str, dict[str, Array]]  # by role, (ticks,) each: the table's command and what is measured
    exchange: dict[str, Exchange]  # by role of the slave
    finite: bool  # False where the loop diverged
    ticks: int  # rows of every signal


class Slave(NamedTuple):
    """A slave's laboratory, which follows the target that it is sent."""

    site: Site
    compensator: Compensator
    follows: int  # channel that its compensator compares with the target
    force: int  # channel of the force that goes back to the building
    written: Array  # (ticks,) commands of its transfer system, m
    present: Array  # (1,) target of the present tick, m


class Traffic(NamedTuple):
    """What passes between the building and its slaves."""

    outputs: Array  # (ticks, width): the building's rows, from which the slaves' commands are read
    nothing: Array  # (width,) zeros: what a slave follows before its first command
    forces: Array  # (ticks, slaves) as measured, N
    used: Array  # (ticks, slaves) as the building used them, N
    command: Index  # (slaves, ticks), as in `Exchange`
    feedback: Index  # (slaves, ticks)


class Loop(NamedTuple):
    """Everything that moves in a closed loop, at rest."""

    building: Substructure
    own: Site  # the master's laboratory
    slaves: tuple[Slave, ...]  # of any kinds
    traffic: Traffic


def on_time(ticks: int) -> Exchange:
    """Every message there in time: command k at tick k, feedback k at tick k + 1."""
    return Exchange(np.arange(ticks), np.arange(ticks) - 1)


def simulate(
    plan: Plan,
    ground: Array,
    *,
    effects: Effects | None = None,
    slaves: Mapping[str, System] | None = None,
    seed: int | None = None,
    noise: Mapping[str, Array] | None = None,
    exchange: Mapping[str, Exchange] | None = None,
    farthest: float = LARGEST,
) -> Rollout:
    """Closed loop of a plan: its models over the whole test, with effects laid over them where given.

    `ground` as `substructure.ground_rows` gives it. Every slave is what `plan` and `effects` say, or its entry in
    `slaves`, systems by role; with no entry at all, `{}`, building and master's laboratory move alone, which takes a
    building without dampers. With a `seed` the sensors read what the emulated laboratories read under that seed of the
    plan; `noise` are rows (ticks, channels) that err in the readings of single roles; else they are free of noise. Of
    the link's effects only the `exchange` of each role counts, in time where it is not given. A command of the
    actuator that is not finite or beyond `farthest` (m) ends the loop.

    Raises:
        InputError: a building with dampers is to move alone, noise is given twice or has another shape, or a model,
            method or parameter is unknown to the registries.
    """
    of_master = System(plan, effects or Effects())
    systems = {role: System(plan.of(role), of_master.effects) for role in plan.roles}
    systems = systems if slaves is None else dict(slaves)
    if not systems and (plan.control.amd or plan.slaves):
        raise InputError("The loop of laboratory A alone knows no damper: set amd in [control] to false.")
    ticks, given = plan.ticks, exchange or {}
    used = {role: given.get(role) or on_time(ticks) for role in systems}
    drawn = errors({MASTER: of_master} | systems, seed, noise or {})
    loop = at_rest(of_master, systems, ground, used, drawn)
    filled = roll(loop, farthest)
    return Rollout(
        master_signals(plan, loop, filled),
        {role: slave_signals(slave, filled) for role, slave in zip(systems, loop.slaves, strict=True)},
        used,
        filled == ticks,
        filled,
    )


def at_rest(
    master: System,
    slaves: Mapping[str, System],
    ground: Array,
    exchange: Mapping[str, Exchange],
    errors: Mapping[str, Array],
) -> Loop:
    """The closed loop before its first tick; `slaves`, `exchange` and `errors` of the readings by role."""
    plan, count = master.plan, len(slaves)
    ticks = plan.ticks
    building = substructure.build(plan, ground, master.effects.p_delta, slaves=count > 0)
    traffic = Traffic(
        np.zeros((ticks, building.output.size)),
        np.zeros(building.output.size),
        np.zeros((ticks, count)),
        np.zeros((ticks, count)),
        np.array([exchange[role].command for role in slaves], dtype=np.int64).reshape(count, ticks),
        np.array([exchange[role].feedback for role in slaves], dtype=np.int64).reshape(count, ticks),
    )
    followers = tuple(follower(TABLE, system, errors[role]) for role, system in slaves.items())
    return Loop(building, site.build(COLUMN, master, errors[MASTER]), followers, traffic)


def follower(kind: Kind, system: System, errors: Array) -> Slave:
    """A slave's laboratory at rest."""
    plan, ticks = system.plan, errors.shape[0]
    chosen = plan.table.compensator
    return Slave(
        site.build(kind, system, errors),
        compensators.build(chosen.kind, chosen.parameters, plan.test.interval, plan.follows_in),
        kind.channels.names.index(kind.channels.position),
        kind.channels.names.index(kind.channels.force),
        np.zeros(ticks),
        np.zeros(1),
    )


def errors(systems: Mapping[str, System], seed: int | None, given: Mapping[str, Array]) -> dict[str, Array]:
    """What errs in the readings of master and slaves, (ticks, channels) by role, the slaves in their order.

    Raises:
        InputError: the noise is given twice, or has another shape.
    """
    result = {}
    for place, (role, system) in enumerate(systems.items(), noise.LAB_A):
        kind, ticks = COLUMN if role == MASTER else TABLE, system.plan.ticks
        result[role] = site.errors(kind, system, ticks, None if seed is None else noise.lab_seed(seed, place))
        if role not in given:
            continue
        if seed is not None:
            raise InputError("The noise is given twice, as rows and by a seed: leave one of them out.")
        if given[role].shape != result[role].shape:
            raise InputError(
                f"The noise has the shape {given[role].shape}: give one row per tick, {ticks}, "
                f"with {', '.join(kind.channels.names)}."
            )
        result[role] = np.ascontiguousarray(given[role], dtype=np.float64)
    return result


@jit
def roll(loop: Loop, farthest: float) -> int:
    """Fill the rows tick by tick; return how many ticks had a command of the actuator within `farthest` (m)."""
    building, own, traffic = loop.building, loop.own, loop.traffic
    interval = building.scalars[substructure.INTERVAL]
    for tick in range(traffic.outputs.shape[0]):
        site.read(own, tick, tick * interval)
        for place in range(traffic.used.shape[1]):
            answered = traffic.feedback[place, tick]
            traffic.used[tick, place] = traffic.forces[answered, place] if answered >= 0 else 0.0
            building.dampers[substructure.FORCE_USED, place] = traffic.used[tick, place]
        substructure.advance(building, tick, own.measured[tick, DISPLACEMENT], own.measured[tick, FORCE])
        command = building.output[ACTUATOR_COMMAND]
        if not abs(command) <= farthest:
            return tick
        for place in range(building.output.size):
            traffic.outputs[tick, place] = building.output[place]
        kinds.advance(own.lab, own.truth, command, 0.0)
        follow_all(loop.slaves, 0, traffic, tick, interval)
    return traffic.outputs.shape[0]


@jit
def follow(slave: Slave, place: int, traffic: Traffic, tick: int, interval: float) -> None:
    """One tick of a slave: its readings, its table's command, and its laboratory one interval on."""
    read, count = slave.site.measured, traffic.used.shape[1]
    site.read(slave.site, tick, tick * interval)
    traffic.forces[tick, place] = read[tick, slave.force]
    sent = traffic.command[place, tick]
    row = traffic.outputs[sent] if sent >= 0 else traffic.nothing
    first = OF_SLAVES + place
    target = row[first + TABLE_TARGET * count]
    wanted = Wanted(
        target,
        row[first + TABLE_VELOCITY * count],
        row[first + TABLE_ACCELERATION * count],
        row[first + TABLE_JERK * count],
        slave.present[0],
        read[tick, slave.follows],
    )
    slave.written[tick] = compensators.step(slave.compensator, wanted, interval)
    slave.present[0] = target
    kinds.advance(slave.site.lab, slave.site.truth, slave.written[tick], row[first + DAMPER_COMMAND * count])


def follow_all(slaves: tuple[Slave, ...], place: int, traffic: Traffic, tick: int, interval: float) -> None:
    """`follow` of every slave, the first at `place`; compiled code only."""
    raise NotImplementedError("Only compiled kernels move slaves of any kinds on.")


@overload(follow_all, jit_options=MERGED, strict=False)  # strict compares annotations too
def _follow_all(slaves: types.BaseTuple, place: Any, traffic: Any, tick: Any, interval: Any) -> Any:
    """Code for these slaves: a loop where all are of one kind, else the first and then the rest."""
    count = len(slaves)
    if count == 0:
        return lambda slaves, place, traffic, tick, interval: None
    if count > 1 and isinstance(slaves, types.UniTuple):

        def alike(slaves: Any, place: Any, traffic: Any, tick: Any, interval: Any) -> None:
            for i in range(count):
                follow(slaves[i], place + i, traffic, tick, interval)

        return alike

    def different(slaves: Any, place: Any, traffic: Any, tick: Any, interval: Any) -> None:
        follow(slaves[0], place, traffic, tick, interval)
        follow_all(slaves[1:], place + 1, traffic, tick, interval)

    return different


def master_signals(plan: Plan, loop: Loop, ticks: int) -> dict[str, Array]:
    """What the master computed, measured and used."""
    slaves = len(loop.slaves)
    computed = substructure.named(loop.traffic.outputs[:ticks], slaves, plan.storeys)
    measured = dict(zip(COLUMN.channels.names, loop.own.measured[:ticks].T, strict=True))
    used = loop.traffic.used[:ticks]
    return computed | measured | {"damper_force_used": used[:, 0] if slaves == 1 else used}


def slave_signals(slave: Slave, ticks: int) -> dict[str, Array]:
    """What a slave wrote and measured."""
    measured = dict(zip(TABLE.channels.names, slave.site.measured[:ticks].T, strict=True))
    return {TABLE.channels.drives[0]: slave.written[:ticks]} | measured


def signals(plan: Plan, rollout: Rollout) -> dict[str, Array]:
    """The rollout's signals by name, as a recording names them; (ticks,), (ticks, storeys) or (ticks, slaves) each.

    Those of a named slave are called `NAME.signal`.
    """
    result: dict[str, Array] = {}
    order = kinds.topics(plan)
    for topic, columns in topics(plan, rollout).items():
        name = name_of(topic)
        for key in (row.name for row in order[topic] if row.kind in (table.Kind.NUMBER, table.Kind.STOREYS)):
            if not name:
                result.setdefault(key, columns[key])
            elif key != table.TIME.name:
                result[f"{name}.{key}"] = columns[key]
    del result["damper_force_age"]
    return result


def stacked(rollout: Rollout) -> dict[str, Array]:
    """The rollout's signals by name, those of several slaves together: (ticks, slaves)."""
    slaves = list(rollout.slaves.values())
    if len(slaves) < 2:
        return rollout.master | (slaves[0] if slaves else {})
    return rollout.master | {name: np.stack([one[name] for one in slaves], axis=1) for name in slaves[0]}


def topics(plan: Plan, rollout: Rollout) -> dict[str, dict[str, Any]]:
    """Everything that a recording of the rollout holds, by topic and signal."""
    seq = np.arange(rollout.ticks)
    own: dict[str, Any] = {"seq": seq, "t": seq.astype(np.float64) * plan.test.interval}
    used = [item.feedback[: rollout.ticks] for item in rollout.exchange.values()]
    feedback = np.array(used, dtype=np.int64).reshape(len(used), rollout.ticks).T
    age = np.where(feedback < 0, 0.0, (seq[:, None] - feedback) * plan.test.interval)
    one = len(rollout.slaves) == 1
    about = {"damper_force_seq": feedback, "damper_force_age": age}
    about = {name: values[:, 0] if one else values for name, values in about.items()}
    result = {MASTER: own | rollout.master | about}
    for place, (role, columns) in enumerate(rollout.slaves.items()):
        command = rollout.exchange[role].command[: rollout.ticks]
        sent = {name: rollout.master[name] if one else rollout.master[name][:, place] for name in table.SENT}
        received = {name: np.where(command < 0, 0.0, values[command]) for name, values in sent.items()}
        result[role] = own | {"command_seq": command} | received | columns
    return result


def rows(plan: Plan, rollout: Rollout) -> Iterator[tuple[str, tuple[Any, ...]]]:
    """The rollout's messages as a recording holds them: topic and values in the order of the signal table."""
    order = kinds.topics(plan)
    tables = {
        topic: list(zip(*(columns[row.name].tolist() for row in order[topic]), strict=True))
        for topic, columns in topics(plan, rollout).items()
    }
    for tick in range(rollout.ticks):
        for topic, values in tables.items():
            yield topic, values[tick]
