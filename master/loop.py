"""The master's loop: handshake, one tick after the other, orderly end.

`poll` and `tick` do everything that must be done and never wait; `common/lab/drive.py` fetches messages and waits, in
real and in virtual time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from common.errors import InterlockError, LostError, RigError
from common.lab.descent import Descent
from common.lab.laboratory import Laboratory, Setting
from common.lab.operation import obey
from common.lab.preflight import Gate
from common.lab.rig_loop import RigLoop
from common.link.endpoint import Received
from common.link.mailbox import LinkModel
from common.plan import patience
from common.plan.plan import PROTOCOL_VERSION
from common.plan.plan_difference import digest_of, said
from common.protocol.exchange import Event, State
from common.protocol.messages import (
    Feedback,
    Message,
    Operator,
    Recorder,
    Register,
    Stop,
    Stopped,
    Trip,
    Waiting,
)
from common.recording.outcome import COMPLETED
from common.rig import GuardedRig
from common.roles import MASTER, RECORDER
from common.safety.modes import Turn
from common.safety.watchdog import WatchdogFinding
from laboratories import kinds
from laboratories.longest import resting
from master.building import BuildingStep, Outputs
from master.handshake import START_S, MasterHandshake
from master.holding import Holding, LaboratoryMotion
from master.limits import MasterLimits
from master.own import OwnLaboratory
from master.partner import Partner
from master.partners import Partners

SCHEDULED = State.SCHEDULED  # compared in every tick: an attribute of an enumeration takes 60 ns


class MasterLoop(RigLoop):
    """The master in a test; `links` are the plug-ins that delay the messages of each slave, by role."""

    def __init__(
        self,
        setting: Setting,
        rig: GuardedRig,
        building: BuildingStep,
        links: Mapping[str, LinkModel],
        *,
        session: int,
        epoch_ns: int,
        gate: Gate | None = None,
    ) -> None:
        plan, lab = setting.plan, Laboratory(MASTER, setting, kinds.topics(setting.plan))
        self._limits = MasterLimits(plan)
        self._own = OwnLaboratory(plan)
        descent = Descent(lab, rig, self._own.ramp, self._own.zero, self._own.channels)
        super().__init__(lab, rig, descent, self._limits.standing)
        self._together = Partners(lab, links)
        self.partners, self._partners = self._together.by_role, self._together.all
        self._building = building
        wall_ns = epoch_ns - setting.clock.now()
        self._handshake = MasterHandshake(self.lab, self._partners, rig, wall_ns, gate, building)
        self._command = self._own.zero
        self._drift = 0.0
        self._measured: tuple[float, ...] = ()
        self._before: tuple[float, ...] = ()  # measured a tick earlier
        self._holding = Holding(lab, building, self._together, self._limits)
        self._sent_ns = 0  # when the newest command went out
        self._digest = plan.digest()
        # the rest of an interval after the share for which a slave waits
        self._wait_ns = round((1.0 - plan.link.wait_share) * self.lab.interval_ns)
        self._others_rest = resting(plan)
        self.lab.enter(session)
        building.join(lab, self._partners)

    # -- messages ---------------------------------------------------------------------------------

    def take(self, received: Received) -> None:
        """Act on one message of a slave or of the recorder."""
        lab, message, role = self.lab, received.message, received.role
        if isinstance(message, Feedback):
            if lab.exchange.belongs(message.session) and role in self.partners:
                self.partners[role].take(message, received.received_ns, received.decoded_ns)
            return
        if isinstance(message, Operator):
            obey(self, message)
            return
        lab.listen_to_recorder(message)
        if isinstance(message, Recorder):
            self._welcome(message)
        if role not in self.partners:
            return
        if isinstance(message, Waiting):
            self._handshake.one_too_many(self.partners[role], message.instance)
        elif lab.exchange.belongs(message.session):
            self._take_answer(self.partners[role], message, received.received_ns)

    def _take_answer(self, partner: Partner, message: Message, received_ns: int) -> None:
        match message:
            case Trip():
                partner.heard_ns = received_ns
                self.lab.tripped(partner.role, message, self.ticks)
            case Stopped():
                partner.stopped = True
            case _:
                self._handshake.take(partner, message, received_ns)

    def _welcome(self, recorder: Recorder) -> None:
        """Register a recorder that comes while the test runs without one, so that it records the rest."""
        lab = self.lab
        if (
            lab.running
            and not lab.recorded
            and recorder.session == 0
            and digest_of(recorder.plan) == self._digest
        ):
            lab.endpoint.send(Register(lab.exchange.session, PROTOCOL_VERSION, said(lab.plan)))

    def poll(self) -> None:
        """Before the first tick: move the handshake on, and end a test that nobody starts."""
        self._handshake.poll()
        if self._handshake.given_up:
            self.end(f"No operator started the armed test within {START_S:g} s.")

    def start(self) -> tuple[bool, str]:
        """Begin a test that waits for the operator's start; return whether it did, and a sentence."""
        return self._handshake.start()

    # -- ticks ------------------------------------------------------------------------------------

    def tick(self, tick: int) -> None:
        """Run one control interval; a tick that is late by a whole interval writes no new command.

        Where all laboratories are emulated a late tick is caught up, because only the emulation waits for it.
        """
        lab = self.lab
        wake = lab.clock.now()
        lab.tick = tick
        if lab.exchange.state is SCHEDULED:
            self._begin(wake)
        after = wake - lab.tick_ns(tick)
        late = after > 0 and wake >= lab.tick_ns(tick + 1)
        held = late and not lab.plan.makes_good
        forces = self._together.begin(tick, wake)
        self._together.tell_late(tick - 1)
        if self._alarmed(tick, after, late=late):
            self.ease(tick)
            return
        try:
            measured = self._rig.read()
            outputs = self._computed(tick, measured, forces)
            if outputs is None:
                self._descent.step(tick, measured)
                return
            wanted = self._own.command(outputs)
            violation = self._limits.violation(measured, wanted, outputs)
            if violation:
                lab.violated(violation, tick)
                self._descent.step(tick, measured)
            else:
                self._write(wanted, outputs, held=held or outputs.held)
        except RigError as error:
            self._rig_failed(error, tick)
            return
        self._send(tick, wake, nothing=bool(held or violation))
        if lab.recorded:
            self._sample(tick, measured, outputs)
        self.ticks = tick + 1
        self._drift = self._own.drift(outputs)
        self._before, self._measured = self._measured, measured
        if self._holding.active:
            self._holding.follow(tick, self._motion)
        self._watch(tick, wake)
        if lab.running:
            self._settle(tick)

    def _computed(self, tick: int, measured: tuple[float, ...], forces: Sequence[float]) -> Outputs | None:
        """What the building gives, None where it has ended the test."""
        running = self.lab.running
        try:
            outputs = self._building(tick, *self._own.felt(measured), forces)
        except (InterlockError, LostError) as error:
            self._building_failed(error, tick)
            return None
        if self._building.over:
            self.stop(COMPLETED)
        return None if running and not self.lab.running else outputs

    def _settle(self, tick: int) -> None:
        """Let the building use the time after the commands; if it fails, the ramp begins at the next tick."""
        try:
            self._building.written(tick)
        except (InterlockError, LostError) as error:
            self._building_failed(error, tick)

    def _building_failed(self, error: InterlockError | LostError, tick: int) -> None:
        """End the test, because the building computes no further displacements."""
        event = Event.LOSE if isinstance(error, LostError) else Event.TRIP
        self.lab.fail(event, error, code=self._building.who, tick=tick)

    def _finding(self, tick: int) -> tuple[WatchdogFinding, str]:
        """The worst finding of the watchdogs on the building and the slaves, and the name of the first that has it."""
        return self._together.look(tick, self._building.look(tick), self._building.who)

    def _write(self, wanted: Any, outputs: Outputs, *, held: bool) -> None:
        """Write the tick's command to the rig, or the last one again if the tick is too late (`held`)."""
        if not held:
            self._command = wanted
            for partner, sent in zip(self._partners, outputs.sent, strict=True):
                partner.sent = sent
        self._descent.wrote(self._command)
        self._rig.write(self._command)
        self._limits.written(self._command)

    def _begin(self, now: int) -> None:
        """The first tick."""
        lab = self.lab
        lab.exchange.happen(Event.RUN)
        lab.safety.take(Turn.RUN)
        lab.rig_time.begin()
        if lab.plan.eased:
            lab.note("patience", patience.sentence(lab.plan), values=patience.values(lab.plan))
        for partner in self._partners:
            partner.heard_ns = now

    def _send(self, tick: int, wake_ns: int, *, nothing: bool) -> None:
        """Send each slave the tick's command, unless `nothing`, and open the tick's row of latency."""
        for partner in self._partners:
            ready, self._sent_ns = (0, 0) if nothing else partner.send(tick)
            partner.account.open(tick, wake_ns, ready, self._sent_ns, partner.used)

    def _sample(self, tick: int, measured: tuple[float, ...], outputs: Outputs) -> None:
        lab = self.lab
        log_ns = lab.unix_ns(tick)
        publish_ns = lab.epoch_ns + (self._sent_ns or lab.clock.now()) - lab.start_ns
        before, after = self._building.recorded(outputs)
        values = (
            log_ns,
            publish_ns,
            tick,
            tick * lab.plan.test.interval,
            *before,
            *self._own.row(outputs, self._command, measured),
            *after,
            *self._together.row(tick),
        )
        lab.outlet.add("master", values)

    def _watch(self, tick: int, now: int) -> None:
        """End the test if a slave or the recorder is silent for too long or cannot go on."""
        if (partner := self._together.silent(now)) is not None:
            self.lab.lost(f"The {partner.title}", self.lab.plan.link.loss_timeout, tick)
        elif self.lab.plan.recording.required:
            self._watch_recorder(tick, now)

    def _watch_recorder(self, tick: int, now: int) -> None:
        """End a test that requires its recording if the recording fails."""
        lab, recorder = self.lab, self.lab.recorder
        if recorder is not None and recorder.state == "failed":
            error = InterlockError(f"The recording is lost: {recorder.reason}")
            lab.fail(Event.TRIP, error, code="recording_lost", tick=tick)
        elif recorder is not None and recorder.state == "stopping":
            self.stop(f"The recorder was {recorder.reason}")
        elif now - lab.recorder_heard_ns > lab.plan.recording.patience * 1e9:
            lab.lost("The recorder", lab.plan.recording.patience, tick)

    # -- hold ---------------------------------------------------------------------------------------

    @property
    def _motion(self) -> LaboratoryMotion:
        """The newest measurements of the master's own laboratory."""
        return LaboratoryMotion(self._measured, self._before, self._own.force(self._measured))

    def hold(self) -> tuple[bool, str]:
        """Bring the earthquake's time to a standstill; return whether that is possible now, and a sentence."""
        return self._holding.hold(self.ticks, self._motion)

    def resume(self) -> tuple[bool, str]:
        """Let the earthquake's time of a held test go on; return whether it is held, and a sentence."""
        return self._holding.resume(self.ticks, self._motion)

    # -- end --------------------------------------------------------------------------------------

    def stop(self, reason: str) -> None:
        """Bring the test to an end, after its last tick or earlier on request."""
        self.end(reason)

    def leave(self, *, last: bool = False) -> None:
        """Tell the slaves of the end and send the recorder the rest.

        Repeated until `left`, and called a `last` time.
        """
        lab = self.lab
        waited = [partner for partner in self._partners if partner.registered and not partner.stopped]
        if lab.exchange.state is State.STOPPING and not waited:
            lab.exchange.happen(Event.FINISH)
        if self._due(last=last):
            self._say_end()
            self._hand_over()

    @property
    def _ends(self) -> bool:
        """Whether the test ends, in order or not."""
        return self.lab.exchange.state is State.STOPPING or self.lab.error is not None

    def _say_end(self) -> None:
        lab = self.lab
        if lab.exchange.state is State.STOPPING:
            lab.endpoint.send(Stop(lab.exchange.session, self.ticks, lab.exchange.cause))
        elif lab.error is not None:
            lab.say_why()

    def disarm(self) -> None:
        """Disarm the rig and write the remaining rows of latency; called once, before leaving."""
        self.disarm_rig()
        self._building.leave()
        if self.ticks:
            self._together.finish(self.ticks)

    @property
    def left(self) -> bool:
        """Whether the slaves know of the end and the recorder has all samples."""
        settled = self.lab.exchange.ended
        return settled and (self.lab.recorder_has_all() or not self.lab.recorded)

    @property
    def completed(self) -> bool:
        """Whether the test had all its ticks."""
        ended = (
            self.lab.plan.served and self.lab.exchange.cause == COMPLETED
        )  # the client has ended its analysis
        return ended or self.ticks >= self.lab.until

    @property
    def needed(self) -> bool:
        """Whether a slave has not left yet, which recorder and operator reach through this session alone."""
        now = self.lab.clock.now()
        return any(partner.there(now) for partner in self._partners)

    @property
    def others_rest(self) -> float:
        """The longest time that the slaves take to come to rest, s."""
        return self._others_rest

    @property
    def awaited(self) -> str:
        """Slaves and recorder that have not joined yet."""
        if self.lab.exchange.state is not State.IDLE:
            return ""
        missing = [partner.title for partner in self._partners if not partner.registered]
        missing += [RECORDER] * (self.lab.recorder is None and self.lab.plan.recording.required)
        return " and ".join(missing)

    @property
    def progress(self) -> dict[str, float]:
        """The figures of the progress report: a storey's drift (m) and those of all laboratories."""
        figures = self._together.progress(self._own.force(self._measured))
        return {"drift": self._drift} | figures | self._holding.progress

    # -- pacing -----------------------------------------------------------------------------------

    def nominal(self, tick: int) -> int:
        """When a tick begins if nothing is late, ns."""
        return self.lab.tick_ns(tick)

    def begins(self, tick: int) -> tuple[int, int]:
        """A tick begins at its nominal time, ns, and never earlier."""
        nominal = self.lab.tick_ns(tick)
        return nominal, nominal

    def latest(self, tick: int) -> int:
        """Until when a tick waits for the feedbacks of the tick before, ns: shortly after its nominal time."""
        return self.lab.tick_ns(tick) + self._wait_ns

    def heard(self, tick: int) -> bool:
        """Whether every slave's feedback of the tick before has come."""
        return self._together.heard(tick - 1)

    def finish(self) -> None:
        """All ticks are done."""
        self.stop(COMPLETED)
