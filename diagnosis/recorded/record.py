"""A recording laid out for the diagnosis: every signal on the ticks of one plan, with what is missing marked."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from common.plan.plan import Plan, ideal, parse
from common.recording.reader import GROUND, Run
from common.roles import MASTER, SLAVE, title
from diagnosis.signals.mask import Mask
from loop import substructure
from models.registry import Array
from models.system import System

MASTER_FIRST = ("master", "slave")
SLAVE_FIRST = ("slave", "master")
OF_SLAVE = ("table_command", "damper_command", "table_displacement", "table_acceleration", "damper_stroke")
LEAST_TICKS = 50


@dataclass(frozen=True)
class Whole:
    """A test with several slaves, of which a record shows one with the master."""

    plan: Plan
    role: str  # of the slave that the record shows
    dampers: Array  # (ticks, slaves) forces that the master used, N
    others: dict[str, System] = field(default_factory=dict)  # what the other slaves were found to be, by role

    def joined(self, plan: Plan) -> Plan:
        """The whole test with the master's tables of a plan of one slave."""
        whole = self.plan
        return replace(
            plan,
            slave=whole.slave,
            slaves=whole.slaves,
            follows_in=whole.follows_in,
            table=whole.table,
            damper=whole.damper,
            control=whole.control,
        )


@dataclass(frozen=True)
class Record:
    """Signals (ticks,) or (ticks, storeys) by name; a value that is missing is that of the tick before."""

    plan: Plan
    run: Run
    ticks: int
    signals: dict[str, Array]
    present: dict[str, Mask]
    ground: Array | None  # (2, ticks + 1) as the plan believes it, None where it is not known
    other_plan: bool = False  # whether the building or its control were other than this plan's
    whole: Whole | None = None  # the test around it, where that has several slaves

    def has(self, *names: str) -> bool:
        """Whether all these signals are there for most of the test."""
        return all(name in self.signals and self.present[name].mean() > 0.5 for name in names)

    @property
    def time(self) -> Array:
        """Time of each tick, s."""
        return np.arange(self.ticks, dtype=np.float64) * self.plan.test.interval


def build(run: Run, plan: Plan | None = None, *, against_ideal: bool = False, role: str = SLAVE) -> Record:
    """The record of a recording under a plan, its own where none is given.

    Of a test with several slaves it shows the master and the slave whose `role` is given.
    With `against_ideal` it is compared with the pure simulation of that plan: transfer systems that do what
    the building wants. Their command is then the target, and their compensation a part of them.

    Raises:
        InputError: there is no plan, it names other slaves, or there is no signal to look at.
    """
    own = parse(run.metadata["plan"]["toml"], run.path.parent) if "plan" in run.metadata else None
    chosen = plan or own
    if chosen is None:
        raise InputError(f"{run.path} carries no plan: give the one that it was recorded under with --plan.")
    check_slaves(run, chosen)
    whole = run.columns.get(MASTER, {}).get("damper_force_used") if chosen.slaves else None
    every, run, chosen = chosen, run.of(role), chosen.of(role)
    own = own.of(role) if own is not None and own.slaves else own
    topics = [topic for topic in MASTER_FIRST if run.has(topic)]
    if not topics:
        raise InputError(f"{run.path} holds no signals of a master or a slave to diagnose.")
    ticks = 1 + max(int(run.sequences[topic].max()) for topic in topics)
    signals, present = on_ticks(run, topics, ticks)
    tables = ("structure", "compensator", "control", "column")
    other = own is not None and any(getattr(own, name) != getattr(chosen, name) for name in tables)
    if against_ideal:
        chosen, every = ideal(chosen), ideal(every)
        for command, target in (("actuator_command", "column_target"), ("table_command", "table_target")):
            if target in signals:
                signals[command], present[command] = wanted(signals, present, target)
    known = plan is None or (own is not None and own.ground_motion == plan.ground_motion)
    ground = believed_ground(run, chosen, ticks, known)
    around = None
    if whole is not None:
        used, _ = laid_out(whole.reshape(whole.shape[0], -1), run.sequences[MASTER], ticks)
        around = Whole(every, role, used)
    return Record(chosen, run, ticks, signals, present, ground, other, around)


def on_ticks(run: Run, topics: list[str], ticks: int) -> tuple[dict[str, Array], dict[str, Mask]]:
    """The topics' numbers on their ticks, and where they are there; what two topics hold is the first one's."""
    signals: dict[str, Array] = {}
    present: dict[str, Mask] = {}
    for topic in topics:
        places = run.sequences[topic]
        for name, values in run.columns[topic].items():
            if name in signals and not (topic == "slave" and name in OF_SLAVE):
                continue
            if not np.issubdtype(values.dtype, np.number):
                continue
            signals[name], present[name] = laid_out(np.asarray(values, dtype=np.float64), places, ticks)
    return signals, present


def check_slaves(run: Run, plan: Plan) -> None:
    """Raise InputError where the recording's slaves are not those of the plan."""
    if run.roles != plan.roles:
        raise InputError(
            f"{run.path} is of the {' and the '.join(map(title, run.roles))}, but the plan is of the "
            f"{' and the '.join(map(title, plan.roles))}: give the plan of that test with --plan."
        )


def wanted(signals: dict[str, Array], present: dict[str, Mask], target: str) -> tuple[Array, Mask]:
    """A target as the command of an ideal transfer system: what is wanted for the interval's end.

    The recorded column target is that of the tick, the table's that of the interval's end.
    """
    values, there = signals[target], present[target]
    if target == "table_target":
        return values, there
    return np.append(values[1:], values[-1]), np.append(there[1:], there[-1])


def laid_out(values: Array, places: NDArray[np.int64], ticks: int) -> tuple[Array, Mask]:
    """Values on their ticks, held over holes, and where they are finite and there."""
    result = np.zeros((ticks, *values.shape[1:]))
    there = np.zeros(ticks, dtype=bool)
    finite = np.isfinite(values.reshape(values.shape[0], -1)).all(axis=1)
    there[places[finite]] = True
    result[places[finite]] = values[finite]
    last = np.maximum.accumulate(np.where(there, np.arange(ticks), -1))
    first = int(np.argmax(there)) if there.any() else 0
    return result[np.where(last < 0, first, last)], there


def believed_ground(run: Run, plan: Plan, ticks: int, known: bool) -> Array | None:
    """Ground rows that the plan believes in: those of the recording, or of the plan's record."""
    if known and GROUND in run.attachments:
        rows = np.frombuffer(run.attachments[GROUND], dtype="<f8").reshape(2, -1).copy()
    else:
        try:
            rows = substructure.ground_rows(plan, substructure.motion(plan))
        except InputError:
            return None
    return rows if rows.shape[1] > ticks else np.pad(rows, ((0, 0), (0, ticks + 1 - rows.shape[1])), "edge")
