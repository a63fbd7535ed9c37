"""A slave's part of the handshake: it waits, registers, arms, synchronises its clock, agrees on the start."""

from __future__ import annotations

from common.errors import InputError, LostError, RigError
from common.lab.laboratory import REPEAT_NS, Laboratory
from common.plan.plan import PROTOCOL_VERSION
from common.plan.plan_difference import differences, digest_of
from common.protocol.exchange import Event, State
from common.protocol.messages import (
    Arm,
    Armed,
    Message,
    Refused,
    Register,
    Registered,
    Scheduled,
    Start,
    Sync,
    SyncReply,
    Waiting,
)
from common.rig import GuardedRig
from common.roles import name_of, title
from common.safety.modes import STILL_LATCHED


class SlaveHandshake:
    """A slave's handshake up to the start; `instance` identifies this process among others of its role."""

    def __init__(self, lab: Laboratory, rig: GuardedRig, instance: int) -> None:
        self._lab = lab
        self._rig = rig
        self._instance = instance
        self._digest = lab.plan.digest()
        self._said_ns = -REPEAT_NS

    def follow(self, message: Message, received_ns: int) -> None:
        """Obey a message of this session's master before the start."""
        lab = self._lab
        match message:
            case Arm():
                self._arm()
            case Sync() | Start() if lab.exchange.state is State.REGISTERED:
                pass  # it is for another process of this role, since this one was never armed
            case Sync():
                lab.endpoint.send(SyncReply(message.session, message.seq, received_ns, lab.clock.now()))
            case Start():
                self._schedule(message)
            case _:
                pass

    def register(self, request: Register) -> None:
        """Answer a master's call: take part in its test, or refuse it with the reason."""
        lab = self._lab
        if lab.exchange.state is State.IDLE:
            complaint = self._complaint(request)
            if complaint:
                lab.endpoint.send(Refused(request.session, complaint))
                lab.fail(
                    Event.REFUSE, InputError(f"This slave refuses the test: {complaint}"), code="refused"
                )
                return
            lab.enter(request.session)
            lab.move(Event.REGISTER)
        if lab.exchange.belongs(request.session):
            lab.endpoint.send(Registered(request.session, self._instance))
        elif lab.safety.latched:
            lab.endpoint.send(Refused(request.session, STILL_LATCHED))
        elif (
            not lab.exchange.ended
        ):  # a process that leaves does not answer, so that another may take its role
            lab.endpoint.send(Refused(request.session, "it takes part in another test already."))

    def make_way(self, session: int) -> None:
        """Leave without sending anything, because another process takes part in the test under this role."""
        lab = self._lab
        if not lab.exchange.allows(Event.REFUSE) or lab.exchange.session not in (0, session):
            return
        lab.enter(0)
        error = InputError(
            f"Another {title(lab.name)} takes part in this test already: stop one of the two"
            + (", or start this one under a name of its own." if name_of(lab.name) else ".")
        )
        lab.fail(Event.REFUSE, error, code="refused")

    def _complaint(self, request: Register) -> str:
        if request.protocol != PROTOCOL_VERSION:
            return f"the master speaks protocol {request.protocol}, the slave {PROTOCOL_VERSION}: install one version."
        if digest_of(request.plan) != self._digest:
            difference = differences(self._lab.plan, request.plan, "slave", "master")
            return f"the plans differ {difference}: give both laboratories the same file and options."
        return ""

    def _arm(self) -> None:
        lab = self._lab
        if lab.exchange.state is State.REGISTERED:
            try:
                self._rig.arm()
            except RigError as error:
                lab.endpoint.send(Refused(lab.exchange.session, str(error)))
                lab.fail(Event.TRIP, error, code="not_armed")
                return
            lab.move(Event.ARM)
        lab.endpoint.send(Armed(lab.exchange.session))

    def _schedule(self, start: Start) -> None:
        far = abs(start.start_ns - self._lab.clock.now()) > self._lab.plan.link.connect_timeout * 1e9
        if far:  # not a plausible start
            return
        if self._lab.exchange.state is State.ARMED:
            self._lab.start_ns = start.start_ns
            self._lab.epoch_ns = start.epoch_ns
            self._lab.move(Event.SCHEDULE)
        self._lab.endpoint.send(Scheduled(self._lab.exchange.session))

    def poll(self) -> None:
        """Before the first tick: announce this process, and give up when no master comes or it has fallen silent."""
        lab = self._lab
        seconds = lab.plan.link.connect_timeout
        if lab.exchange.ended or lab.exchange.state is State.SCHEDULED:
            return
        if lab.clock.now() - lab.heard_ns > seconds * 1e9:
            error = LostError(f"No master was heard within {seconds:g} s: check the address after --connect.")
            lab.fail(Event.LOSE, error, code="nobody")
        elif lab.exchange.state is State.IDLE and lab.clock.now() - self._said_ns >= REPEAT_NS:
            self._said_ns = lab.clock.now()
            lab.endpoint.send(Waiting(0, self._instance))
