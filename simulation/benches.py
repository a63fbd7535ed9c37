"""The loop of a bench test: one rig, one programme, one recording; no other laboratory and no network."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

from common import signals
from common.errors import InputError, InterlockError, RigError, RthsError
from common.host.clock import Clock, MonotonicClock, VirtualClock, unix_ns
from common.plan.kinds import COLUMN, TABLE
from common.plan.limits import LimitViolation
from common.plan.patience import strict
from common.plan.plan import Plan
from common.plan.reality import Reality
from common.recording.rows import RowPacker, other
from common.recording.run import CLOCK
from common.recording.writer import Recording
from common.rig import GuardedRig, command_of
from common.roles import MASTER, name_of
from common.roles import kind_of as role_kind
from common.signals import SEQ, TIME, Signal
from common.terminal.telling import Tell, untold
from laboratories.kind import Chosen, Kind
from laboratories.kinds import kind_of
from laboratories.limits import first_beyond, limited
from loop import rigs
from models import excitation
from models.compensators.follower import Follower
from models.excitation import POSITION, Programme, ProgrammeSegment, Reach
from recorder import files
from recorder.sink import FileSink, Sink, ThreadedSink

LEAD_NS = 100_000_000  # before the first tick: what is left to prepare takes a few ms
UNCOMPENSATED = Chosen("none", {}, "compensator")

TARGET = "target"
"""The bench test of any laboratory: its target, within a share of its limits."""

KIND_OF_PART = {"column": COLUMN, "actuator": COLUMN, "table": TABLE, "damper": TABLE}
OF_EFFORT = ("damper",)  # parts that a motor's force moves, while the target stands still

# of the limits on displacement and on rates: a bench test stays clear of every limit
SHARE, HALF = 0.2, 0.5
# where a kind has no such limit: what actuators and tables of the shipped plans bear
REACH = Reach(5e-3, 0.25, 3.0)


class Order(NamedTuple):
    """Which bench test is wanted, and in which role's laboratory."""

    part: str
    compensated: bool = False
    only: tuple[str, ...] = ()
    real_time: bool = False
    name: str = ""  # whose laboratory it is: a slave's name, master or slave; empty for the only one that has the part


class BenchResult(NamedTuple):
    """What a bench test has given."""

    path: Path
    part: str
    interval: float
    ticks: int
    late: int
    segments: tuple[ProgrammeSegment, ...]
    error: RthsError | None


def play(
    plan: Plan,
    reality: Reality,
    order: Order,
    path: Path,
    stopping: Callable[[], str],
    tell: Tell = untold,
) -> BenchResult:
    """Play a bench test on the plan's rig, or on the reality's, and record it.

    Raises:
        InputError: a piece that the part does not have, a rig that cannot be built, or a file not writable.
    """
    role = role_of(plan, order.part, order.name)
    bench = Bench(plan.of(role), role, kind_of(plan, role), reality.of(role), order)
    plan = bench.plan
    clock: Clock = MonotonicClock() if order.real_time else VirtualClock()
    epoch_ns = unix_ns() if order.real_time else 0
    recording = begin(path, bench, order, epoch_ns)
    file_sink = FileSink(recording, clock)
    sink: Sink = ThreadedSink(file_sink) if order.real_time else file_sink
    done, late, error = 0, 0, None
    try:
        with armed(bench.rig, sink, epoch_ns):
            done, late = loop(bench, clock, sink, epoch_ns, stopping, tell)
    except StoppedError as stop:
        done, late, error = stop.ticks, stop.late, stop.error
    except RthsError as failure:
        error = failure
    finally:
        cause = str(error) if error else "completed"
        sink.close({"outcome": "stopped" if error else "completed", "cause": cause, "ticks": str(done)}, {})
    if sink.failure and error is None:
        error = InterlockError(f"The recording is lost: {sink.failure}")
    return BenchResult(path, order.part, plan.test.interval, done, late, bench.segments, error)


def role_of(plan: Plan, part: str, name: str = "") -> str:
    """The role whose laboratory has a part: of that name, or the only one.

    `name` is a slave's, or `master` or `slave` for those without one.

    Raises:
        InputError: no such laboratory has the part, or several have it and none is named.
    """
    wanted = KIND_OF_PART.get(part, "")
    having = [role for role, kind in plan.kinds.items() if not wanted or kind == wanted]
    names = [name_of(role) or role for role in having]
    if name in names:
        return having[names.index(name)]
    what = part if wanted else "laboratory"
    if name or not having:
        whose = f"The plan's {name}" if name else "No laboratory of the plan"
        lacks = "has no" if name else "has a"
        known = f": it is in that of the {', '.join(names)}" if having else ""
        raise InputError(f"{whose} {lacks} {what}{known}; look at kind in [master] and [slave].")
    if len(having) > 1:
        raise InputError(f"Several laboratories have a {what}: say which with --name ({', '.join(names)}).")
    return having[0]


def chosen(plan: Plan, kind: Kind, order: Order) -> Programme:
    """The programme asked for; raises InputError where the part has no such piece."""
    interval, seed = plan.test.interval, plan.test.seed
    if order.part == TARGET:
        pieces = excitation.target(interval, reach(plan, kind))
    else:
        pieces = excitation.PARTS[order.part](interval, seed)
    names = [piece.name for piece in pieces]
    for word in order.only:
        if not any(name.startswith(word) for name in names):
            raise InputError(f"The bench test of the {order.part} has no piece '{word}': {', '.join(names)}.")
    return excitation.programme(pieces, interval, order.only)


def reach(plan: Plan, kind: Kind) -> Reach:
    """How far and how fast the target of a kind may go in a bench test, by the limits that hold beside a rig."""
    limits, channels, limited = kind.limits(strict(plan)), kind.channels, kind.limited
    ways = (channels.target.name, channels.command.name, channels.position)
    way = min(limits.get(name, math.inf) for name in ways)
    shares = (
        SHARE * way,
        HALF * limits.get(limited.velocity, math.inf),
        HALF * limits.get(limited.acceleration, math.inf),
    )
    return Reach(*(most if math.isfinite(most) else usual for most, usual in zip(shares, REACH, strict=True)))


class StoppedError(Exception):
    """A bench test ended before its last tick."""

    def __init__(self, error: RthsError, ticks: int, late: int) -> None:
        super().__init__(str(error))
        self.error, self.ticks, self.late = error, ticks, late


@contextlib.contextmanager
def armed(rig: GuardedRig, sink: Sink, at_ns: int) -> Iterator[None]:
    """The rig armed, and disarmed whatever happens; what it complains of then is recorded."""
    rig.arm()
    try:
        yield
    finally:
        if complaint := rig.disarm():
            values = (0.0, "bench", "warning", "disarm", str(complaint), dict[str, float]())
            sink.put([other("event", at_ns, at_ns, values)])


class Bench:
    """One laboratory alone: it follows the programme, or stands still under its motor's force.

    The target recorded is that of the tick at the master, that of the interval's end at a slave, as in a whole test.
    """

    def __init__(self, plan: Plan, role: str, kind: Kind, reality: Reality, order: Order) -> None:
        self.kind, self.topic = kind, role_kind(role)
        programme = chosen(plan, kind, order)
        self.segments = programme.segments
        self.plan = plan.with_ticks(programme.motion.shape[1] - 1)
        self.rig = rigs.build(reality, role, paced=order.real_time)
        channels = kind.channels
        self._position = channels.names.index(channels.position)
        names = (*channels.names, channels.target.name, *channels.drives)
        self._limits = limited(kind.limits(plan), names, {row.name: row.unit for row in self.rows})
        self.packer = RowPacker({self.topic: self.rows}, plan.storeys)
        self._command = command_of(channels)
        self._ahead = int(role != MASTER)
        self._force = programme.motion[POSITION] if order.part in OF_EFFORT else None
        compensator = kind.compensator(plan) if order.compensated else UNCOMPENSATED
        self._follow = Follower(compensator, programme, plan.test.interval, compensator.where)

    @property
    def rows(self) -> tuple[Signal, ...]:
        """What is recorded at a tick."""
        channels = self.kind.channels
        return (SEQ, TIME, *channels.driving, channels.command, *channels.measured)

    def tick(self, tick: int) -> tuple[tuple[float, ...], LimitViolation | None]:
        """Read, compute, write; the recorded values behind seq and t, and the violation of a limit."""
        measured = self.rig.read()
        if self._force is None:
            _, command = self._follow(tick, measured[self._position])
            target, force = self._follow.wanted(tick + self._ahead), 0.0
        else:
            target, command, force = 0.0, 0.0, float(self._force[tick + 1])
        effort = (force,) if self.kind.channels.effort else ()
        wanted = self._command(command, *effort)
        violation = first_beyond(self._limits, (*measured, target, *wanted))
        if not violation:
            self.rig.write(wanted)
        return (target, *effort, command, *measured), violation


def begin(path: Path, bench: Bench, order: Order, at_ns: int) -> Recording:
    """A recording of one part's in- and outputs, with what was asked of it in the metadata `bench`."""
    plan = bench.plan
    recording = Recording(
        path, plan.test.name, plan.storeys, {bench.topic: bench.rows, "event": signals.EVENT}
    )
    recording.metadata("plan", {"toml": plan.toml(), "digest": plan.digest()})
    recording.describe()
    recording.metadata("versions", {name: metadata.version(name) for name in files.PACKAGES})
    recording.metadata("host", files.host())
    recording.metadata(CLOCK, {"kind": "real" if order.real_time else "virtual"})
    segments = json.dumps([segment._asdict() for segment in bench.segments])
    asked = {"part": order.part, "compensated": json.dumps(order.compensated), "segments": segments}
    recording.metadata("bench", asked)
    recording.add("event", at_ns, at_ns, (0.0, "recorder", "info", "begin", "recording begun", {}))
    recording.flush()
    return recording


def loop(
    bench: Bench,
    clock: Clock,
    sink: Sink,
    epoch_ns: int,
    stopping: Callable[[], str],
    tell: Tell,
) -> tuple[int, int]:
    """All ticks; how many, and how many began a whole interval late.

    Raises:
        StoppedError: a limit, the rig or the user ended it.
    """
    plan = bench.plan
    start_ns, late = clock.now() + LEAD_NS, 0
    for tick in range(plan.ticks):
        tell("ticks", tick, plan.ticks)
        nominal = start_ns + plan.tick_ns(tick)
        clock.sleep_until(nominal)
        late += clock.now() >= start_ns + plan.tick_ns(tick + 1)
        try:
            if reason := stopping():
                raise InterlockError(f"The bench test was {reason}")
            if sink.failure:
                raise InterlockError(f"The recording is lost: {sink.failure}")
            values, violation = bench.tick(tick)
        except (RigError, InterlockError) as error:
            raise StoppedError(error, tick, late) from None
        at_ns = epoch_ns + plan.tick_ns(tick)
        row = (tick, tick * plan.test.interval, *values)
        sink.put([bench.packer.item(bench.topic, at_ns, at_ns + clock.now() - nominal, row)])
        if violation:
            raise StoppedError(InterlockError(str(violation)), tick + 1, late)
    return plan.ticks, late
