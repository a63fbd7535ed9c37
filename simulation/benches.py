"""The loop of a bench test: one rig, one programme, one recording; no other laboratories and no network."""

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
from common.reality.reality import Reality
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

LEAD_NS = (
    100_000_000  # between the call of `loop` and the first tick; the preparation in between takes a few ms
)
UNCOMPENSATED = Chosen("none", {}, "compensator")

TARGET = "target"
"""The bench test that every kind of laboratory has: its target moves within a share of its limits."""

KIND_OF_PART = {"column": COLUMN, "actuator": COLUMN, "table": TABLE, "damper": TABLE}
OF_EFFORT = ("damper",)  # parts moved by the force of a motor; the target stays at zero

# Shares of the limits on displacement, and on velocity and acceleration. The response to a step overshoots by at most
# 100 %, so that half a limit is not exceeded; of the displacement a fifth is used, because the gain of an unknown
# transfer system may be wrong by a factor of 2.5 as well.
SHARE, HALF = 0.2, 0.5
# For a kind without such limits. 0.25 m/s is half the default limit on the actuator's velocity, 5 mm is less than a
# fifth of the default limit on the specimen's deformation (30 mm), 3 m/s² a tenth of the default table acceleration.
REACH = Reach(5e-3, 0.25, 3.0)


class Order(NamedTuple):
    """The bench test to run, and the laboratory to run it in."""

    part: str
    compensated: bool = False
    only: tuple[str, ...] = ()
    real_time: bool = False
    name: str = (
        ""  # of the laboratory: a slave's name, "master" or "slave"; empty where only one has the part
    )


class BenchResult(NamedTuple):
    """The result of a bench test: its recording, and how many ticks it has, of which `late` began an interval late."""

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
    """Run a bench test on the rig of the plan, with the deviations of the reality, and record it in `path`.

    Raises:
        InputError: the part does not have a piece of `order.only`, the rig cannot be built, or the file cannot be
            written.
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
    """The role of the laboratory that has a part: the one with the given name, or the only one.

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
        where = f"the laboratory '{name}' of the plan" if name else "any laboratory of the plan"
        known = f", but in that of the {', '.join(names)}" if having else ""
        raise InputError(f"There is no {what} in {where}{known}: see kind in [master] and [slave].")
    if len(having) > 1:
        raise InputError(f"Several laboratories have a {what}: say which with --name ({', '.join(names)}).")
    return having[0]


def chosen(plan: Plan, kind: Kind, order: Order) -> Programme:
    """The programme of an order; raises InputError if the part does not have a piece of that name."""
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
    """The largest motion of a kind's target in a bench test, from the limits that hold for a real rig."""
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
    """Arm the rig, and disarm it in any case; a complaint of `disarm` is recorded as an event."""
    rig.arm()
    try:
        yield
    finally:
        if complaint := rig.disarm():
            values = (0.0, "bench", "warning", "disarm", str(complaint), dict[str, float]())
            sink.put([other("event", (at_ns, at_ns, *values))])


class Bench:
    """One laboratory alone: it follows the programme, or keeps its target at zero while its motor's force follows it.

    As in a whole test, the recorded target is that of the tick at the master and of the end of the interval at a slave.
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
        """The signals recorded at every tick."""
        channels = self.kind.channels
        return (SEQ, TIME, *channels.driving, channels.command, *channels.measured)

    def tick(self, tick: int) -> tuple[tuple[float, ...], LimitViolation | None]:
        """Read, compute and write; returns the recorded values after seq and t, and a violated limit or None."""
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
    """Begin the recording of one laboratory's inputs and outputs; the metadata `bench` holds the order."""
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
    """Run all ticks; returns their number, and how many began at least one interval late.

    Raises:
        StoppedError: a limit, the rig, the recording or the user ended it.
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
