"""The simulation of a whole test, compiled: the building, the master's laboratory, and those of any number of slaves.

Recordings are compared with it, and tests compare the real loops with it bit by bit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba.core import types
from numba.extending import overload
from numpy.typing import NDArray

from common import signals as table
from common.errors import InputError
from common.plan.plan import Plan
from common.roles import MASTER, title
from laboratories import kinds
from laboratories.column.model import ColumnLab
from laboratories.kind import Kind
from laboratories.kinds import kinds_of
from laboratories.sensors import noise
from laboratories.table.kind import TABLE
from laboratories.table.record import TableLab
from loop import assembly, site, substructure
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

# The C library hands freed memory at the end of the heap back to the system where it is more than twice the largest
# block freed so far, and the 5 MB of a rollout are then fetched anew page by page, which takes half as long as the
# rollout. This block, freed at once and never written to, raises that limit to 32 MB (M_MMAP_THRESHOLD in mallopt(3)).
np.empty(16 << 20, dtype=np.uint8)

LARGEST = float(np.finfo(np.float64).max)  # m: no finite command exceeds it


class MessagesUsed(NamedTuple):
    """The message that each tick used, which is the whole effect of the link on the loop."""

    command: Index  # (ticks,): command in force at the slave's tick, −1 for none yet
    feedback: Index  # (ticks,): feedback used at the master's tick, −1 for none yet


class Rollout(NamedTuple):
    """The result of a simulation: signals by name, one row per tick, up to where the loop diverged."""

    master: dict[str, Array]  # (ticks,); with a second axis for several storeys or several slaves
    slaves: dict[str, dict[str, Array]]  # by role, (ticks,) each: command of the transfer system, measured
    exchange: dict[str, MessagesUsed]  # by role of the slave
    finite: bool  # False if the loop diverged
    ticks: int  # rows of every signal


class MasterLaboratory(NamedTuple):
    """The master's laboratory."""

    site: Site
    position: int  # channel that its compensator compares with the target
    force: int  # channel of the force that enters the building


class Slave(NamedTuple):
    """A slave's laboratory, which follows the target sent to it."""

    site: Site
    compensator: Compensator
    position: int  # channel that its compensator compares with the target
    force: int  # channel of the force that goes back to the building
    written: Array  # (ticks,) commands of its transfer system, m
    present: Array  # (1,) target of the present tick, m


class Traffic(NamedTuple):
    """The data exchanged between the building and its slaves."""

    outputs: Array  # (ticks, width): the building's output rows, from which the slaves' commands are taken
    nothing: Array  # (width,) zeros: the row that a slave uses before its first command
    forces: Array  # (ticks, slaves) as measured, N
    used: Array  # (ticks, slaves) as the building used them, N
    command: Index  # (slaves, ticks), as in `Exchange`
    feedback: Index  # (slaves, ticks)


class ClosedLoop(NamedTuple):
    """The state of a closed loop."""

    building: Substructure
    own: MasterLaboratory
    slaves: tuple[Slave, ...]  # all of one class of record; those that take part come first
    traffic: Traffic


def on_time(ticks: int) -> MessagesUsed:
    """The exchange without delays: command k is used at tick k, feedback k at tick k + 1."""
    return MessagesUsed(np.arange(ticks), np.arange(-1, ticks - 1))


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
    """Simulate the closed loop of a plan's models over the whole test, with effects where given.

    `ground` is that of `substructure.ground_rows`. Every slave follows from `plan` and `effects`, or is its entry in
    `slaves`, systems by role; with `slaves` empty, the building and the master's laboratory are simulated alone, which
    requires that no slave's force acts on the building. With a `seed`, the sensors have the noise that the emulated
    laboratories have under that seed of the plan; `noise` gives errors (ticks, channels) of the readings of single
    roles; otherwise the readings have no noise. `exchange` gives the messages used by each role's link, which is
    without delays where it is not given. The loop ends where a command of the master's laboratory, or without one a
    floor's displacement, is not finite or beyond `farthest` (m).

    Raises:
        InputError: slaves are left out although their forces act on the building, noise is given twice or has a wrong
            shape, or a model, method or parameter is unknown.
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
    """Raise InputError where the force of a slave acts on the building, which then cannot be simulated without it."""
    acting = [role for role in plan.roles if kinds.kind_of(plan, role).coupling(plan.of(role)).scale != 0.0]
    if acting:
        raise InputError(
            f"The force of the {title(acting[0])} acts on the building, which therefore cannot be simulated without "
            "its slaves: include them, or set amd in [control] to false if they carry dampers only."
        )


def at_rest(
    master: System,
    slaves: Mapping[str, System],
    ground: Array,
    exchange: Mapping[str, MessagesUsed],
    errors: Mapping[str, Array],
) -> ClosedLoop:
    """The closed loop before its first tick; `slaves`, `exchange` and `errors` of the readings by role.

    Rows of its results hold anything until `roll` has filled them.
    """
    plan, count = master.plan, len(slaves)
    ticks = plan.ticks
    building = assembly.build(plan, ground, master.effects.p_delta, slaves=count > 0)
    traffic = Traffic(
        np.empty((ticks, building.output.size)),
        np.zeros(building.output.size),
        np.empty((ticks, count)),
        np.empty((ticks, count)),
        side_by_side([exchange[role].command for role in slaves], ticks),
        side_by_side([exchange[role].feedback for role in slaves], ticks),
    )
    hosted = kinds_of(plan)
    followers = [follower(hosted[role], system, errors[role]) for role, system in slaves.items()]
    mine, followers = compiled(own(hosted.get(MASTER), master, errors.get(MASTER)), followers)
    return ClosedLoop(building, mine, tuple(followers), traffic)


def side_by_side(numbers: Sequence[Index], ticks: int) -> Index:
    """The numbers (ticks,) of each slave as rows (slaves, ticks); those of a single slave are not copied."""
    whole = numbers[0] if len(numbers) == 1 else numbers
    return np.ascontiguousarray(whole, dtype=np.int64).reshape(len(numbers), ticks)


def compiled(mine: MasterLaboratory, slaves: list[Slave]) -> tuple[MasterLaboratory, list[Slave]]:
    """The laboratories in records for which `roll` is compiled.

    A column at the master with tables at the slaves has a compiled loop of its own, into which their kernels are
    merged. All other combinations share a loop for laboratories of any kind and for two slaves or a larger power of
    two, in which unused places are never advanced. So a new combination of kinds needs no compilation; it runs at half
    the speed.
    """
    if isinstance(mine.site.lab, ColumnLab) and all(isinstance(one.site.lab, TableLab) for one in slaves):
        return mine, slaves or [spare()]
    count = max(2, 1 << (len(slaves) - 1).bit_length())
    filled = [*slaves, *[spare()] * (count - len(slaves))]
    mine = mine._replace(site=site.of_any(mine.site))
    return mine, [one._replace(site=site.of_any(one.site)) for one in filled]


@cache
def spare() -> Slave:
    """A slave with a table, for an unused place."""
    return follower(TABLE, System(Plan()), np.zeros((1, len(TABLE.channels.names))))


def own(kind: Kind | None, system: System, errors: Array | None) -> MasterLaboratory:
    """The master's laboratory at rest, or none."""
    if kind is None or errors is None:
        return MasterLaboratory(site.none(system.plan.ticks), 0, 0)
    return MasterLaboratory(site.build(kind, system, errors), *channels(kind))


def channels(kind: Kind) -> tuple[int, int]:
    """The indices of position and force among the measured channels of a kind."""
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
        np.empty(ticks),
        np.zeros(1),
    )


def errors(systems: Mapping[str, System], seed: int | None, given: Mapping[str, Array]) -> dict[str, Array]:
    """The errors of every laboratory's readings, (ticks, channels) by role; `systems` begin with the master's.

    Raises:
        InputError: the noise is given twice, or has a wrong shape.
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
    """One tick of a slave: its readings, its command, and the advance of its laboratory by an interval."""
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
    """Call `follow` for every slave that takes part; for compiled code only."""
    raise NotImplementedError("Only compiled code can advance slaves of any kinds.")


@overload(follow_all, jit_options=MERGED, strict=False)  # strict compares annotations too
def _follow_all(slaves: types.BaseTuple, traffic: Any, tick: Any, interval: Any) -> Any:
    """The code for a tuple of slaves, whose length the compiler knows; the last ones may be unused."""
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
    """The signals that the master computed, measured and used."""
    result = substructure.named(loop.traffic.outputs[:ticks], plan, slaves)
    if own_kind := kinds.own(plan):
        read = loop.own.site.measured[:ticks]
        result |= {name: read[:, channel] for channel, name in enumerate(own_kind.channels.names)}
    used = {role: loop.traffic.used[:ticks, place] for place, role in enumerate(slaves)}
    return result | per_kind(plan, used, "used")


def per_kind(plan: Plan, values: Mapping[str, Any], what: str) -> dict[str, Any]:
    """Values (ticks,) for each slave's force by the names in the master's topic.

    Slaves with the same channels share one.
    """
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
    """The signals that a slave wrote and measured."""
    measured = dict(zip(kind.channels.names, slave.site.measured[:ticks].T, strict=True))
    return {kind.channels.command.name: slave.written[:ticks]} | measured
