"""The whole test as one compiled rollout: the building, the master's laboratory, and any number of slaves'.

It is the simulation that a recording is compared with, and the reference for the real loops.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba.core import types
from numba.extending import overload
from numpy.typing import NDArray

from common import signals as table
from common.errors import InputError
from common.plan.plan import Plan
from common.roles import MASTER, SLAVE, name_of, title
from laboratories import kinds
from laboratories.column.model import ColumnLab
from laboratories.kind import Kind
from laboratories.kinds import kinds_of
from laboratories.sensors import noise
from laboratories.table.kind import TABLE
from laboratories.table.model import TableLab
from loop import site, substructure
from loop.names import sent_names
from loop.site import Site
from loop.substructure import (
    COMMAND,
    EFFORT,
    OF_SLAVES,
    SENT_ACCELERATION,
    SENT_EFFORT,
    SENT_JERK,
    SENT_TARGET,
    SENT_VALUES,
    SENT_VELOCITY,
    Substructure,
)
from models import compensators
from models.compensators import Built as Compensator
from models.compensators.wanted import Wanted
from models.compiled import MERGED, jit
from models.registry import Array
from models.system import Effects, System

Index = NDArray[np.int64]

LARGEST = float(np.finfo(np.float64).max)  # m: every command that is a finite number is below


class MessagesUsed(NamedTuple):
    """Which message each tick used: the link's whole effect on the loop."""

    command: Index  # (ticks,): command in force at the slave's tick, −1 for none yet
    feedback: Index  # (ticks,): feedback used at the master's tick, −1 for none yet


class Rollout(NamedTuple):
    """What a rollout gives: signals by name, one row per tick, up to where the loop diverged."""

    master: dict[
        str, Array
    ]  # (ticks,), of several storeys (ticks, storeys), of several slaves (ticks, slaves)
    slaves: dict[str, dict[str, Array]]  # by role, (ticks,) each: command of the transfer system, measured
    exchange: dict[str, MessagesUsed]  # by role of the slave
    finite: bool  # False where the loop diverged
    ticks: int  # rows of every signal


class MasterLaboratory(NamedTuple):
    """The master's laboratory."""

    site: Site
    position: int  # channel that its compensator compares with the target
    force: int  # channel of the force that enters the building


class Slave(NamedTuple):
    """A slave's laboratory, which follows the target that it is sent."""

    site: Site
    compensator: Compensator
    position: int  # channel that its compensator compares with the target
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


class ClosedLoop(NamedTuple):
    """The state of a closed loop."""

    building: Substructure
    own: MasterLaboratory
    slaves: tuple[Slave, ...]  # all of one record; of as many as take part, the first ones
    traffic: Traffic


def on_time(ticks: int) -> MessagesUsed:
    """The exchange in which every message is in time: command k is used at tick k, feedback k at tick k + 1."""
    return MessagesUsed(np.arange(ticks), np.arange(ticks) - 1)


def simulate(
    plan: Plan,
    ground: Array,
    *,
    effects: Effects | None = None,
    slaves: Mapping[str, System] | None = None,
    seed: int | None = None,
    noise: Mapping[str, Array] | None = None,
    exchange: Mapping[str, MessagesUsed] | None = None,
    farthest: float = LARGEST,
) -> Rollout:
    """Closed loop of a plan: its models over the whole test, with effects laid over them where given.

    `ground` as `substructure.ground_rows` gives it. Every slave is what `plan` and `effects` say, or its entry in
    `slaves`, systems by role; with no entry at all, `{}`, building and master's laboratory move alone, which takes a
    building on which no slave's force acts. With a `seed` the sensors read what the emulated laboratories read under
    that seed of the plan; `noise` are rows (ticks, channels) that err in the readings of single roles; else they are
    free of noise. Of the link's effects only the `exchange` of each role counts, in time where it is not given. A
    command of the master's laboratory, or without one a floor's displacement, that is not finite or beyond `farthest`
    (m) ends the loop.

    Raises:
        InputError: a building on which slaves' forces act is to move alone, noise is given twice or has another
            shape, or a model, method or parameter is unknown to the registries.
    """
    of_master = System(plan, effects or Effects())
    systems = {role: System(plan.of(role), of_master.effects) for role in plan.roles}
    systems = systems if slaves is None else dict(slaves)
    if not systems:
        check_alone(plan)
    ticks, given = plan.ticks, exchange or {}
    used = {role: given.get(role) or on_time(ticks) for role in systems}
    drawn = errors({MASTER: of_master} | systems, seed, noise or {})
    loop = at_rest(of_master, systems, ground, used, drawn)
    filled, hosted = roll(loop, farthest), kinds_of(plan)
    return Rollout(
        master_signals(plan, loop, list(systems), filled),
        {
            role: slave_signals(hosted[role], slave, filled)
            for role, slave in zip(systems, loop.slaves, strict=False)
        },
        used,
        filled == ticks,
        filled,
    )


def check_alone(plan: Plan) -> None:
    """Raise InputError where the force of a slave acts on the building, which then cannot move without it."""
    acting = [role for role in plan.roles if kinds.kind_of(plan, role).coupling(plan.of(role)).scale != 0.0]
    if acting:
        raise InputError(
            f"The force of the {title(acting[0])} acts on the building, which is to move without its slaves: leave "
            "them in, or set amd in [control] to false where they carry dampers only."
        )


def at_rest(
    master: System,
    slaves: Mapping[str, System],
    ground: Array,
    exchange: Mapping[str, MessagesUsed],
    errors: Mapping[str, Array],
) -> ClosedLoop:
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
    hosted = kinds_of(plan)
    followers = [follower(hosted[role], system, errors[role]) for role, system in slaves.items()]
    mine, followers = compiled(own(hosted.get(MASTER), master, errors.get(MASTER)), followers)
    return ClosedLoop(building, mine, tuple(followers), traffic)


def compiled(mine: MasterLaboratory, slaves: list[Slave]) -> tuple[MasterLaboratory, list[Slave]]:
    """The laboratories in records for which `roll` is compiled, whatever stands in them.

    A column at the master with tables at the slaves has a loop of its own, into which their kernels are merged. All
    others share one for laboratories of whichever kind, for two slaves or a larger power of two: the places that none
    takes are never moved. A new combination of kinds is so compiled already, at half the speed.
    """
    if isinstance(mine.site.lab, ColumnLab) and all(isinstance(one.site.lab, TableLab) for one in slaves):
        return mine, slaves or [spare()]
    count = max(2, 1 << (len(slaves) - 1).bit_length())
    filled = [*slaves, *[spare()] * (count - len(slaves))]
    mine = mine._replace(site=site.of_any(mine.site))
    return mine, [one._replace(site=site.of_any(one.site)) for one in filled]


@cache
def spare() -> Slave:
    """A slave with a table that takes no part."""
    return follower(TABLE, System(Plan()), np.zeros((1, len(TABLE.channels.names))))


def own(kind: Kind | None, system: System, errors: Array | None) -> MasterLaboratory:
    """The master's laboratory at rest, or none."""
    if kind is None or errors is None:
        return MasterLaboratory(site.none(system.plan.ticks), 0, 0)
    return MasterLaboratory(site.build(kind, system, errors), *channels(kind))


def channels(kind: Kind) -> tuple[int, int]:
    """The channels of position and force among those that a kind measures."""
    names = kind.channels.names
    return names.index(kind.channels.position), names.index(kind.channels.force)


def follower(kind: Kind, system: System, errors: Array) -> Slave:
    """A slave's laboratory at rest."""
    plan, ticks = system.plan, errors.shape[0]
    chosen = kind.compensator(plan)
    return Slave(
        site.build(kind, system, errors),
        compensators.build(chosen.kind, chosen.parameters, plan.test.interval, chosen.where),
        *channels(kind),
        np.zeros(ticks),
        np.zeros(1),
    )


def errors(systems: Mapping[str, System], seed: int | None, given: Mapping[str, Array]) -> dict[str, Array]:
    """What errs in the readings of every laboratory, (ticks, channels) by role; `systems` begin with the master's.

    Raises:
        InputError: the noise is given twice, or has another shape.
    """
    hosted = kinds_of(systems[MASTER].plan)
    result = {}
    for place, (role, system) in enumerate(systems.items(), noise.LAB_A):
        if role not in hosted:
            continue
        kind, ticks = hosted[role], system.plan.ticks
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
def roll(loop: ClosedLoop, farthest: float) -> int:
    """Fill the rows tick by tick; return how many ticks had commands and displacements within `farthest` (m)."""
    building, own, traffic = loop.building, loop.own, loop.traffic
    interval = building.scalars[substructure.INTERVAL]
    read = own.site.measured
    for tick in range(traffic.outputs.shape[0]):
        site.read(own.site, tick, tick * interval)
        for place in range(traffic.used.shape[1]):
            answered = traffic.feedback[place, tick]
            traffic.used[tick, place] = traffic.forces[answered, place] if answered >= 0 else 0.0
            substructure.receive(building, place, traffic.used[tick, place])
        substructure.advance(building, tick, read[tick, own.position], read[tick, own.force])
        if not within(building, farthest):
            return tick
        for place in range(building.output.size):
            traffic.outputs[tick, place] = building.output[place]
        kinds.advance(own.site.lab, own.site.truth, building.output[COMMAND], building.output[EFFORT])
        follow_all(loop.slaves, traffic, tick, interval)
    return traffic.outputs.shape[0]


@jit
def within(building: Substructure, farthest: float) -> bool:
    """Whether the command of the master's laboratory, or without one every floor, is within `farthest` (m)."""
    output, n = building.output, building.mass.size
    if building.codes[substructure.OWN]:
        return abs(output[COMMAND]) <= farthest
    first = output.size - substructure.STOREY_VALUES * n
    inside = True
    for floor in range(n):
        inside = inside and abs(output[first + floor]) <= farthest
    return inside


@jit
def follow(slave: Slave, place: int, traffic: Traffic, tick: int, interval: float) -> None:
    """One tick of a slave: its readings, its command, and its laboratory one interval on."""
    read = slave.site.measured
    site.read(slave.site, tick, tick * interval)
    traffic.forces[tick, place] = read[tick, slave.force]
    sent = traffic.command[place, tick]
    row = traffic.outputs[sent] if sent >= 0 else traffic.nothing
    first = OF_SLAVES + SENT_VALUES * place
    target = row[first + SENT_TARGET]
    wanted = Wanted(
        target,
        row[first + SENT_VELOCITY],
        row[first + SENT_ACCELERATION],
        row[first + SENT_JERK],
        slave.present[0],
        read[tick, slave.position],
    )
    slave.written[tick] = compensators.step(slave.compensator, wanted, interval)
    slave.present[0] = target
    kinds.advance(slave.site.lab, slave.site.truth, slave.written[tick], row[first + SENT_EFFORT])


def follow_all(slaves: tuple[Slave, ...], traffic: Traffic, tick: int, interval: float) -> None:
    """`follow` of every slave that takes part; compiled code only."""
    raise NotImplementedError("Only compiled kernels move slaves of any kinds on.")


@overload(follow_all, jit_options=MERGED, strict=False)  # strict compares annotations too
def _follow_all(slaves: types.BaseTuple, traffic: Any, tick: Any, interval: Any) -> Any:
    """Code for these slaves, whose number the compiler knows; of the last ones some may take no part."""
    count = len(slaves)
    if count == 1:

        def one(slaves: Any, traffic: Any, tick: Any, interval: Any) -> None:
            if traffic.used.shape[1] > 0:
                follow(slaves[0], 0, traffic, tick, interval)

        return one

    def every(slaves: Any, traffic: Any, tick: Any, interval: Any) -> None:
        for place in range(count):
            if place < traffic.used.shape[1]:
                follow(slaves[place], place, traffic, tick, interval)

    return every


def master_signals(plan: Plan, loop: ClosedLoop, slaves: Sequence[str], ticks: int) -> dict[str, Array]:
    """What the master computed, measured and used."""
    result = substructure.named(loop.traffic.outputs[:ticks], plan, slaves)
    if own_kind := kinds.own(plan):
        read = loop.own.site.measured[:ticks]
        result |= {name: read[:, channel] for channel, name in enumerate(own_kind.channels.names)}
    used = {role: loop.traffic.used[:ticks, place] for place, role in enumerate(slaves)}
    return result | per_kind(plan, used, "used")


def per_kind(plan: Plan, values: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Values (ticks,) of each slave's force by the master's signals, those of slaves of one kind together."""
    hosted = kinds_of(plan)
    groups = table.alike({role: hosted[role].channels for role in values})
    return {
        f"{channels.force}_{what}": together([values[role] for role in roles])
        for channels, roles in groups.items()
    }


def together(values: Sequence[Any]) -> Any:
    """One signal of several slaves, (ticks, slaves); of one slave (ticks,)."""
    return values[0] if len(values) == 1 else np.stack(values, axis=1)


def slave_signals(kind: Kind, slave: Slave, ticks: int) -> dict[str, Array]:
    """What a slave wrote and measured."""
    measured = dict(zip(kind.channels.names, slave.site.measured[:ticks].T, strict=True))
    return {kind.channels.command.name: slave.written[:ticks]} | measured


def signals(plan: Plan, rollout: Rollout) -> dict[str, Array]:
    """The rollout's signals by name, as a recording names them; (ticks,), (ticks, storeys) or (ticks, slaves) each.

    Those of a named slave are called `NAME.signal`, those of a slave without a name that the master's own laboratory
    has too `slave.signal`.
    """
    result: dict[str, Array] = {}
    order = kinds.topics(plan)
    own = {row.name for row in order[MASTER] if not row.slaves} - {table.TIME.name}
    for topic, columns in topics(plan, rollout).items():
        name = name_of(topic)
        for row in order[topic]:
            key = row.name
            if row.kind not in (table.FieldType.NUMBER, table.FieldType.STOREYS) or key not in columns:
                continue
            if name and key != table.TIME.name:
                result[f"{name}.{key}"] = columns[key]
            elif topic != MASTER and key in own:
                result[f"{SLAVE}.{key}"] = columns[key]
            elif not name:
                result.setdefault(key, columns[key])
    for name in [name for name in result if name in ages(plan, rollout.slaves)]:
        del result[name]
    return result


def ages(plan: Plan, slaves: Iterable[str]) -> set[str]:
    """The names of the ages of the forces that the master used."""
    hosted = kinds_of(plan)
    return {f"{hosted[role].channels.force}_age" for role in slaves}


def received(plan: Plan, rollout: Rollout) -> dict[str, dict[str, Array]]:
    """What each slave was sent, (ticks,) each, by role and the names of its own topic, at the ticks of its sending."""
    hosted, names = kinds_of(plan), sent_names(plan)
    groups = table.alike({role: hosted[role].channels for role in rollout.slaves})
    result: dict[str, dict[str, Array]] = {}
    for channels, roles in groups.items():
        for place, role in enumerate(roles):
            sent = (rollout.master[name] for name in names[role])
            values = (every if len(roles) == 1 else every[:, place] for every in sent)
            result[role] = dict(zip(channels.sent, values, strict=True))
    return result


def by_role(plan: Plan, rollout: Rollout) -> dict[str, dict[str, Array]]:
    """The building's and the master's signals, and by role what each slave was sent, wrote and measured."""
    sent = received(plan, rollout)
    return {MASTER: rollout.master} | {role: sent[role] | own for role, own in rollout.slaves.items()}


def topics(plan: Plan, rollout: Rollout) -> dict[str, dict[str, Any]]:
    """Everything that a recording of the rollout holds, by topic and signal."""
    seq = np.arange(rollout.ticks)
    own: dict[str, Any] = {"seq": seq, "t": seq.astype(np.float64) * plan.test.interval}
    used = {role: item.feedback[: rollout.ticks] for role, item in rollout.exchange.items()}
    age = {role: np.where(of < 0, 0.0, (seq - of) * plan.test.interval) for role, of in used.items()}
    about = per_kind(plan, used, "seq") | per_kind(plan, age, "age")
    result = {MASTER: own | rollout.master | about}
    sent = received(plan, rollout)
    for role, columns in rollout.slaves.items():
        command = rollout.exchange[role].command[: rollout.ticks]
        came = {name: np.where(command < 0, 0.0, values[command]) for name, values in sent[role].items()}
        result[role] = own | {"command_seq": command} | came | columns
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
