"""What the master's and a slave's loop share: state in the protocol, stream to the recorder, reports."""

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
from common.roles import BUILDING, CLIENT, MASTER, SLAVE, title
from common.safety.modes import Cause, Mode, Safety, Turn
from common.signals import Signal

SLOW_RIG = "slow_rig"  # code of the event of a rig whose calls take too long, and of the message that says so
# An unanswered request is repeated after this time: a hundred round trips of a local network, and too short for a user
# to notice.
REPEAT_NS = 100_000_000

NO_VALUES: Mapping[str, float] = MappingProxyType({})

HANDSHAKE = {Event.REGISTER: Turn.CONFIGURE, Event.ARM: Turn.ARM}  # the rig's turn that goes with each event
MODES = {
    mode: number for number, mode in enumerate(Mode)
}  # the numbers that stand for modes in an event's values


class Setting(NamedTuple):
    """What every laboratory's loop is built with."""

    plan: Plan
    endpoint: Endpoint
    clock: Clock
    report: Report = silent


class Laboratory:
    """The state that both kinds of loop hold: `topics` are those of the test's recording, with their signals."""

    def __init__(self, name: str, setting: Setting, topics: Mapping[str, Sequence[Signal]]) -> None:
        self.name = name
        self.plan = setting.plan
        self.endpoint = setting.endpoint
        self.clock = setting.clock
        self.report = setting.report
        self.exchange = Exchange()
        self.safety = Safety(self._turned)
        self.tick = 0  # the newest one that has begun
        self.until = setting.plan.ticks  # ticks of the test, more than the plan's where it is held
        self.answers: dict[int, tuple[bool, str]] = {}  # by the operator's press: accepted, and a sentence
        self.answered_ns: int | None = None  # when it last answered an operator
        self._exact_ns = setting.plan.test.interval * 1e9
        self.interval_ns = round(self._exact_ns)
        self.loss_ns = setting.plan.link.loss_timeout * 1e9  # silence after which a role counts as lost
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
        """Join a session."""
        self.exchange.session = session
        self.endpoint.enter(session)
        self.outlet = Outlet(session, self.name, kept_items(self.plan, self.name), self._rows)

    def move(self, event: Event) -> None:
        """Take a step of the handshake that is agreed with the other laboratories."""
        self.exchange.happen(event)
        if event in HANDSHAKE:
            self.safety.take(HANDSHAKE[event])
        self.report("state", {"lab": self.name, "state": self.exchange.state.value})

    def tick_ns(self, tick: int) -> int:
        """Nominal time of a tick on this laboratory's clock, ns; called ten times per tick."""
        return self.start_ns + (tick * self.interval_ns if self._even else round(tick * self._exact_ns))

    def unix_ns(self, tick: int) -> int:
        """Nominal Unix time of a tick by the master's clock, ns."""
        return self.epoch_ns + (tick * self.interval_ns if self._even else round(tick * self._exact_ns))

    def tick_at(self, elapsed_ns: int) -> int:
        """The tick whose interval contains a time (ns) after the first tick; half a ns allows for rounded stamps."""
        return math.floor((elapsed_ns + 0.5) / self._exact_ns)

    def extend(self, ticks: int, at_ns: int) -> bool:
        """Take note, at a time (ns), that holds have made the test longer; return whether that is possible.

        Holds add no more ticks than have passed, apart from their ramps, which are shorter than the test.
        """
        passed = self.tick_at(at_ns - self.start_ns) + self.plan.window
        if not self.until <= ticks <= 2 * self.plan.ticks + passed:
            return False
        self.until = ticks
        return True

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
        self.outlet.add("event", (at, at, t, self.name, level, code, text, dict(values)))
        self.report(
            "event", {"t": t, "lab": self.name, "level": level, "code": code, "text": text} | dict(values)
        )

    def explain(self, error: Exception | None, *, tick: int = 0) -> None:
        """Record the traceback of a rig's own exception, where there is one to show; it is not reported."""
        if details := getattr(error, "details", ""):
            at = self.unix_ns(tick)
            t = tick * self.plan.test.interval
            self.outlet.add("event", (at, at, t, self.name, "info", "traceback", details, {}))

    def _turned(self, before: Mode, turn: Turn, after: Mode) -> None:
        """Report a change of the safety mode, and record it once the start is agreed and it has a test time."""
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
        """Record the frames that were rejected since the last call, while the test runs."""
        if (news := self.endpoint.news(self.clock.now())) is not None:
            self.note(news["code"], news["text"], level=news["level"], tick=tick, values=news["values"])

    def sample_ramp(self, topic: str, tick: int, *values: float) -> None:
        """Record one interval of the ramp to rest; `values` are the commands written, then the measurements."""
        if self.recorded:
            at = self.unix_ns(tick)
            t = tick * self.plan.test.interval
            self.outlet.add(topic, (at, at, tick, t, self.safety.mode.value, *values))

    def at_rest(self, tick: int, values: Mapping[str, float]) -> None:
        """Take note that the rig is at rest; `values` hold the ramp's duration (s), travel (m) and last command."""
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
        """End the test for this laboratory, unless it has ended; `values` are recorded with the cause."""
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
        """Latch the emergency stop, even if the test has ended already."""
        if self.exchange.ended:
            self.note("emergency", str(error), level="error", tick=self.tick)
            self.safety.trip(self.cause("emergency", error), Turn.EMERGENCY)
        else:
            self.fail(Event.TRIP, error, code="emergency", tick=self.tick)

    def say_why(self) -> None:
        """Tell the other laboratories that this one has stopped, and why."""
        if self.exchange.session:
            self.endpoint.send(Trip(self.exchange.session, self.name, self._trip_code, self.exchange.cause))

    def lost(self, who: str, seconds: float, tick: int = 0) -> None:
        """End the test because a role, `who`, has been silent for `seconds`."""
        self.fail(Event.LOSE, LostError(f"{who} has been silent for {seconds:g} s."), code="lost", tick=tick)

    def cause(self, code: str, error: RthsError) -> Cause:
        """An error as the cause of a latched state."""
        return Cause(code, str(error), self.tick * self.plan.test.interval, self.name)

    def violated(self, violation: LimitViolation | Standstill, tick: int) -> None:
        """End the test because a value is beyond its limit, or a sensor is frozen."""
        error = InterlockError(str(violation))
        self.fail(Event.TRIP, error, code="limit", tick=tick, values=violation.values)

    def overrun(self, late_ns: int, tick: int) -> bool:
        """End the test if a tick comes `late_ns` late and that is too much; return whether it did.

        What the rig did meanwhile is unknown. The rig itself is the cause where its calls took half of the delay or
        more.
        """
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
        """Measure how long a rig's calls take, and tell a rig in another process this laboratory's mode."""
        self._rig_name = rig.name
        rig.measure(self.clock.now, self.rig_time)
        rig.follow(lambda: MODES[self.safety.mode])

    def slow_rig(self, tick: int) -> None:
        """End the test because the calls of this laboratory's own rig took too long."""
        error = RigError(f"{self._rig_name}: {self.rig_time.sentence()}.")
        self.fail(Event.TRIP, error, code=SLOW_RIG, tick=tick, values={"behind": self.rig_time.behind * 1e-9})

    @property
    def kept_by_rig(self) -> bool:
        """Whether the rig's calls alone have delayed this laboratory by an interval or more."""
        return self.rig_time.behind >= self.interval_ns

    def silent(self, who: str, tick: int) -> None:
        """End the test because no valid message of the partner `who` has come for too many intervals."""
        if self.kept_by_rig:
            self.slow_rig(tick)
            return
        most = self.plan.safety.ramp_after
        milliseconds = most * self.plan.test.interval * 1e3
        message = (
            "displacement" if who in (CLIENT, BUILDING) else "feedback" if self.name == MASTER else "command"
        )
        whom = "laboratory B" if who == SLAVE else f"the {who}"
        error = LostError(f"No valid {message} from {whom} for {milliseconds:g} ms.")
        self.fail(Event.LOSE, error, code="watchdog", tick=tick, values={"intervals": float(most)})

    def tripped(self, lab: str, trip: Trip, tick: int) -> None:
        """End the test because another laboratory has stopped its rig.

        Where that laboratory missed messages because this one's own rig was too slow, the slow rig is the cause. Where
        this laboratory missed messages and the other one reports a slow rig, that becomes the cause afterwards.
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
        """Take note of the recorder's state, and send again the samples that it has missed.

        Once the test has begun, messages of any recorder but the one of its session are ignored.
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
        """Send the full pieces of the stream to the recorder, or `everything`."""
        for piece in self.outlet.pieces(everything=everything):
            self.endpoint.send(piece)

    @property
    def recorded(self) -> bool:
        """Whether a recorder takes part in the test."""
        recorder = self.recorder
        return recorder is not None and 0 != recorder.session == self.exchange.session

    def recorder_has_all(self) -> bool:
        """Whether the recorder has confirmed this laboratory's whole stream."""
        recorder = self.recorder
        if recorder is None or not self.recorded:
            return False
        return next_of(recorder.nexts, self.name) >= self.outlet.total

    @property
    def running(self) -> bool:
        """Whether ticks may go on."""
        return self.exchange.state.running
