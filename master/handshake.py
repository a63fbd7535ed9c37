"""The master's part of the handshake: slaves register, arm, synchronise their clocks, and agree on the start."""

from __future__ import annotations

from collections.abc import Sequence

from common.errors import InputError, InterlockError, LostError, RigError
from common.lab.laboratory import REPEAT_NS, Laboratory
from common.lab.preflight import LINK, Gate, RefusedError, link_check
from common.plan.plan import PROTOCOL_VERSION
from common.plan.plan_difference import differences, digest_of, said
from common.protocol.exchange import Event, State
from common.protocol.messages import Armed, Message, Refused, Register, Registered, Scheduled, SyncReply
from common.rig import GuardedRig
from common.safety.modes import STILL_LATCHED
from master.building import BuildingStep
from master.partner import Partner

# From the choice of the start to the start: a lost message is repeated twice in that time (REPEAT_NS).
LEAD_NS = 250_000_000

# s, for which armed laboratories wait for an operator's start: time to clear the room and to look at the rigs, while
# rigs that somebody has forgotten do not stay armed.
START_S = 600.0


class MasterHandshake:
    """The master's handshake up to the start; `wall_ns` is the wall clock minus the laboratory's clock.

    With a `gate` the link to every slave must pass its check, and the start may wait for an operator.
    """

    def __init__(
        self,
        lab: Laboratory,
        partners: Sequence[Partner],
        rig: GuardedRig,
        wall_ns: int,
        gate: Gate | None,
        building: BuildingStep,
    ) -> None:
        self._lab = lab
        self._building = building
        self._partners = partners
        self._rig = rig
        self._wall_ns = wall_ns
        self._gate = gate
        self._digest, self._said = lab.plan.digest(), said(lab.plan)
        self._asked_ns = -REPEAT_NS
        self._awaits = gate is not None and gate.await_start
        self._served = False  # whether the link to every slave has passed its check
        self._waits_ns = 0  # since when the start waits for an operator, 0 where it does not
        self._wait_reported = False  # whether the wait for the building's program has been reported
        for partner in partners if gate else ():
            partner.pass_gate(lab.plan.preflight.exchanges)

    def take(self, partner: Partner, message: Message, received_ns: int) -> None:
        """Act on a slave's answer."""
        match message:
            case Refused():
                self._refused(partner, message.reason)
            case SyncReply() if self._lab.exchange.state is State.ARMED:
                self._take_sync(partner, message, received_ns)
            case Registered() | Armed() | Scheduled():
                self._agree(partner, message, received_ns)
            case _:
                pass

    def one_too_many(self, partner: Partner, instance: int) -> None:
        """Tell a process that waits to take part that its role is taken, if another process has it."""
        over = self._lab.exchange.ended or self._lab.exchange.state is State.STOPPING
        if partner.registered and not over and instance != partner.instance:
            partner.arm()

    def _refused(self, partner: Partner, reason: str) -> None:
        if reason == STILL_LATCHED and self._lab.exchange.state is State.IDLE:
            self._await_reset(partner)
            return
        error = InputError(f"The {partner.title} refuses the test: {reason}")
        if self._lab.exchange.state is State.IDLE:
            self._lab.fail(Event.REFUSE, error, code="refused", remote=True)
        elif self._lab.exchange.state is State.REGISTERED:  # later there is nothing to refuse
            reason = reason or f"The {partner.title} did not arm its rig."
            self._lab.fail(Event.TRIP, RigError(reason), code="not_armed", remote=True)

    def _await_reset(self, partner: Partner) -> None:
        """Keep asking a latched slave until it is reset, because its reset reaches it through this session."""
        if not partner.latched:
            partner.latched = True
            text = f"The {partner.title} refuses the test: {STILL_LATCHED}"
            self._lab.note("latched", text, level="warning")

    def _agree(self, partner: Partner, message: Registered | Armed | Scheduled, received_ns: int) -> None:
        """Take an answer that the present state waits for, and leave the state when all slaves have given it."""
        state = self._lab.exchange.state
        match message:
            case Registered() if state is State.IDLE:
                partner.register(message.instance, received_ns)
            case Armed() if state is State.REGISTERED:
                partner.armed = True
            case Scheduled() if state is State.ARMED and self._lab.start_ns:  # it was asked
                partner.scheduled = True
            case _:
                return
        self._move_on()

    def _move_on(self) -> None:
        """Leave the present state if every slave has given the answer that it waits for."""
        state, partners = self._lab.exchange.state, self._partners
        if state is State.IDLE and self.complete and not self._building.awaited:
            if self._recorder_is_here():
                self._move(Event.REGISTER)
                self._arm()
        elif state is State.REGISTERED and all(one.armed for one in partners):
            self._move(Event.ARM)
        elif state is State.ARMED and self._lab.start_ns and all(one.scheduled for one in partners):
            self._move(Event.SCHEDULE)

    @property
    def complete(self) -> bool:
        """Whether all slaves have registered, and a recorder that the test needs is there."""
        there = self._lab.recorder is not None or not self._lab.plan.recording.required
        return there and all(one.registered for one in self._partners)

    def _move(self, event: Event) -> None:
        self._lab.move(event)
        self._lab.heard_ns = self._lab.clock.now()
        self._ask_anew(self._lab.heard_ns)

    def _ask_anew(self, now: int) -> None:
        self._asked_ns = now - REPEAT_NS
        for partner in self._partners:
            partner.ask_anew(now)

    def _recorder_is_here(self) -> bool:
        recorder = self._lab.recorder
        if recorder is not None and digest_of(recorder.plan) != self._digest:
            difference = differences(self._lab.plan, recorder.plan, "master", "recorder")
            error = InputError(f"The plans differ {difference}: give all the same file and options.")
            self._lab.fail(Event.REFUSE, error, code="refused")
            return False
        here = recorder is not None and recorder.session == self._lab.exchange.session
        return here or not self._lab.plan.recording.required

    def _arm(self) -> None:
        try:
            self._rig.arm()
        except RigError as error:
            self._lab.fail(Event.TRIP, error, code="not_armed")

    def _take_sync(self, partner: Partner, reply: SyncReply, received_ns: int) -> None:
        if not partner.take_sync(reply, received_ns):
            return
        self._lab.heard_ns = partner.heard_ns = received_ns
        if self._synchronised and not self._served and self._link_serves():
            self._served = True
            self._ask_anew(received_ns)

    def _link_serves(self) -> bool:
        """Whether every slave's link has passed its check; ends the test where one has not."""
        try:
            if self._gate is not None:
                plan = self._lab.plan
                self._gate.judge([link_check(one.trips, one.lost, plan) for one in self._partners], LINK)
        except RefusedError as error:
            self._lab.fail(Event.TRIP, error, code="refused")
            return False
        return True

    @property
    def _synchronised(self) -> bool:
        return all(partner.synchronised for partner in self._partners)

    def poll(self) -> None:
        """Before the first tick: send the next request, repeat unanswered ones, and give up after `connect_timeout`."""
        lab = self._lab
        if lab.exchange.ended or lab.exchange.state is State.SCHEDULED:
            return
        if self._forsaken():
            return
        now = lab.clock.now()
        if now - lab.heard_ns > lab.plan.link.connect_timeout * 1e9:
            self._nobody()
        elif lab.exchange.state is State.IDLE:
            if now - self._asked_ns >= REPEAT_NS:
                self._asked_ns = now
                lab.endpoint.send(Register(lab.exchange.session, PROTOCOL_VERSION, self._said))
        else:
            self._request(now)
        if not self._partners:  # without slaves there is no answer that would call it
            self._move_on()

    def _request(self, now: int) -> None:
        """Send the slaves what they have to answer next, and choose the start once it is due."""
        if self._awaits and self._lab.exchange.state is State.ARMED and self._synchronised:
            self._wait(now)
        for partner in self._partners:
            if partner.due(now):
                self._ask(partner, now)
        if not self._partners and not self._awaits:
            self._schedule(now)

    # -- an operator's start ------------------------------------------------------------------------

    def start(self) -> tuple[bool, str]:
        """Begin a test that waits for the operator's start; return whether it did, and a sentence."""
        lab = self._lab
        if lab.running:
            return False, "The test runs already."
        if self._waits_ns == 0 or lab.exchange.state is not State.ARMED:
            return False, f"The test does not wait for a start: the laboratory is {lab.safety.mode.value}."
        self._awaits, self._waits_ns = False, 0
        lab.heard_ns = lab.clock.now()
        self._schedule(lab.heard_ns)
        self._ask_anew(lab.heard_ns)
        return True, "The test begins."

    @property
    def given_up(self) -> bool:
        """Whether the start has waited for an operator for too long."""
        return self._waits_ns > 0 and self._lab.clock.now() - self._waits_ns > START_S * 1e9

    def _wait(self, now: int) -> None:
        """Keep the recorder informed while the start waits for an operator; a slave that falls silent ends the test."""
        lab = self._lab
        if not self._waits_ns:
            self._waits_ns = now
            for partner in self._partners:
                partner.heard_ns = now
            text = f"All laboratories are armed: waits for an operator's start, {START_S:g} s at most."
            told = {"t": 0.0, "lab": lab.name, "level": "info", "code": "await_start", "text": text}
            lab.report("event", told)  # which is not recorded: there is no test time yet
        if now - self._asked_ns >= REPEAT_NS:
            self._asked_ns = now
            lab.endpoint.send(Register(lab.exchange.session, PROTOCOL_VERSION, self._said))
        if not self._partners:
            lab.heard_ns = now
        silent = next((one for one in self._partners if now - one.heard_ns > lab.loss_ns), None)
        if silent is not None:
            lab.lost(f"The {silent.title}", lab.plan.link.loss_timeout)

    def _forsaken(self) -> bool:
        """Serve whoever is to move the laboratories; whether that has gone, which ends the test."""
        try:
            self._building.look_after()
        except (InterlockError, LostError) as error:
            event = Event.LOSE if isinstance(error, LostError) else Event.TRIP
            self._lab.fail(event, error, code="client")
            return True
        if self._lab.exchange.state is State.IDLE and self.complete and (whom := self._building.awaited):
            self._lab.heard_ns = self._lab.clock.now()  # nothing is armed: there is no hurry
            self._report_wait(whom)
        return False

    def _report_wait(self, whom: str) -> None:
        """Report once that the test waits for the program that computes its building."""
        if self._wait_reported:
            return
        self._wait_reported = True
        event = {
            "t": 0.0,
            "lab": self._lab.name,
            "level": "info",
            "code": "await_client",
            "text": f"Waits for {whom}.",
        }
        self._lab.report("event", event)  # which is not recorded: there is no test time yet

    def _nobody(self) -> None:
        if self._lab.exchange.state is not State.IDLE:
            self._hesitant()
            return
        missing = next((partner for partner in self._partners if not partner.registered), None)
        who, option = (missing.title, missing.start_option) if missing else ("recorder", "")
        seconds = self._lab.plan.link.connect_timeout
        if missing is not None and missing.latched:
            refusal = InputError(f"The {who} refuses the test: {STILL_LATCHED}")
            self._lab.fail(Event.REFUSE, refusal, code="refused", remote=True)
            return
        error = LostError(
            f"No {who} joined the test within {seconds:g} s: start it with the same plan{option} and --connect."
        )
        self._lab.fail(Event.LOSE, error, code="nobody")

    def _hesitant(self) -> None:
        """End the handshake because all processes have joined and one of them does not answer."""
        arming = self._lab.exchange.state is State.REGISTERED
        who = next(one for one in self._partners if not (one.armed if arming else one.scheduled))
        seconds = self._lab.plan.link.connect_timeout
        what = "arm its rig" if arming else "agree on the start"
        self._lab.fail(
            Event.LOSE,
            LostError(
                f"The {who.title} did not {what} within {seconds:g} s: find out what its laboratory waits for, "
                "or raise connect_timeout in [link]."
            ),
            code="hesitant",
        )

    def _ask(self, partner: Partner, now: int) -> None:
        match self._lab.exchange.state:
            case State.REGISTERED if not partner.armed:
                partner.arm()
            case State.ARMED if not partner.synchronised or self._waits_ns:
                partner.synchronise(now)
            case State.ARMED if self._synchronised and not partner.scheduled:
                self._schedule(now)
                partner.schedule()
            case _:
                pass

    def _schedule(self, now: int) -> None:
        """Choose the start, once."""
        lab = self._lab
        if not lab.start_ns:
            lab.start_ns = now + LEAD_NS
            lab.epoch_ns = lab.start_ns + self._wall_ns
            for partner in self._partners:
                partner.settle()
