"""The master's loop: handshake, one tick after the other, orderly end.

`poll` and `tick` do everything that must be done and never wait; `drive.py` fetches messages and waits
in real time, and virtual time calls the same two.
"""

from __future__ import annotations

from common.clock_offset import ClockOffset
from common.errors import InputError, InterlockError, LostError, RigError
from common.exchange import Event, State
from common.laboratory import REPEAT_NS, Laboratory, Setting
from common.mailbox import LinkModel, Mailbox
from common.messages import (
    Arm,
    Armed,
    Command,
    Feedback,
    Message,
    Refused,
    Register,
    Registered,
    Scheduled,
    Start,
    Stop,
    Stopped,
    Sync,
    SyncReply,
    Trip,
)
from common.plan import PROTOCOL_VERSION
from common.rig import ColumnCommand, GuardedRig
from master.latency import Account
from master.limits import MasterLimits
from master.step import MasterStep, Outputs

SYNC_EXCHANGES = 200
OFFSET_BLOCK, OFFSET_BLOCKS = 250, 40  # exchanges: the best of half a second each, twenty seconds of them
LEAD_NS = 250_000_000  # from the agreement on the start to the start


NO_FEEDBACK = Feedback(0, -1, -1, 0, -1, 0, 0, 0, 0.0, 0.0, 0.0, 0.0)

NOTHING_SENT = (0.0, 0.0, 0.0, 0.0, 0.0)


class MasterLoop:
    """Laboratory A in a test."""

    def __init__(
        self,
        setting: Setting,
        rig: GuardedRig,
        step: MasterStep,
        link: LinkModel,
        *,
        session: int,
        epoch_ns: int,
    ) -> None:
        self.lab = Laboratory("master", setting)
        plan = setting.plan
        self._rig = rig
        self._step = step
        self._limits = MasterLimits(plan.limits, plan.storeys)
        self._feedback: Mailbox[Feedback] = Mailbox(link, "feedback", plan.test.interval, nominal=1)
        self._offset = ClockOffset(length=OFFSET_BLOCK, blocks=OFFSET_BLOCKS)
        self._account = Account(self.lab, self._offset)
        self._used = NO_FEEDBACK
        self._command = 0.0
        self._drift = 0.0
        self._sent = NOTHING_SENT
        self._asked_ns = -REPEAT_NS
        self._syncs = 0
        self._wall_ns = epoch_ns - setting.clock.now()
        self._digest = plan.digest()
        self._slave_is_here = False
        self._stopped = False
        self.ticks = 0
        self.lab.enter(session)

    # -- messages ---------------------------------------------------------------------------------

    def take(self, message: Message, received_ns: int) -> None:
        """Act on one message of the slave or the recorder."""
        lab = self.lab
        if isinstance(message, Feedback):
            if lab.exchange.belongs(message.session):
                self._take_feedback(message, received_ns)
            return
        lab.listen_to_recorder(message)
        match message:
            case Trip() if lab.exchange.belongs(message.session) and not lab.exchange.ended:
                lab.tripped(message.lab, message.text, self.ticks)
            case Refused() if lab.exchange.belongs(message.session):
                self._refused(message.reason)
            case SyncReply() if lab.exchange.belongs(message.session):
                self._take_sync(message, received_ns)
            case Registered() | Armed() | Scheduled() | Stopped() if lab.exchange.belongs(message.session):
                self._agree(message)
            case _:
                pass

    def _take_feedback(self, feedback: Feedback, received_ns: int) -> None:
        if not self.lab.exchange.fresh(feedback.seq):
            return
        self.lab.heard_ns = received_ns
        extra = self._feedback.put(feedback.seq, feedback)
        self._account.answer(feedback, received_ns, self.lab.clock.now(), extra)

    def _refused(self, reason: str) -> None:
        error = InputError(f"The slave refuses the test: {reason}")
        if self.lab.exchange.state is State.IDLE:
            self.lab.fail(Event.REFUSE, error, code="refused", remote=True)
        else:
            self.lab.fail(Event.TRIP, RigError(reason), code="not_armed", remote=True)

    def _agree(self, message: Registered | Armed | Scheduled | Stopped) -> None:
        """Move on where the answer is the one that the present state waits for; repeated answers change nothing."""
        state = self.lab.exchange.state
        match message:
            case Registered() if state is State.IDLE:
                self._slave_is_here = True
                if self._recorder_is_here():
                    self._move(Event.REGISTER)
                    self._arm()
            case Armed() if state is State.REGISTERED:
                self._move(Event.ARM)
            case Scheduled() if state is State.ARMED:
                self._move(Event.SCHEDULE)
            case Stopped():
                self._stopped = True
            case _:
                pass

    def _move(self, event: Event) -> None:
        self.lab.exchange.happen(event)
        self.lab.heard_ns = self.lab.clock.now()
        self._asked_ns = self.lab.heard_ns - REPEAT_NS
        self.lab.report("state", {"lab": "master", "state": self.lab.exchange.state.value})

    def _recorder_is_here(self) -> bool:
        recorder = self.lab.recorder
        if recorder is not None and recorder.plan != self._digest:
            self.lab.fail(
                Event.REFUSE,
                InputError("The recorder was started with another plan: give all three the same."),
                code="refused",
            )
            return False
        here = recorder is not None and recorder.session == self.lab.exchange.session
        return here or not self.lab.plan.recording.required

    def _arm(self) -> None:
        try:
            self._rig.arm()
        except RigError as error:
            self._trip(error, "not_armed")

    def _take_sync(self, reply: SyncReply, received_ns: int) -> None:
        if reply.seq != self._syncs or self.lab.exchange.state is not State.ARMED:
            return
        self._offset.add(self._account.sync_sent_ns, reply.received_ns, reply.sent_ns, received_ns)
        self._syncs += 1
        self.lab.heard_ns = received_ns
        self._asked_ns = received_ns - REPEAT_NS

    # -- handshake --------------------------------------------------------------------------------

    def poll(self) -> None:
        """Before the first tick: ask for what comes next, again where no answer came; give up in time."""
        lab = self.lab
        if lab.exchange.ended or lab.exchange.state is State.SCHEDULED:
            return
        now = lab.clock.now()
        if now - lab.heard_ns > lab.plan.link.connect_timeout * 1e9:
            self._nobody()
        elif now - self._asked_ns >= REPEAT_NS:
            self._asked_ns = now
            self._ask(now)

    def _nobody(self) -> None:
        missing = "recorder" if self._slave_is_here else "slave"
        seconds = self.lab.plan.link.connect_timeout
        error = LostError(
            f"No {missing} joined the test within {seconds:g} s: start it with the same plan and --connect."
        )
        self.lab.fail(Event.LOSE, error, code="nobody")

    def _ask(self, now: int) -> None:
        session = self.lab.exchange.session
        match self.lab.exchange.state:
            case State.IDLE:
                self.lab.endpoint.send(Register(session, PROTOCOL_VERSION, self._digest))
            case State.REGISTERED:
                self.lab.endpoint.send(Arm(session))
            case State.ARMED if self._syncs < SYNC_EXCHANGES:
                self._account.sync_sent_ns = now
                self.lab.endpoint.send(Sync(session, self._syncs, now))
            case State.ARMED:
                self._schedule(now)
            case _:
                pass

    def _schedule(self, now: int) -> None:
        lab = self.lab
        if not lab.start_ns:
            lab.start_ns = now + LEAD_NS
            lab.epoch_ns = lab.start_ns + self._wall_ns
            self._account.first_offset = self._offset.at(lab.start_ns)
        there = lab.start_ns + self._account.first_offset
        lab.endpoint.send(Start(lab.exchange.session, there, lab.epoch_ns))

    # -- ticks ------------------------------------------------------------------------------------

    def tick(self, tick: int) -> None:
        """One control interval (contract, section 3); a tick that comes a whole interval late moves nothing."""
        lab = self.lab
        wake = lab.clock.now()
        if lab.exchange.state is State.SCHEDULED:
            lab.exchange.happen(Event.RUN)
            lab.heard_ns = wake
        held = wake >= lab.tick_ns(tick + 1)
        if (feedback := self._feedback.take(tick)) is not None:
            self._used = feedback
        self._account.close(tick - 1, wake)
        try:
            measured = self._rig.read()
            outputs = self._step(
                tick, measured.column_displacement, measured.column_force, self._used.damper_force
            )
            violation = self._limits.violation(measured, outputs)
            if not (held or violation):
                self._command = outputs.actuator_command
                self._sent = outputs.sent()
            self._rig.write(ColumnCommand(self._command))
        except RigError as error:
            self._trip(error, "rig", tick)
            return
        ready, sent = (0, 0) if held or violation else self._send(tick)
        self._account.open(tick, wake, ready, sent, self._used)
        if lab.recorder is not None:
            self._sample(tick, measured, outputs, sent)
        self.ticks = tick + 1
        self._drift = outputs.column_target / lab.plan.column.deformation_ratio
        if violation:
            self._trip(InterlockError(violation), "limit", tick)
        self._watch(tick, wake)

    def _send(self, tick: int) -> tuple[int, int]:
        """Send the tick's command; when its values were ready, and when its frame was handed to the link, ns."""
        lab = self.lab
        now = lab.clock.now()
        shift = self._offset.at(now) - self._account.first_offset
        return now, lab.endpoint.send(Command(lab.exchange.session, tick, now, shift, *self._sent))

    def _sample(self, tick: int, measured: tuple[float, float], outputs: Outputs, sent_ns: int) -> None:
        lab, used = self.lab, self._used
        interval = lab.plan.test.interval
        log_ns = lab.epoch_ns + tick * lab.interval_ns
        publish_ns = lab.epoch_ns + (sent_ns or lab.clock.now()) - lab.start_ns
        values = (
            tick,
            tick * interval,
            outputs.ground_acceleration,
            outputs.displacement,
            outputs.velocity,
            outputs.acceleration,
            outputs.absolute_acceleration,
            outputs.column_target,
            self._command,
            *measured,
            outputs.numerical_force,
            used.damper_force,
            used.seq,
            (tick - used.seq) * interval if used.seq >= 0 else 0.0,
            *self._sent,
        )
        lab.outlet.add("master", log_ns, publish_ns, values)

    def _watch(self, tick: int, now: int) -> None:
        """End the test where the slave or the recorder is gone or cannot go on."""
        lab, recording = self.lab, self.lab.plan.recording
        if now - lab.heard_ns > lab.plan.link.loss_timeout * 1e9:
            lab.lost("The slave", lab.plan.link.loss_timeout, tick)
        elif recording.required and lab.recorder is not None and lab.recorder.state == "failed":
            error = InterlockError(f"The recording is lost: {lab.recorder.reason}")
            lab.fail(Event.TRIP, error, code="recording_lost", tick=tick)
        elif recording.required and now - lab.recorder_heard_ns > recording.patience * 1e9:
            lab.lost("The recorder", recording.patience, tick)

    # -- end --------------------------------------------------------------------------------------

    def _trip(self, error: RigError | InterlockError, code: str, tick: int = 0) -> None:
        self.lab.fail(Event.TRIP, error, code=code, tick=tick)

    def stop(self, reason: str) -> None:
        """Bring the test to an end; after its last tick, or earlier because somebody wants it so."""
        if self.lab.exchange.allows(Event.STOP):
            self.lab.exchange.happen(Event.STOP, cause=reason)
            self.lab.note("stop", reason, tick=self.ticks)

    def leave(self) -> None:
        """Disarm, tell the slave and give the recorder the rest; may be called again until `left`."""
        lab = self.lab
        if lab.exchange.state is State.STOPPING and self._stopped:
            lab.exchange.happen(Event.FINISH)
        now = lab.clock.now()
        if now - self._asked_ns < REPEAT_NS // 2:
            return
        self._asked_ns = now
        session = lab.exchange.session
        if lab.exchange.state is State.STOPPING:
            lab.endpoint.send(Stop(session, self.ticks, lab.exchange.cause))
        elif lab.error is not None:
            lab.say_why()
        lab.send_samples(everything=True)
        lab.endpoint.send(lab.outlet.finished())

    def disarm(self) -> None:
        """Bring the rig to a safe stop and close the account; once, before leaving."""
        if complaint := self._rig.disarm():
            self.lab.note("disarm", complaint, level="warning", tick=self.ticks)
        if self.ticks:
            self._account.finish(self.ticks - 1, self.lab.clock.now())

    @property
    def left(self) -> bool:
        """Whether slave and recorder know and have all."""
        settled = self.lab.exchange.ended
        return settled and (self.lab.recorder_has_all() or self.lab.recorder is None)

    @property
    def progress(self) -> dict[str, float]:
        """What a user watches while it runs: drift of the specimen's storey (m), round trip (s), missed deadlines."""
        return {"drift": self._drift, **self._account.progress()}

    # -- pacing -----------------------------------------------------------------------------------

    def earliest(self, tick: int) -> int:
        """A tick begins at its nominal time, ns."""
        return self.lab.tick_ns(tick)

    def latest(self, tick: int) -> int:
        """For the feedback of the tick before it is waited a little into the interval, until then, ns."""
        return self.lab.tick_ns(tick) + round((1.0 - self.lab.plan.link.wait_share) * self.lab.interval_ns)

    def heard(self, tick: int) -> bool:
        """Whether what the tick waits for has come: the feedback of the tick before."""
        return self._feedback.newest_seen >= tick - 1

    def finish(self) -> None:
        """All ticks are done."""
        self.stop("completed")
