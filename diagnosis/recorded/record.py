"""A recording prepared for the diagnosis: every signal on the ticks of one plan, with missing samples marked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from common.plan.plan import Plan, ideal
from common.plan.read import parse
from common.recording.holds import before, holds
from common.recording.imported import ImportedChannel, ImportedData, imported, logged_alone
from common.recording.run import GROUND, Run
from common.roles import MASTER, SLAVE, title
from common.signals import BUILDING as OF_BUILDING
from common.signals import alike
from diagnosis.recorded.commands import at_targets, completed, received
from diagnosis.recorded.laboratory import RecordedLaboratory, recorded
from diagnosis.signals import clock
from diagnosis.signals.mask import Mask
from diagnosis.signals.noise.rounding import quantum
from laboratories import effects
from laboratories.effects.effect import Effect
from laboratories.effects.sites import BUILDING, LINK, sensors
from laboratories.kinds import kind_of
from loop import substructure
from models.registry import Array
from models.system import System

MASTER_FIRST = ("master", "slave")
SAME = 0.9  # share of the forces used that are values of a reading, from which on all are
# s that a row of static data counts as, whatever the interval of the plan. Fits withhold blocks of a second, and static
# tests have some hundred rows in a cycle.
ROW = 0.01
LEAST_TICKS = 50  # without which nothing is judged: 0.1 s at 2 ms, and fewer ticks than a correlation needs


class Delay(NamedTuple):
    """A delay and its standard deviation, s."""

    about: float = 0.0
    unsure: float = 0.0


class Late(NamedTuple):
    """By how much channels of a logger are late that measure a force, and the others, beside their filters."""

    force: Delay = Delay()
    motion: Delay = Delay()


NOT_LATE = Late()
STEP = 1e-3  # s, about which a command that a logger sampled goes straight


@dataclass(frozen=True)
class WholeTest:
    """A test with several slaves, of which a record shows one with the master."""

    plan: Plan
    role: str  # of the slave that the record shows
    used: Array  # (ticks, slaves) forces that the master used, N
    others: dict[str, System] = field(
        default_factory=dict
    )  # systems of the other slaves as diagnosed, by role


class LoggerStart(NamedTuple):
    """How the ground motion that a logger shows lies to the plan's."""

    late: float  # s, by which it comes later at the first tick, less than zero for earlier
    fast: float  # s by which it comes still later, per s
    blur: float  # m/s², rms by which straight lines and a spline between the plan's ticks differ there


@dataclass(frozen=True)
class Record:
    """Signals (ticks,) or (ticks, storeys) by name; a value that is missing is that of the tick before.

    It shows the master and one slave, or the master alone; `plan` is the one of that slave, `plans` are those of both.
    """

    plan: Plan
    run: Run
    ticks: int
    signals: dict[str, Array]
    present: dict[str, Mask]
    ground: Array | None  # (2, ticks + 1) the ground motion of the plan, None where it is not known
    other_plan: bool = False  # whether the test had another building or control than this plan
    whole: WholeTest | None = None  # the test around it, where that has several slaves
    plans: dict[str, Plan] = field(default_factory=dict)  # by role, as each sees it
    labs: tuple[RecordedLaboratory, ...] = ()  # the laboratories that it shows, the master's first
    held: float | None = None  # test time (s) of the first hold, before which it ends; None without a hold
    fast: float = 0.0  # rate by which the clock of its readings was fast before they were put right
    early: float = 0.0  # s, by which all readings stood before their time until they were put right
    # readings whose first or last ticks a resampling filter spoilt, which do not count
    edges: tuple[str, ...] = ()
    start: LoggerStart | None = None  # of an import whose ground motion is not on the plan's ticks
    late: Late = NOT_LATE  # by which a logger delays all channels of a kind
    # filters and means of channels that its import map does not state, by topic and name
    passed: Mapping[tuple[str, str], ImportedChannel] = field(default_factory=dict)
    # channels whose filter or mean was given the readings at the ticks alone, by topic and name
    at_ticks: frozenset[tuple[str, str]] = frozenset()
    # s, by which channels are late beside filters that the map states, by topic and name
    delayed: Mapping[tuple[str, str], float] = field(default_factory=dict)
    worked_out: tuple[str, ...] = ()  # commands that were not recorded and follow from what was

    @cached_property
    def mapped(self) -> ImportedData | None:
        """The properties of the logger's channels that the import map states, None where rths recorded the test."""
        return imported(self.run)

    @cached_property
    def stated(self) -> ImportedData | None:
        """The properties of the logger's channels that the import map states, with what was found of its filters."""
        said = self.mapped
        for (topic, name), one in self.passed.items():
            said = said and said.behind(topic, name, one)
        for topic, name in sorted(self.at_ticks):
            said = said and said.given_ticks(topic, name)
        for (topic, name), delay in self.delayed.items():
            said = said and said.with_delay(topic, name, delay)
        return said

    @property
    def gapped(self) -> bool:
        """Whether rows are missing, in whose place straight lines stand."""
        return bool(self.mapped and self.mapped.gaps)

    @property
    def static(self) -> bool:
        """Whether its times have no meaning, since only the order of its rows was stated."""
        return is_static(self.run)

    @property
    def steps(self) -> int:
        """Steps in which an interval of laboratories by themselves is played, whose commands a logger sampled.

        It is 0 where a command is reached at the end of its interval.
        """
        if not logged_alone(self.run):
            return 0
        return max(1, math.ceil(self.plan.test.interval / STEP - 1e-9))

    @cached_property
    def catalogue(self) -> dict[str, Effect]:
        """The effects that may act in the part of the test that it shows, by name."""
        found = dict(effects.of_test())
        for lab in self.labs:
            found |= lab.effects()
        order = {site: place for place, site in enumerate(self.sites)}
        return dict(sorted(found.items(), key=lambda item: order.get(item[1].site, 0)))

    @property
    def sites(self) -> list[str]:
        """Its sites in the order in which effects are listed."""
        machines = [[lab.site(site) for site in lab.kind.sites] for lab in self.labs]
        own = [lab.role == MASTER for lab in self.labs]
        first = [site for found, mine in zip(machines, own, strict=True) if mine for site in found]
        rest = [site for found, mine in zip(machines, own, strict=True) if not mine for site in found]
        read = [lab.site(site) for lab in self.labs for site in sensors(lab.kind)]
        return [*BUILDING, *first, LINK, *rest, *read]

    @property
    def systems(self) -> dict[str, System]:
        """Systems of master and slave as the plan says, by role."""
        return {role: System(plan) for role, plan in self.plans.items()}

    @property
    def own(self) -> RecordedLaboratory | None:
        """The master's laboratory."""
        return next((lab for lab in self.labs if lab.role == MASTER), None)

    @property
    def other(self) -> RecordedLaboratory | None:
        """The slave's laboratory."""
        return next((lab for lab in self.labs if lab.role != MASTER), None)

    @property
    def responses(self) -> tuple[str, ...]:
        """The signals by which the gap of the test is judged."""
        return tuple(name for lab in self.labs for name in lab.responses)

    @property
    def targets(self) -> tuple[str, ...]:
        """The target signals of the laboratories."""
        return tuple(lab.signal(lab.kind.channels.target.name) for lab in self.labs)

    @property
    def simulable(self) -> bool:
        """Whether its closed loop can be simulated: its ground motion is known, and its building is the plan's own."""
        return self.ground is not None and self.has("displacement") and not self.plan.foreign

    def unit(self, name: str) -> str:
        """The unit of a signal, empty for one that is not known."""
        rows = (*OF_BUILDING, *(row for lab in self.labs for row in lab.rows))
        return next((row.unit for row in rows if row.name == name), "")

    @property
    def planned_noise(self) -> dict[str, float]:
        """Rms noise of the readings that have one by the plan, by signal."""
        return {name: level for lab in self.labs for name, level in lab.noise.items() if level > 0.0}

    def has(self, *names: str) -> bool:
        """Whether all these signals are there for most of the test."""
        return all(name in self.signals and self.present[name].mean() > 0.5 for name in names)

    @property
    def retimed(self) -> bool:
        """Whether its readings, or the plan's ground motion, were put onto another clock."""
        return self.fast != 0.0 or self.early != 0.0 or self.start is not None

    @property
    def numbered(self) -> bool:
        """Whether it holds the number of a message in each row, as what the controllers log themselves."""
        return self.has("command_seq") or any(self.has(lab.kind.channels.used_seq) for lab in self.labs)

    def put_right(self, fast: float, early: float = 0.0) -> Record:
        """The record with readings of a clock that is fast by a rate, or `early` (s), on the clock of the commands.

        So are the forces that the master used, where they are those that were read.
        """
        there = [lab for lab in self.labs if lab.role != MASTER]
        used = {lab.signal(lab.kind.channels.used): lab.signal(lab.kind.channels.force) for lab in there}
        names = [name for lab in self.labs for name in lab.measured if name in self.signals]
        names += [
            name
            for name, force in used.items()
            if self.has(name, force) and np.isin(self.signals[name], self.signals[force]).mean() > SAME
        ]
        ticks, read = early / self.plan.test.interval, [name for name in names if self.present[name].any()]
        stepped = {name: quantum(self.signals[name][self.present[name]]) > 0.0 for name in read}
        moved = {
            name: clock.put_right(self.signals[name], fast, stepped=yes, early=ticks)
            for name, yes in stepped.items()
        }
        return replace(self, signals=self.signals | moved, fast=self.fast + fast, early=self.early + early)

    @property
    def time(self) -> Array:
        """Time of each tick, s."""
        return np.arange(self.ticks, dtype=np.float64) * self.plan.test.interval


def build(run: Run, plan: Plan | None = None, *, against_ideal: bool = False, role: str = SLAVE) -> Record:
    """The record of a recording under a plan, its own where none is given.

    It shows the master and the slave whose `role` is given, or the master alone where that is the master's role. It
    ends where the test was held first, because from there on forces were not measured at the rate of the test. With
    `against_ideal` the recording is compared with the pure simulation of the plan, whose transfer systems reach every
    target exactly: their command is then the target, and their compensation counts as a part of them.

    Raises:
        InputError: there is no plan, it names other slaves, or there is no signal to look at.
    """
    own = parse(run.metadata["plan"]["toml"], run.path.parent) if "plan" in run.metadata else None
    chosen = plan or own
    if chosen is None:
        raise InputError(f"{run.path} carries no plan: give the one that it was recorded under with --plan.")
    check_slaves(run, chosen)
    if is_static(run):
        chosen = replace(chosen, test=replace(chosen.test, interval=ROW))
    first = next(iter(holds(run.events, chosen.test.interval)), None)
    if first is not None:
        run = before(run, first.begun)
    every, whole = chosen, run
    if role != MASTER:
        run, chosen = run.of(role), chosen.of(role)
        own = own.of(role) if own is not None and own.slaves else own
    topics = [topic for topic in MASTER_FIRST if run.has(topic)]
    if not topics:
        raise InputError(
            f"{run.path} holds no signals of a master or a slave, so that nothing can be diagnosed."
        )
    ticks = 1 + max(int(run.sequences[topic].max()) for topic in topics)
    tables = ("structure", "compensator", "control", "column")
    other = own is not None and any(getattr(own, name) != getattr(chosen, name) for name in tables)
    if against_ideal:
        chosen, every = ideal(chosen), ideal(every)
    plans = {MASTER: every} | ({role: chosen} if role != MASTER else {})
    labs = recorded(every, plans)
    signals, present = on_ticks(run, topics, without_rows(run, chosen.test.interval, ticks), labs)
    if against_ideal:
        at_targets(signals, present, labs)
    stated = imported(run)
    on_their_way = received(signals, labs, stated) if stated is not None else {}
    worked_out = completed(signals, present, labs, chosen.test.interval, on_their_way)
    known = plan is None or (own is not None and own.ground_motion == plan.ground_motion)
    ground = believed_ground(run, chosen, ticks, known)
    around = None
    if every.slaves and whole.has(MASTER):
        around = WholeTest(every, role, used_forces(whole, every, ticks))
    held = first.begun * chosen.test.interval if first is not None else None
    return Record(
        chosen, run, ticks, signals, present, ground, other, around, plans, labs, held, worked_out=worked_out
    )


def is_static(run: Run) -> bool:
    """Whether the times of a recording have no meaning, since only the order of its rows was stated."""
    stated = imported(run)
    return stated is not None and stated.static


def used_forces(run: Run, plan: Plan, ticks: int) -> Array:
    """Forces of all slaves that the master used, (ticks, slaves) N; zero where they were not recorded."""
    result = np.zeros((ticks, len(plan.roles)))
    for channels, roles in alike({role: kind_of(plan, role).channels for role in plan.roles}).items():
        values = run.columns[MASTER].get(channels.used)
        if values is not None:
            rows, _ = laid_out(values.reshape(values.shape[0], -1), run.sequences[MASTER], ticks)
            result[:, [plan.roles.index(role) for role in roles]] = rows
    return result


def on_ticks(
    run: Run, topics: list[str], missing: Mask, labs: tuple[RecordedLaboratory, ...]
) -> tuple[dict[str, Array], dict[str, Mask]]:
    """The topics' numeric signals on their ticks, and where they are present; nothing is where `missing` (ticks,) is.

    Of a signal that two topics hold the master's is taken, except for signals that the slave wrote and measured itself.
    """
    signals: dict[str, Array] = {}
    present: dict[str, Mask] = {}
    ticks = missing.size
    there = [lab for lab in labs if lab.role != MASTER]
    own = {name: lab for lab in there for name in (*lab.kind.channels.drives, *lab.kind.channels.names)}
    named = own | {name: lab for lab in there if lab.ahead for name in lab.kind.channels.sent}
    for topic in topics:
        places = run.sequences[topic]
        for given, values in run.columns[topic].items():
            lab = named.get(given) if topic == SLAVE else None
            name = lab.signal(given) if lab else given
            if name in signals and not (topic == SLAVE and given in own):
                continue
            if not np.issubdtype(values.dtype, np.number):
                continue
            signals[name], present[name] = laid_out(np.asarray(values, dtype=np.float64), places, ticks)
            present[name] &= ~missing
    return signals, present


def without_rows(run: Run, interval: float, ticks: int) -> Mask:
    """The ticks (ticks,) at which an imported recording has no rows, and straight lines in their place."""
    stated, result = imported(run), np.zeros(ticks, dtype=bool)
    t = np.arange(ticks) * interval
    for begin, end in stated.gaps if stated else ():
        result |= (t > begin) & (t < end)
    return result


def check_slaves(run: Run, plan: Plan) -> None:
    """Raise InputError where the recording's slaves are not those of the plan."""
    if run.roles != plan.roles:
        raise InputError(
            f"{run.path} is of the {' and the '.join(map(title, run.roles or [MASTER]))}, but the plan is of the "
            f"{' and the '.join(map(title, plan.roles or [MASTER]))}: give the plan of that test with --plan."
        )


def laid_out(values: Array, places: NDArray[np.int64], ticks: int) -> tuple[Array, Mask]:
    """Values on their ticks, the last one held where a tick is missing, and where they are present and finite."""
    result = np.zeros((ticks, *values.shape[1:]))
    there = np.zeros(ticks, dtype=bool)
    finite = np.isfinite(values.reshape(values.shape[0], -1)).all(axis=1)
    there[places[finite]] = True
    result[places[finite]] = values[finite]
    last = np.maximum.accumulate(np.where(there, np.arange(ticks), -1))
    first = int(np.argmax(there)) if there.any() else 0
    return result[np.where(last < 0, first, last)], there


def believed_ground(run: Run, plan: Plan, ticks: int, known: bool) -> Array | None:
    """Rows of the plan's ground motion: those attached to the recording where the plan is the same, else computed."""
    if known and GROUND in run.attachments:
        rows = np.frombuffer(run.attachments[GROUND], dtype="<f8").reshape(2, -1).copy()
    else:
        try:
            rows = substructure.ground_rows(plan, substructure.motion(plan))
        except InputError:
            return None
    return rows if rows.shape[1] > ticks else np.pad(rows, ((0, 0), (0, ticks + 1 - rows.shape[1])), "edge")
