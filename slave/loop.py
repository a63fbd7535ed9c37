"""The slave's loop: handshake, one tick after the other, orderly end.

`poll` and `tick` do everything that must be done and never wait; `common/lab/drive.py` fetches messages and waits, in
real and in virtual time.
"""

from __future__ import annotations

from functools import partial

from common.errors import InterlockError, RigError
from common.lab.descent import Descent
from common.lab.laboratory import Laboratory, Setting
from common.lab.operation import obey
from common.lab.rig_loop import RigLoop
from common.link.endpoint import Received
from common.link.mailbox import LinkModel, Mailbox
from common.named import maker
from common.protocol.exchange import Event, State
from common.protocol.messages import (
    Arm,
    Command,
    Extend,
    Feedback,
    Message,
    Operator,
    Recorder,
    Register,
    Resend,
    Stop,
    Stopped,
    Trip,
)
from common.protocol.tally import Tally
from common.recording.outcome import COMPLETED
from common.rig import GuardedRig, command_of
from common.roles import MASTER, SLAVE
from common.safety.modes import Turn
from common.safety.watchdog import Watchdog, WatchdogFinding
from laboratories import kinds
from slave.handshake import SlaveHandshake
from slave.limits import SlaveLimits
from slave.step import SlaveStep

NO_COMMAND = Command(0, -1, 0, 0, -1, 0.0, 0.0, 0.0, 0.0, 0.0)
NOTHING_HEARD = (-1, 0)

SCHEDULED = State.SCHEDULED  # compared in every tick: an attribute of an enumeration takes 60 ns

answer = maker(Feedback)


class SlaveLoop(RigLoop):
    """A slave in a test; `instance` identifies this process among others of its role."""

    def __init__(
        self, setting: Setting, rig: GuardedRig, link: LinkModel, *, role: str = SLAVE, instance: int = 1
    ) -> None:
        lab, plan = Laboratory(role, setting, kinds.topics(setting.plan)), setting.plan.of(role)
        kind = kinds.kind_of(setting.plan, role)
        self._limits = SlaveLimits(kind, plan)
        self._wanted = maker(command_of(kind.channels))
        self._motor = kind.channels.effort is not None
        zero = self._wanted((0.0,) * len(kind.channels.drives))
        descent = Descent(lab, rig, partial(kind.ramp, plan), zero, kind.channels)
        super().__init__(lab, rig, descent, self._limits.standing)
        self._instance = instance
        self._handshake = SlaveHandshake(self.lab, rig, instance)
        self._commands: Mailbox[Command] = Mailbox(link, "command", setting.plan.test.interval, nominal=0)
        self._received_ns: dict[int, int] = {}
        self._heard = NOTHING_HEARD  # number and arrival of the newest command
        self._step = SlaveStep(plan, kind)
        self._command = NO_COMMAND
        self._shift_ns = 0
        self._leap_ns = setting.plan.window * self.lab.interval_ns  # a larger change of the drift is an error
        self._watchdog = Watchdog(setting.plan.safety, setting.plan.test.interval)
        self._wait_ns = round(setting.plan.link.wait_share * self.lab.interval_ns)
        self._tally = Tally(setting.plan.ticks, setting.plan.window)
        self._feedbacks = 0  # number of feedbacks sent
        self._master_ticks = 0  # number of ticks that the master has run, by its Stop
        self._awaited_end: Stop | None = None  # the master's end, until this laboratory has caught up with it

    # -- messages ---------------------------------------------------------------------------------

    def take(self, received: Received) -> None:
        """Act on a message of the master, the recorder or the operator, which its type tells apart."""
        lab, message, received_ns = self.lab, received.message, received.received_ns
        if isinstance(message, Command):
            if lab.exchange.belongs(message.session):
                self._take_command(message, received_ns)
            return
        lab.listen_to_recorder(message)
        match message:
            case Operator():
                obey(self, message)
                return
            case Register():
                self._handshake.register(message)
            case Arm() if message.instance != self._instance:
                self._handshake.make_way(message.session)
                return
            case Recorder() | Resend():
                return
        if lab.exchange.belongs(message.session):
            lab.heard_ns = received_ns
            self._follow(message, received_ns)

    def _follow(self, message: Message, received_ns: int) -> None:
        """Obey a message of this session's master."""
        lab = self.lab
        match message:
            case Stop():
                self._stop(message)
            case Extend() if lab.extend(message.ticks, received_ns):
                self._tally.extend(lab.until)
            case Trip():
                lab.tripped(message.lab, message, self.ticks)
            case _:
                self._handshake.follow(message, received_ns)

    def _take_command(self, command: Command, received_ns: int) -> None:
        expected = self.lab.tick_at(received_ns - self.tick_ns(0))
        if not self._tally.admit(command.seq, expected):
            return
        self.lab.heard_ns = received_ns
        self._heard = (command.seq, received_ns)
        if abs(command.shift_ns - self._shift_ns) <= self._leap_ns:
            self._shift_ns = command.shift_ns
        extra = self._commands.put(command.seq, command)
        if extra is None:
            self._tally.lose(command.seq)
        else:
            self._received_ns[command.seq] = received_ns + (round(extra * 1e9) if extra else 0)

    def poll(self) -> None:
        """Take the next step of the handshake."""
        self._handshake.poll()

    def _stop(self, request: Stop) -> None:
        """End in order with the master; an emulated laboratory that is behind first runs the ticks that it lacks."""
        behind = self.lab.running and self.ticks < request.ticks
        self._awaited_end = request if behind and self.lab.plan.emulated else None
        if self._awaited_end is None and self.lab.exchange.allows(Event.STOP):
            self.lab.exchange.happen(Event.STOP, remote=True, cause=request.reason)
            self._master_ticks = request.ticks
            if not self.completed:
                self.lab.note("stop", request.reason, tick=self.ticks)
            self.lab.safety.follow(Turn.END)

    # -- ticks ------------------------------------------------------------------------------------

    def tick_ns(self, tick: int) -> int:
        """Nominal time of a tick on the slave's clock, ns, corrected by its drift from the master's."""
        return self.lab.tick_ns(tick) + self._shift_ns

    def tick(self, tick: int) -> None:
        """Run one control interval; a tick that is late by a whole interval keeps the last command.

        Where all laboratories are emulated a late tick is caught up with its own command.
        """
        lab, now = self.lab, self.lab.clock.now()
        lab.tick = tick
        if lab.exchange.state is SCHEDULED:
            self._begin(now)
        after = now - self.tick_ns(tick)
        late = after > 0 and now >= self.tick_ns(tick + 1)
        held = late and not lab.plan.makes_good
        if not held and (command := self._commands.take(tick)) is not None:
            self._command = command
            self._tally.use(command.seq)
        if self._alarmed(tick, after, late=late):
            self.ease(tick)
            return
        command = self._command
        try:
            measured = self._rig.read()
            position = self._step(command, measured)
            wanted = self._wanted((position, command.effort) if self._motor else (position,))
            violation = self._limits.violation(measured, command, wanted)
            if violation:
                lab.violated(violation, tick)
                wanted = self._descent.last  # the violating command was not written to the rig
                self._descent.step(tick, measured)
            else:
                self._descent.wrote(wanted)
                self._rig.write(wanted)
                self._limits.written(wanted)
        except RigError as error:
            self._rig_failed(error, tick)
            return
        self._answer(tick, now, measured, wanted)
        self.ticks = tick + 1
        if self._awaited_end is not None:
            self._stop(self._awaited_end)
        if lab.running and now - lab.heard_ns > lab.loss_ns:
            lab.lost("The master", lab.plan.link.loss_timeout, tick)

    def _begin(self, now: int) -> None:
        """The first tick."""
        self.lab.exchange.happen(Event.RUN)
        self.lab.safety.take(Turn.RUN)
        self.lab.rig_time.begin()
        self.lab.heard_ns = now

    def _finding(self, tick: int) -> tuple[WatchdogFinding, str]:
        """The watchdog's finding on the master."""
        judged = self._commands.judged(self._command)
        return self._watchdog.look(tick, judged.seq, judged.heard_seq), MASTER

    def _answer(
        self, tick: int, started_ns: int, measured: tuple[float, ...], wanted: tuple[float, ...]
    ) -> None:
        lab, command = self.lab, self._command
        received_ns = self._told(command.seq, started_ns)
        sent_ns = lab.clock.now()
        self._feedbacks += 1
        session = lab.exchange.session
        fields = (
            session,
            tick,
            command.seq,
            received_ns,
            *self._heard,
            started_ns,
            sent_ns,
            measured,
        )
        lab.endpoint.send(answer(fields))
        if lab.recorded:
            self._sample(tick, measured, wanted, sent_ns)

    def _told(self, seq: int, now: int) -> int:
        """When the command in force came (ns), in the first feedback that answers it; 0 in later ones.

        A plug-in's delay counts from the earliest use of a message, so that the stamp of one delayed by whole intervals
        may be slightly after its use; it is then set to the time of its use.
        """
        if seq not in self._received_ns:
            return 0
        received_ns = self._received_ns.pop(seq)
        if self._received_ns:
            self._received_ns = {later: stamp for later, stamp in self._received_ns.items() if later > seq}
        return received_ns if received_ns < now else now

    def _sample(
        self, tick: int, measured: tuple[float, ...], wanted: tuple[float, ...], sent_ns: int
    ) -> None:
        lab, command = self.lab, self._command
        log_ns = lab.unix_ns(tick)
        publish_ns = log_ns + sent_ns - self.tick_ns(tick)
        values = (
            log_ns,
            publish_ns,
            tick,
            tick * lab.plan.test.interval,
            command.seq,
            command.target,
            *([command.effort] if self._motor else []),
            wanted[0],
            *measured,
            command.velocity,
            command.acceleration,
            command.jerk,
        )
        lab.outlet.add(lab.name, values)

    # -- end --------------------------------------------------------------------------------------

    def stop(self, reason: str) -> None:
        """Stop on request of an operator of this laboratory."""
        self.lab.fail(Event.TRIP, InterlockError(reason), code="stop", tick=self.ticks)

    def disarm(self) -> None:
        """Disarm the rig and record the counts of messages; called once, before leaving."""
        self.disarm_rig()
        if self.ticks:
            text = f"{self._feedbacks} feedbacks sent, {self._tally.used} commands used."
            values = {"feedbacks_sent": float(self._feedbacks)} | self._tally.values("commands")
            self.lab.note("exchange", text, tick=self.ticks, values=values)

    @property
    def _ends(self) -> bool:
        """Whether the test has ended here by an error; the master knows of an orderly end, which it causes."""
        return self.lab.error is not None

    def _say_end(self) -> None:
        if self.lab.error is not None:
            self.lab.say_why()

    def leave(self, *, last: bool = False) -> None:
        """Send the recorder the rest and tell the master of the end.

        Repeated until `left`, and called a `last` time. The recorder comes first: what this laboratory sends passes
        through the master, which may be gone as soon as it knows of the end.
        """
        lab = self.lab
        if not self._due(last=last):
            return
        session = lab.exchange.session
        if lab.exchange.state is State.STOPPING:
            lab.exchange.happen(Event.FINISH)
        self._say_end()
        self._hand_over()
        if session and (last or lab.exchange.state is State.DONE):
            lab.endpoint.send(Stopped(session, self.ticks))

    @property
    def left(self) -> bool:
        """Whether the recorder has all samples."""
        lab = self.lab
        nothing = not lab.exchange.session or not lab.recorded
        return lab.exchange.ended and (nothing or lab.recorder_has_all())

    @property
    def completed(self) -> bool:
        """Whether the test had all its ticks, here or at the master if this laboratory has fallen behind."""
        whole = max(self.ticks, self._master_ticks) >= self.lab.until
        return whole or (self.lab.plan.served and self.lab.exchange.cause == COMPLETED)

    @property
    def needed(self) -> bool:
        """False: no other process depends on the session of a slave."""
        return False

    @property
    def others_rest(self) -> float:
        """0, because a slave waits for no other laboratory."""
        return 0.0

    @property
    def awaited(self) -> str:
        """The master until it has called, then empty."""
        return f"the {MASTER}" if self.lab.exchange.state is State.IDLE else ""

    @property
    def progress(self) -> dict[str, float]:
        """No figures: the master reports the progress."""
        return {}

    # -- pacing -----------------------------------------------------------------------------------

    def nominal(self, tick: int) -> int:
        """When a tick begins if nothing is late, ns."""
        return self.tick_ns(tick)

    def begins(self, tick: int) -> tuple[int, int]:
        """The nominal time of a tick, ns, and before it that of the tick before, when it may begin with its command."""
        shift = self._shift_ns
        return self.lab.tick_ns(tick - 1) + shift, self.lab.tick_ns(tick) + shift

    def latest(self, tick: int) -> int:
        """Until when a tick waits for its command, ns."""
        return self.tick_ns(tick) + self._wait_ns

    def heard(self, tick: int) -> bool:
        """Whether the command of the tick or a later one has come."""
        return self._commands.newest_seen >= tick

    def finish(self) -> None:
        """Begin the ramp to rest after the last tick, even if the master's message of the end has not come."""
        self.lab.safety.follow(Turn.END)
