"""The loop of a bench test: one rig, one programme, one recording; no other laboratory and no network."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

from common import signals
from common.errors import InputError, InterlockError, RigError, RthsError
from common.host.clock import Clock, MonotonicClock, VirtualClock, unix_ns
from common.plan.limits import Guard, Violation
from common.plan.plan import Plan
from common.plan.reality import Reality
from common.plan.tables import TableCompensator
from common.recording.reader import CLOCK
from common.recording.writer import Recording
from common.rig import ColumnCommand, ColumnMeasurement, GuardedRig, TableCommand, TableMeasurement
from common.terminal.telling import Tell, untold
from master import assembly as master
from models import excitation
from models.compensators.follower import Follower
from models.excitation import POSITION, Programme, Segment
from recorder import files
from recorder.sink import FileSink, Item, Sink, ThreadedSink
from slave import assembly as slave

LEAD_NS = 100_000_000  # before the first tick: what is left to prepare takes a few ms
UNCOMPENSATED = TableCompensator()

MASTER_FIELDS = ("seq", "t", "column_target", "actuator_command", "column_displacement", "column_force")
SLAVE_FIELDS = (
    "seq",
    "t",
    "table_target",
    "damper_command",
    "table_command",
    "table_displacement",
    "table_acceleration",
    "damper_stroke",
    "damper_force",
)


class Order(NamedTuple):
    """Which bench test is wanted."""

    part: str
    compensated: bool = False
    only: tuple[str, ...] = ()
    real_time: bool = False


class Result(NamedTuple):
    """What a bench test has given."""

    path: Path
    part: str
    interval: float
    ticks: int
    late: int
    segments: tuple[Segment, ...]
    error: RthsError | None


def play(
    plan: Plan,
    reality: Reality,
    order: Order,
    path: Path,
    stopping: Callable[[], str],
    tell: Tell = untold,
) -> Result:
    """Play a bench test on the plan's rig, or on the reality's, and record it.

    Raises:
        InputError: a piece that the part does not have, a rig that cannot be built, or a file not writable.
    """
    programme = chosen(plan, order)
    ticks = programme.motion.shape[1] - 1
    plan = plan.with_test(duration=ticks * plan.test.interval)
    bench = (ColumnBench if order.part in ("column", "actuator") else TableBench)(
        plan, reality, order, programme
    )
    clock: Clock = MonotonicClock() if order.real_time else VirtualClock()
    epoch_ns = unix_ns() if order.real_time else 0
    recording = begin(path, plan, bench, order, programme, epoch_ns)
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
    return Result(path, order.part, plan.test.interval, done, late, programme.segments, error)


def chosen(plan: Plan, order: Order) -> Programme:
    """The programme asked for; raises InputError where the part has no such piece."""
    names = [piece.name for piece in excitation.PARTS[order.part](plan.test.interval, plan.test.seed)]
    for word in order.only:
        if not any(name.startswith(word) for name in names):
            raise InputError(f"The bench test of the {order.part} has no piece '{word}': {', '.join(names)}.")
    return excitation.programme(order.part, plan.test.interval, plan.test.seed, order.only)


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
            sink.put([["event", at_ns, at_ns, 0.0, "bench", "warning", "disarm", str(complaint), {}]])


class ColumnBench:
    """Laboratory A alone: the actuator follows the programme."""

    topic, fields = "master", MASTER_FIELDS

    def __init__(self, plan: Plan, reality: Reality, order: Order, programme: Programme) -> None:
        self.plan, self.rig = plan, master.build_rig(reality)
        self._measurements = Guard(vars(plan.limits), ColumnMeasurement._fields)
        self._commands = Guard(vars(plan.limits), ColumnCommand._fields)
        chosen = plan.compensator if order.compensated else UNCOMPENSATED
        self._follow = Follower(chosen, programme, plan.test.interval)

    def tick(self, tick: int) -> tuple[tuple[float, ...], Violation | None]:
        """Read, compute, write; the recorded values behind seq and t, and the violation of a limit."""
        measured = self.rig.read()
        target, command = self._follow(tick, measured.column_displacement)
        wanted = ColumnCommand(command)
        violation = self._measurements.violation(measured) or self._commands.violation(wanted)
        if not violation:
            self.rig.write(wanted)
        return (target, command, *measured), violation


class TableBench:
    """Laboratory B alone: the table follows the programme, or stands still under the motor's force."""

    topic, fields = "slave", SLAVE_FIELDS

    def __init__(self, plan: Plan, reality: Reality, order: Order, programme: Programme) -> None:
        self.plan, self.rig = plan, slave.build_rig(reality)
        self._measurements = Guard(vars(plan.limits), TableMeasurement._fields)
        self._commands = Guard(vars(plan.limits), ("table_target", *TableCommand._fields))
        self._force = programme.motion[POSITION] if order.part == "damper" else None
        chosen = plan.table.compensator if order.compensated else UNCOMPENSATED
        self._follow = Follower(chosen, programme, plan.test.interval, plan.follows_in)

    def tick(self, tick: int) -> tuple[tuple[float, ...], Violation | None]:
        """Read, compute, write; the recorded values behind seq and t, and the violation of a limit."""
        measured = self.rig.read()
        if self._force is not None:
            target, command, force = 0.0, 0.0, float(self._force[tick + 1])
        else:
            _, command = self._follow(tick, measured.table_displacement)
            target, force = self._follow.wanted(tick + 1), 0.0
        wanted = TableCommand(command, force)
        violation = self._measurements.violation(measured) or self._commands.violation((target, *wanted))
        if not violation:
            self.rig.write(wanted)
        return (target, force, command, *measured), violation


def begin(
    path: Path, plan: Plan, bench: ColumnBench | TableBench, order: Order, programme: Programme, at_ns: int
) -> Recording:
    """A recording of one part's in- and outputs, with what was asked of it in the metadata `bench`."""
    rows = tuple(signals.signal(bench.topic, name) for name in bench.fields)
    topics = {bench.topic: rows, "event": signals.EVENT}
    recording = Recording(path, plan.test.name, plan.storeys, topics)
    recording.metadata("plan", {"toml": plan.toml(), "digest": plan.digest()})
    recording.describe()
    recording.metadata("versions", {name: metadata.version(name) for name in files.PACKAGES})
    recording.metadata("host", files.host())
    recording.metadata(CLOCK, {"kind": "real" if order.real_time else "virtual"})
    segments = json.dumps([segment._asdict() for segment in programme.segments])
    asked = {"part": order.part, "compensated": json.dumps(order.compensated), "segments": segments}
    recording.metadata("bench", asked)
    recording.add("event", at_ns, at_ns, (0.0, "recorder", "info", "begin", "recording begun", {}))
    recording.flush()
    return recording


def loop(
    bench: ColumnBench | TableBench,
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
        row: Item = [
            bench.topic,
            at_ns,
            at_ns + clock.now() - nominal,
            tick,
            tick * plan.test.interval,
            *values,
        ]
        sink.put([row])
        if violation:
            raise StoppedError(InterlockError(str(violation)), tick + 1, late)
    return plan.ticks, late
