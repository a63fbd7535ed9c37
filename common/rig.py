"""The interface of a rig: emulated, real, or a user's own model.

A rig is constructed as `Class(interval=…, seed=…, **options)`. Every value is at the laboratory's own scale, in SI
units. Between two commands it is read once. If its class sets `idle_readings = True`, it may be read any number of
times while nothing moves; its sensors are then judged before the first command.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

from common import blame
from common.errors import EmergencyStopError, RigError
from common.named import maker
from common.rig_time import RigTime
from common.signals import Channels
from common.udp.account import Account
from common.udp.rig import UdpRig

ANYTHING = (
    Exception,
    SystemExit,
)  # caught from a plug-in: it may raise anything, and `sys.exit` must not end a test

METHODS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"arm": (), "read": (), "write": ("command",), "disarm": ()}
)  # the methods of a rig, with the parameters of each


class ColumnCommand(NamedTuple):
    """The command of a laboratory of the kind column."""

    actuator_command: float  # m


class ColumnMeasurement(NamedTuple):
    """The measurements of a laboratory of the kind column."""

    column_displacement: float  # m
    column_force: float  # N


class TableCommand(NamedTuple):
    """The command of a laboratory of the kind table."""

    table_command: float  # m
    damper_command: float  # N


class TableMeasurement(NamedTuple):
    """The measurements of a laboratory of the kind table."""

    table_displacement: float  # m
    table_acceleration: float  # m/s²
    damper_stroke: float  # m
    damper_force: float  # N


class NothingCommand(NamedTuple):
    """The command of a laboratory without a rig, which is empty."""


class NothingMeasurement(NamedTuple):
    """The measurements of a laboratory without a rig, of which there are none."""


COMMANDS: Mapping[tuple[str, ...], Any] = {one._fields: one for one in (ColumnCommand, TableCommand)}
MEASUREMENTS: Mapping[tuple[str, ...], Any] = {
    one._fields: one for one in (ColumnMeasurement, TableMeasurement)
}


def command_of(channels: Channels) -> Any:
    """The NamedTuple class of a laboratory's command, in the order of `channels.drives`."""
    return COMMANDS.get(channels.drives) or namedtuple("Command", channels.drives)


def measurement_of(channels: Channels) -> Any:
    """The NamedTuple class of a laboratory's measurements, in the order of `channels.names`."""
    return MEASUREMENTS.get(channels.names) or namedtuple("Measurement", channels.names)


class Rig(Protocol):
    """Everything physical of one laboratory: transfer system, specimen or device, sensors."""

    def arm(self) -> None:
        """Make the rig ready to move; raise RigError with the reason if that is not possible."""

    def read(self) -> Iterable[float]:
        """The measurements at the present tick, in the order of the kind's channels."""

    def write(self, command: Any) -> None:
        """Apply a command over the coming interval."""

    def disarm(self) -> None:
        """Come to a safe stop; must not raise."""


class NoRig:
    """The rig of a master without a laboratory: it has no channels and nothing that could move."""

    def arm(self) -> None:
        """Do nothing."""

    def read(self) -> NothingMeasurement:
        """The measurements of no channel."""
        return NothingMeasurement()

    def write(self, command: NothingCommand) -> None:
        """Do nothing."""

    def disarm(self) -> None:
        """Do nothing."""


class AtRest(Protocol):
    """Judges a rig's measurements while nothing moves."""

    def judge(
        self, read: Callable[[], Any], names: tuple[str, ...], lab: str, *, hidden: bool, paced: bool
    ) -> None:
        """Read channels of these names several times, an interval apart where `paced`; raise RigError where unsound."""

    def reach(self, rig: UdpRig, *, hidden: bool) -> None:
        """Judge the exchanges with a rig in another process; raise RigError where they are too slow."""

    def skip(self, kind: str, *, hidden: bool) -> None:
        """Take note of a rig of the class `kind` that cannot be read at rest."""


class GuardedRig:
    """Calls a rig and turns each of its failures into a RigError of one sentence that names the rig.

    `measurement` is the NamedTuple class of what `read` returns. The sentence about a `hidden` rig does not contain the
    rig's own message. Where `at_rest` is given, it judges the sensors once the rig is armed: it reads a `twin` of an
    emulated rig, since reading the rig itself would draw from its noise, or the rig itself if it sets `idle_readings`.
    """

    def __init__(
        self,
        rig: Rig,
        name: str,
        measurement: type[Any],
        *,
        hidden: bool = False,
        at_rest: AtRest | None = None,
        twin: Callable[[], Rig] | None = None,
    ) -> None:
        self._at_rest = at_rest
        self._twin = twin
        self._rig = rig
        self._remote = rig if isinstance(rig, UdpRig) else None
        self._hidden = hidden
        self._name = name
        self._measurement = measurement
        self._reading, self._count = maker(measurement), len(measurement._fields)
        self._now: Callable[[], int] = int  # a clock that stands still
        self._time: RigTime | None = None

    def measure(self, now: Callable[[], int], time: RigTime) -> None:
        """Measure how long `read` and `write` take by the clock `now` (ns), unless the rig is emulated."""
        if self._twin is None:
            self._now, self._time = now, time

    @property
    def name(self) -> str:
        """The rig's name in errors."""
        return self._name

    def follow(self, mode: Callable[[], int]) -> None:
        """Tell a rig in another process the number that `mode` gives of its laboratory's safety mode."""
        if isinstance(self._rig, UdpRig):
            self._rig.follow(mode)

    @property
    def missed(self) -> int:
        """Intervals in a row in which a rig in another process has not answered in time; 0 of any other rig."""
        return 0 if self._remote is None else self._remote.missed

    @property
    def exchanged(self) -> Account | None:
        """The account of the packets with a rig in another process; None of any other rig, and of a hidden one."""
        return self._rig.account if isinstance(self._rig, UdpRig) and not self._hidden else None

    def arm(self) -> None:
        """Arm the rig; raises RigError with the rig's own reason, or where a sensor at rest is unsound."""
        try:
            self._rig.arm()
        except ANYTHING as error:  # the user gets a sentence
            raise self._failure("arm", error) from error
        if self._at_rest is not None:
            self._judge(self._at_rest)

    def _judge(self, at_rest: AtRest) -> None:
        if isinstance(self._rig, UdpRig):
            at_rest.reach(self._rig, hidden=self._hidden)
        fields: tuple[str, ...] = self._measurement._fields
        if self._twin is not None:
            twin = GuardedRig(self._twin(), self._name, self._measurement, hidden=self._hidden)
            at_rest.judge(twin.read, fields, self._name, hidden=self._hidden, paced=False)
        elif getattr(self._rig, "idle_readings", False):
            at_rest.judge(self.read, fields, self._name, hidden=self._hidden, paced=True)
        else:
            at_rest.skip(type(self._rig).__name__, hidden=self._hidden)

    def read(self) -> Any:
        """The measurements as the NamedTuple; raises RigError where they are no finite numbers of the right count."""
        numbers: Any
        if self._twin is None:
            numbers = self._numbers()
        else:
            try:
                numbers = self._rig.read()  # an emulated rig gives a tuple of floats
            except ANYTHING as error:  # the user gets a sentence
                raise self._failure("read", error) from error
        if len(numbers) != self._count:
            raise RigError(self._complaint(numbers))
        if not math.isfinite(sum(numbers)):
            raise RigError(f"{self._name}: read() returned {numbers}, which is not finite.")
        return self._reading(numbers)

    def _numbers(self) -> tuple[float, ...]:
        """What the rig reads, as numbers; raises RigError where it fails or returns anything else."""
        begun = 0
        if self._time is not None:
            self._time.tick()
            begun = self._now()
        try:
            given = self._rig.read()
            iterable = not isinstance(given, tuple) and isinstance(given, Iterable)
            values = tuple(given) if iterable else given
        except ANYTHING as error:  # the user gets a sentence
            raise self._failure("read", error) from error
        if self._time is not None:
            self._time.took("read", self._now() - begun)
        try:
            return tuple(map(float, values))
        except (TypeError, ValueError, OverflowError):
            raise RigError(self._complaint(values)) from None

    def write(self, command: Any) -> None:
        """Apply a command; raises RigError where the rig fails."""
        begun = 0 if self._time is None else self._now()
        try:
            self._rig.write(command)
        except ANYTHING as error:  # the user gets a sentence
            raise self._failure("write", error) from error
        if self._time is not None:
            self._time.took("write", self._now() - begun)

    def disarm(self) -> RigError | None:
        """Disarm the rig; returns the error where the rig raises one, otherwise None."""
        try:
            self._rig.disarm()
        except ANYTHING as error:  # the end of the test must go on
            return self._failure("disarm", error)
        return None

    def _failure(self, what: str, error: BaseException) -> RigError:
        kind = EmergencyStopError if isinstance(error, EmergencyStopError) else RigError
        if self._hidden:
            return kind(f"{self._name}: {what}() failed: {type(error).__name__}.")
        if isinstance(error, RigError):
            return kind(f"{self._name}: {error}")
        text = blame.described(error, blame.source_of(type(self._rig)))
        return RigError(f"{self._name}: {what}() failed: {text}", blame.whole(error))

    def _complaint(self, values: Any) -> str:
        fields: tuple[str, ...] = self._measurement._fields
        try:
            count = len(list(map(float, values)))
        except (TypeError, ValueError, OverflowError):
            return f"{self._name}: read() returned {values!r}, not numbers."
        return f"{self._name}: read() returned {count} numbers, not {len(fields)} ({', '.join(fields)})."
