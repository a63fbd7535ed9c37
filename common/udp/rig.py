"""A rig in another process, behind the interface of any rig: one UDP packet each way per tick.

The answer to the command of a tick is what the rig measures at that command's end, so it is due at the next tick. A
tick waits for it for a share of the interval, never longer, and goes on with the newest reading where it is not there.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable
from typing import NamedTuple

from common.errors import EmergencyStopError, RigError
from common.signals import Channels
from common.udp import account as causes
from common.udp import packets
from common.udp.account import Account
from common.udp.packets import Answer, Asked, Request, RigState
from common.udp.peer import Peer

ECHOES = 50  # exchanges before a test by which its rig is judged: a 98th percentile, in some 10 ms
FIRST_NS = 200_000_000  # an answer to the first packets is waited for: any network of a laboratory is faster
TRIES = 5  # of the first packet, and of the last
AGAIN_NS = 100_000_000  # an unanswered wish to arm is repeated after this long
FREE_NS = 1_000_000_000  # in virtual time an answer is waited for: no clock runs away meanwhile
RUNNING = 3  # number of that safety mode: of a bench test, which has no modes


class Terms(NamedTuple):
    """What a plan says of the exchange with a rig."""

    address: str
    where: str  # table of the plan, for sentences about it
    interval: float  # s
    seed: int
    wait: float  # s that a tick waits for an answer at most
    arm_timeout: float  # s
    silence: float  # s without a packet after which the rig shall stop on its own
    most: int  # intervals without an answer in time after which the rig is given up
    paced: bool  # whether the test runs in real time


class Echoes(NamedTuple):
    """What came of the exchanges before a test."""

    round_trips_s: tuple[float, ...]
    lost: int
    answer: Answer | None  # the last one


def echoes(peer: Peer, terms: Terms, session: int, channels: int) -> Echoes:
    """Exchange packets that move nothing; none are lost on a rig that is there and not held up."""
    trips: list[float] = []
    answer: Answer | None = None
    patience, lost = FIRST_NS, 0
    for seq in range(TRIES + ECHOES):
        sent = time.monotonic_ns()
        request = Request(Asked.ECHO, session, seq, terms.interval, terms.silence, 0, 0, channels)
        peer.send(packets.pack(request))
        found = answer_to(peer, session, seq, sent + patience)
        if found is None and answer is None:
            if seq == TRIES - 1:
                break
            continue
        if answer is not None:  # the first one is slow: caches are cold
            lost += found is None
            if found is not None:
                trips.append((time.monotonic_ns() - sent) * 1e-9)
        answer = found or answer
        if len(trips) + lost == ECHOES:
            break
    return Echoes(tuple(trips), lost, answer)


def answer_to(peer: Peer, session: int, seq: int, deadline: int) -> Answer | None:
    """The answer to a packet of that number, None where it has not come by the deadline (ns)."""
    while (packet := peer.receive(deadline)) is not None:
        if not packets.fault(packet):
            answer = packets.unpack(packet)
            if (answer.session, answer.seq) == (session, seq):
                return answer
    return None


class UdpRig:
    """The rig at an address; `channels` are those of its laboratory's kind."""

    def __init__(self, channels: Channels, terms: Terms) -> None:
        self.terms = terms
        self.missed = 0  # intervals in a row without an answer in time
        self.account = Account()
        self.echoes = Echoes((), 0, None)
        self.idle_readings = False  # whether its answers to an echo hold readings
        self._channels, self._count = packets.number(channels), len(channels.names)
        self._session = secrets.randbits(32)
        self._peer = Peer(terms.address, terms.where)
        self._mode: Callable[[], int] = lambda: RUNNING
        self._wait_ns = round(terms.wait * 1e9) if terms.paced else FREE_NS
        self._seq = self._heard = 0  # numbers of the last packet sent, and of the newest one answered
        self._due = 0  # number of the packet whose answer is awaited; 0: none
        self._values: tuple[float, ...] = (0.0,) * self._count

    def follow(self, mode: Callable[[], int]) -> None:
        """Tell the rig from now on the number that `mode` gives of the laboratory's safety mode."""
        self._mode = mode

    # -- the interface of a rig -----------------------------------------------------------------------

    def arm(self) -> None:
        """Find the rig, measure the round trip and let it get ready; raises RigError with a reason if it does not."""
        self._seq = TRIES + ECHOES
        self.echoes = found = echoes(self._peer, self.terms, self._session, self._channels)
        if found.answer is None:
            raise RigError(f"{unanswered(self.terms)}.")
        self._compare(found.answer)
        self.idle_readings = len(found.answer.values) == self._count
        self._values = self._ready().values

    def _compare(self, answer: Answer) -> None:
        if complaint := compared(answer, self._channels):
            raise RigError(f"{complaint}.")

    def _ready(self) -> Answer:
        """The rig's answer that it is ready."""
        packet = self._packet(Asked.ARM)
        end = time.monotonic_ns() + round(self.terms.arm_timeout * 1e9)
        said = "nothing"
        while (now := time.monotonic_ns()) < end:
            self._peer.send(packet)
            answer = answer_to(self._peer, self._session, self._seq, min(now + AGAIN_NS, end))
            if answer is None:
                continue
            if answer.state == RigState.READY and len(answer.values) == self._count:
                self._heard = self._seq
                return answer
            if answer.state == RigState.READY:
                raise RigError(
                    f"it answers with {len(answer.values)} numbers, but must measure {self._count}: see the table "
                    "of its channels (`rths check`)."
                )
            said = answer.text or "that it is not ready"
            if answer.state != RigState.PREPARING:
                raise RigError(f"it does not arm and says: {said}.")
            time.sleep(max(min(now + AGAIN_NS, end) - time.monotonic_ns(), 0) * 1e-9)
        raise RigError(
            f"it was not ready after {self.terms.arm_timeout:g} s and says: {said}; look at the rig, or raise "
            f"arm_timeout in {self.terms.where}."
        )

    def read(self) -> tuple[float, ...]:
        """What the rig measured at the end of the last interval; the newest reading where its answer is not there.

        Raises:
            RigError: the rig has stopped, or answers have not been there in time for too many intervals.
        """
        if not self._due:
            if not self.idle_readings:
                return self._values
            self._send(Asked.ECHO)
        begun = time.monotonic_ns()
        if self._hear(begun + self._wait_ns):
            self.account.answered(time.monotonic_ns() - begun)
            self.missed = 0
        else:
            self.missed += 1
            self.account.counts[causes.MISSED] += 1
            if self.missed >= self.terms.most:
                raise RigError(f"{self._silent()}.")
        return self._values

    def write(self, command: tuple[float, ...]) -> None:
        """Send the commands of the coming interval."""
        self._send(Asked.COMMAND, command)

    def disarm(self) -> None:
        """Let the rig come to a safe stop; raises RigError where it does not confirm it."""
        packet = self._packet(Asked.DISARM)
        if self.echoes.answer is None:  # it was never reached
            self._peer.send(packet)
            return
        for _ in range(TRIES):
            self._peer.send(packet)
            if answer_to(self._peer, self._session, self._seq, time.monotonic_ns() + AGAIN_NS // 2):
                return
        raise RigError("it has not confirmed that it is disarmed, so look at the rig itself")

    # -- packets --------------------------------------------------------------------------------------

    def _packet(self, kind: Asked, values: tuple[float, ...] = ()) -> bytes:
        self._seq += 1
        terms = self.terms
        head = (kind, self._session, self._seq, terms.interval, terms.silence, terms.seed & (2**64 - 1))
        return packets.pack(Request(*head, self._mode(), self._channels, values))

    def _send(self, kind: Asked, values: tuple[float, ...] = ()) -> None:
        self._peer.send(self._packet(kind, values))
        self._due = self._seq

    def _hear(self, deadline: int) -> bool:
        """Take what has come, until the answer that is due is among it; whether it was there by the deadline."""
        while (packet := self._peer.receive(deadline)) is not None:
            answer = self._accepted(packet)
            if answer is None:
                continue
            self._heard, self._values = answer.seq, answer.values
            if answer.seq == self._due:
                self._due = 0
                return True
            self.account.counts[causes.LATE] += 1
        return False

    def _accepted(self, packet: bytes) -> Answer | None:
        """The answer in a packet, None where it must not be used; raises where the rig says that it has stopped."""
        if packets.fault(packet):
            self.account.counts[causes.DAMAGED] += 1
            return None
        answer = packets.unpack(packet)
        if answer.session != self._session:
            self.account.counts[causes.FOREIGN] += 1
            return None
        if not self._heard < answer.seq <= self._seq:
            self.account.counts[causes.OLD] += 1
            return None
        if answer.state == RigState.EMERGENCY:
            raise EmergencyStopError(f"its emergency stop was pressed: {answer.text or 'no reason given'}.")
        if answer.state == RigState.STOPPED and answer.kind == Asked.COMMAND:
            raise RigError(f"it has stopped and says: {answer.text or 'nothing'}.")
        if len(answer.values) != self._count:
            self.account.counts[causes.DAMAGED] += 1
            return None
        return answer

    def _silent(self) -> str:
        """Why the rig is given up, in words."""
        terms, counts = self.terms, self.account.counts
        since = f"for {self.missed} intervals in a row no valid answer was there {terms.wait * 1e3:g} ms into the tick"
        seen = [f"{counts[name]} {text}" for name, text in causes.CAUSES.items() if counts[name]]
        return (
            f"{since} (answers: {', '.join(seen)}), so look at its program, its network and its time per step, "
            f"or raise answer_share in {terms.where}"
        )


def unanswered(terms: Terms) -> str:
    """A sentence's words on a rig that does not answer at all."""
    return f"nothing answers at {terms.address}: start the rig's program there, or correct address in {terms.where}"


def compared(answer: Answer, channels: int) -> str:
    """What is wrong where a rig says other channels than the plan's kind has; empty where nothing is."""
    if answer.channels in (0, channels):
        return ""
    return (
        f"its channels have the number {answer.channels:#010x}, those of the plan {channels:#010x}, so it is the rig "
        "of another kind of laboratory: correct address in the plan, or the number in the rig's program"
    )
