"""What the loops of both laboratories share: place in the protocol, stream to the recorder, reports."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from common.errors import EmergencyStopError, InterlockError, LostError, RigError, RthsError
from common.host.clock import Clock
from common.lab.outlet import Outlet, kept_items, next_of
from common.link.endpoint import Endpoint
from common.plan.limits import LimitViolation, Standstill
from common.plan.plan import Plan
from common.protocol.exchange import Event, Exchange, State
from common.protocol.messages import Message, Recorder, Resend, Trip
from common.recording.rows import RowPacker
from common.reporting import Report, silent
from common.rig import GuardedRig
from common.rig_time import RigTime
from common.roles import MASTER, SLAVE, title
from common.safety.modes import Cause, Mode, Safety, Turn
from common.signals import Signal

SLOW_RIG = "slow_rig"  # code of the event of a rig whose calls take too long, and of the message that says so
# an unanswered request is sent again after this long: many round trips even on a slow link, and no wait for a user
REPEAT_NS = 100_000_000

NO_VALUES: Mapping[str, float] = MappingProxyType({})

HANDSHAKE = {Event.REGISTER: Turn.CONFIGURE, Event.ARM: Turn.ARM}  # what they are to the rig
MODES = {mode: number for number, mode in enumerate(Mode)}  # as an event's values have them


class Setting(NamedTuple):
    """What a loop is given by its surroundings."""

    plan: Plan
    endpoint: Endpoint
    clock: Clock
    report: Report = silent


class Laboratory:
    """State shared by the master's and the slave's loop; composed by both. `topics` are those of its recording."""

    def __init__(self, name: str, setting: Setting, topics: Mapping[str, Sequence[Signal]]) -> None:
        self.name = name
        self.plan = setting.plan
        self.endpoint = setting.endpoint
        self.clock = setting.clock
        self.report = setting.report
        self.exchange = Exchange()
        self.safety = Safety(self._turned)
        self.tick = 0  # the newest one that has begun
        self.answers: dict[int, tuple[bool, str]] = {}  # to the operator's presses
        self._exact_ns = setting.plan.test.interval * 1e9
        self.interval_ns = round(self._exact_ns)
        self.loss_ns = setting.plan.link.loss_timeout * 1e9  # silence after which another role is lost
        self._overrun_ns = setting.plan.safety.overrun * self.interval_ns
        self._even = self._exact_ns == self.interval_ns
        self.start_ns = 0  # own clock, tick 0
        self.epoch_ns = 0  # Unix time of tick 0 on the master's base
        self._rows = RowPacker(topics, setting.plan.storeys)
        self.outlet = Outlet(0, name, kept_items(self.plan, name), self._rows)
        self.error: RthsError | None = None
        self.rig_time = RigTime(self.interval_ns)
        self._rig_name = ""
        self._trip_code = ""
        self.heard_ns = setting.clock.now()
        self.recorder: Recorder | None = None
        self.recorder_heard_ns = setting.clock.now()

    def enter(self, session: int) -> None:
        """Take part in a session."""
        self.exchange.session = session
        self.endpoint.enter(session)
        self.outlet = Outlet(session, self.name, kept_items(self.plan, self.name), self._rows)

    def move(self, event: Event) -> None:
        """One step of the handshake, agreed with the others."""
        self.exchange.happen(event)
        if event in HANDSHAKE:
            self.safety.take(HANDSHAKE[event])
        self.report("state", {"lab": self.name, "state": self.exchange.state.value})

    def tick_ns(self, tick: int) -> int:
        """Nominal time of a tick on this laboratory's clock; a loop asks ten times per tick."""
        return self.start_ns + (tick * self.interval_ns if self._even else round(tick * self._exact_ns))

    def unix_ns(self, tick: int) -> int:
        """Nominal Unix time of a tick on the master's base."""
        return self.epoch_ns + (tick * self.interval_ns if self._even else round(tick * self._exact_ns))

    def tick_at(self, elapsed_ns: int) -> int:
        """The tick whose interval a time after the first tick falls into."""
        return math.floor((elapsed_ns + 0.5) / self._exact_ns)

    def note(
        self,
        code: str,
        text: str,
        *,
        level: str = "info",
        tick: int = 0,
        values: Mapping[str, float] = NO_VALUES,
    ) -> None:
        """Record and report an event."""
        t = tick * self.plan.test.interval
        at = self.unix_ns(tick)
        self.outlet.add("event", at, at, (t, self.name, level, code, text, dict(values)))
        self.report(
            "event", {"t": t, "lab": self.name, "level": level, "code": code, "text": text} | dict(values)
        )

    def explain(self, error: Exception | None, *, tick: int = 0) -> None:
        """Record the traceback of a rig's own exception, where there is one to show; it is not reported."""
        if details := getattr(error, "details", ""):
            at = self.unix_ns(tick)
            t = tick * self.plan.test.interval
            self.outlet.add("event", at, at, (t, self.name, "info", "traceback", details, {}))

    def _turned(self, before: Mode, turn: Turn, after: Mode) -> None:
        """Record and report a change of the safety mode; before the start is agreed there is no time of it."""
        self.report("mode", {"lab": self.name, "mode": after.value})
        if self.start_ns:
            text = f"{before.value} → {after.value} ({turn.value})"
            self.note(
                "mode",
                text,
                tick=self.tick,
                values={"mode": float(MODES[after]), "from": float(MODES[before])},
            )

    def tell_news(self, tick: int) -> None:
        """Record frames that were rejected lately, while the test runs."""
        if (news := self.endpoint.news(self.clock.now())) is not None:
            self.note(news["code"], news["text"], level=news["level"], tick=tick, values=news["values"])

    def sample_ramp(self, topic: str, tick: int, *values: float) -> None:
        """Record one interval of the ramp to rest: commands written, then readings."""
        if self.recorded:
            at = self.unix_ns(tick)
            t = tick * self.plan.test.interval
            self.outlet.add(topic, at, at, (tick, t, self.safety.mode.value, *values))

    def at_rest(self, tick: int, values: Mapping[str, float]) -> None:
        """The rig is at rest; `values` say how it came there."""
        self.tick = tick
        self.safety.at_rest()
        if self.safety.cause is not None:
            code = self.safety.cause.code.removesuffix("_trip").replace("_", " ")
            text = (
                f"Came to rest {values['duration'] * 1e3:.3g} ms after the {code} trip, "
                f"having moved {values['travel'] * 1e3:.3g} mm."
            )
            self.note("safe", text, tick=tick, values=values)

    def fail(
        self,
        event: Event,
        error: RthsError,
        *,
        code: str,
        tick: int = 0,
        remote: bool = False,
        values: Mapping[str, float] = NO_VALUES,
    ) -> None:
        """End the test for this laboratory; the first cause stays, with the `values` that belong to it."""
        if self.exchange.ended:
            return
        self.exchange.happen(event, remote=remote, cause=str(error))
        self.error = error
        self._trip_code = code if code == SLOW_RIG else self.exchange.state.value
        self.note(code, str(error), level="error", tick=tick, values=values)
        self.explain(error, tick=tick)
        if event is not Event.REFUSE:
            turn = Turn.EMERGENCY if isinstance(error, EmergencyStopError) else Turn.TRIP
            self.tick = tick
            self.safety.trip(self.cause(code, error), turn)
        if event is not Event.REFUSE and not remote:
            self.say_why()

    def emergency(self, error: EmergencyStopError) -> None:
        """Latch the emergency stop, also where the test has ended before."""
        if self.exchange.ended:
            self.note("emergency", str(error), level="error", tick=self.tick)
            self.safety.trip(self.cause("emergency", error), Turn.EMERGENCY)
        else:
            self.fail(Event.TRIP, error, code="emergency", tick=self.tick)

    def say_why(self) -> None:
        """Tell the other laboratory that this one has stopped, and why."""
        if self.exchange.session:
            self.endpoint.send(Trip(self.exchange.session, self.name, self._trip_code, self.exchange.cause))

    def lost(self, who: str, seconds: float, tick: int = 0) -> None:
        """End the test because someone has been silent for too long."""
        self.fail(Event.LOSE, LostError(f"{who} has been silent for {seconds:g} s."), code="lost", tick=tick)

    def cause(self, code: str, error: RthsError) -> Cause:
        """An error as the cause of a latched state."""
        return Cause(code, str(error), self.tick * self.plan.test.interval, self.name)

    def violated(self, violation: LimitViolation | Standstill, tick: int) -> None:
        """End the test because a value is beyond its limit, or a sensor is frozen."""
        error = InterlockError(str(violation))
        self.fail(Event.TRIP, error, code="limit", tick=tick, values=violation.values)

    def overrun(self, late_ns: int, tick: int) -> bool:
        """End the test where a tick comes too many intervals late, because the rig's motion meanwhile is unknown."""
        if late_ns <= self._overrun_ns:
            return False
        most = self.plan.safety.overrun
        if 2 * self.rig_time.behind >= late_ns:
            self.slow_rig(tick)
            return True
        error = InterlockError(
            f"The {title(self.name)} was held up for {late_ns * 1e-6:.1f} ms, more than {most} intervals: free its "
            "processor or give it real-time priority (`rths doctor`), or raise overrun in [safety]."
        )
        self.fail(Event.TRIP, error, code="overrun", tick=tick, values={"late": late_ns * 1e-9})
        return True

    def watch(self, rig: GuardedRig) -> None:
        """Take account of how long a rig's calls take."""
        self._rig_name = rig.name
        rig.measure(self.clock.now, self.rig_time)

    def slow_rig(self, tick: int) -> None:
        """End the test because this laboratory's own rig has put it behind."""
        error = RigError(f"{self._rig_name}: {self.rig_time.sentence()}.")
        self.fail(Event.TRIP, error, code=SLOW_RIG, tick=tick, values={"behind": self.rig_time.behind * 1e-9})

    @property
    def kept_by_rig(self) -> bool:
        """Whether the rig alone has put this laboratory behind by an interval: it then sends nothing."""
        return self.rig_time.behind >= self.interval_ns

    def silent(self, who: str, tick: int) -> None:
        """End the test because no valid message of the partner `who` has come for too many intervals."""
        if self.kept_by_rig:
            self.slow_rig(tick)
            return
        most = self.plan.safety.ramp_after
        milliseconds = most * self.plan.test.interval * 1e3
        message = "feedback" if self.name == MASTER else "command"
        whom = "laboratory B" if who == SLAVE else f"the {who}"
        error = LostError(f"No valid {message} from {whom} for {milliseconds:g} ms.")
        self.fail(Event.LOSE, error, code="watchdog", tick=tick, values={"intervals": float(most)})

    def tripped(self, lab: str, trip: Trip, tick: int) -> None:
        """End the test because the other laboratory has stopped its rig.

        Where it has missed this one, whose own rig was too slow, that is the cause. Where this one has missed it, and
        it says that its rig was too slow, that is the cause as well, although it comes to be known afterwards.
        """
        error = InterlockError(f"The {title(lab)} stopped the test: {trip.text}")
        if not self.exchange.ended and trip.code == State.LOST.value and self.kept_by_rig:
            self.slow_rig(tick)
        elif not self.exchange.ended:
            self.fail(Event.TRIP, error, code="remote_trip", tick=tick, remote=True)
        elif trip.code == SLOW_RIG and isinstance(self.error, LostError):
            self.error = error
            self.note("remote_trip", str(error), level="error", tick=tick)

    def listen_to_recorder(self, message: Message) -> None:
        """Take note of the recorder's state, and send again what it has missed.

        Once the test has begun, only the recorder of its session counts; any other is ignored.
        """
        if isinstance(message, Recorder):
            if self.exchange.belongs(message.session) or self.exchange.state is State.IDLE:
                self.recorder = message
                self.recorder_heard_ns = self.clock.now()
        elif (
            isinstance(message, Resend)
            and message.lab == self.name
            and self.exchange.belongs(message.session)
        ):
            for piece in self.outlet.again(message):
                self.endpoint.send(piece)

    def send_samples(self, *, everything: bool = False) -> None:
        """Send what the recorder shall have."""
        for piece in self.outlet.pieces(everything=everything):
            self.endpoint.send(piece)

    @property
    def recorded(self) -> bool:
        """Whether a recorder takes part in the test."""
        recorder = self.recorder
        return recorder is not None and 0 != recorder.session == self.exchange.session

    def recorder_has_all(self) -> bool:
        """Whether the recorder says that it has this laboratory's whole stream."""
        recorder = self.recorder
        if recorder is None or not self.recorded:
            return False
        return next_of(recorder.nexts, self.name) >= self.outlet.total

    @property
    def running(self) -> bool:
        """Whether ticks may go on."""
        return self.exchange.state.running
