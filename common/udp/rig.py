"""A rig in another process, with the interface of every rig: one UDP packet each way per tick.

The answer to the command of a tick holds the measurements at the end of that command, so that it is due at the next
tick. A tick waits for it for a share of the interval at most; if it is missing, the latest measurements are used.
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
from common.udp.packets import Asked, Request, RigAnswer, RigState
from common.udp.peer import Peer

ECHOES = 50  # test exchanges before a test: they resolve the 98th percentile and take about 10 ms
FIRST_NS = (
    200_000_000  # wait for the answer to a test exchange: far longer than a round trip in a local network
)
# attempts of the first packet and of the last: with 10 % loss each way all five fail in one of 4000 tests (0.19^5)
TRIES = 5
AGAIN_NS = 100_000_000  # after which an unanswered request to arm is repeated; an operator does not notice it
FREE_NS = 1_000_000_000  # wait for an answer in virtual time, in which the tick does not pass meanwhile
RUNNING = 3  # number of the safety mode `running`, which is sent in a bench test, because that has no modes


class Terms(NamedTuple):
    """The terms of the exchange with a rig, from a plan."""

    address: str
    where: str  # table of the plan, for messages
    interval: float  # s
    seed: int
    wait: float  # s, the longest time that a tick waits for an answer
    arm_timeout: float  # s
    silence: float  # s without a packet after which the rig must stop by itself
    most: int  # intervals in a row without an answer in time after which the test is stopped
    paced: bool  # whether the test runs in real time


class Echoes(NamedTuple):
    """The result of the test exchanges before a test."""

    round_trips_s: tuple[float, ...]
    lost: int
    answer: RigAnswer | None  # the last one
    faults: int = 0  # packets from there that were no valid answers of this layout


def echoes(peer: Peer, terms: Terms, session: int, channels: int) -> Echoes:
    """Do `ECHOES` exchanges that move nothing, after the first one that is answered within `TRIES` attempts."""
    trips: list[float] = []
    answer: RigAnswer | None = None
    patience, lost = FIRST_NS, 0
    faults: list[str] = []
    for seq in range(TRIES + ECHOES):
        sent = time.monotonic_ns()
        request = Request(Asked.ECHO, session, seq, terms.interval, terms.silence, 0, 0, channels)
        peer.send(packets.pack(request))
        found = answer_to(peer, session, seq, sent + patience, faults)
        if found is None and answer is None:
            if seq == TRIES - 1:
                break
            continue
        if answer is not None:  # the first exchange is not counted, because it fills caches
            lost += found is None
            if found is not None:
                trips.append((time.monotonic_ns() - sent) * 1e-9)
        answer = found or answer
        if len(trips) + lost == ECHOES:
            break
    return Echoes(tuple(trips), lost, answer, len(faults))


def answer_to(
    peer: Peer, session: int, seq: int, deadline: int, faults: list[str] | None = None
) -> RigAnswer | None:
    """The answer to the packet `seq` of a session, None if it does not arrive before the deadline (ns).

    The faults of packets that are no valid answers are added to `faults`.
    """
    while (packet := peer.receive(deadline)) is not None:
        if fault := packets.fault(packet):
            if faults is not None:
                faults.append(fault)
        else:
            answer = packets.unpack(packet)
            if (answer.session, answer.seq) == (session, seq):
                return answer
    return None


class UdpRig:
    """The rig at an address; `channels` are those of the kind of laboratory."""

    def __init__(self, channels: Channels, terms: Terms) -> None:
        self.terms = terms
        self.missed = 0  # intervals in a row without an answer in time
        self.account = Account()
        self.echoes = Echoes((), 0, None)
        self.idle_readings = False  # whether its answers to an echo hold measurements
        self._channels, self._count = packets.number(channels), len(channels.names)
        self._session = secrets.randbits(32)
        self._peer = Peer(terms.address, terms.where)
        self._mode: Callable[[], int] = lambda: RUNNING
        self._wait_ns = round(terms.wait * 1e9) if terms.paced else FREE_NS
        self._seq = self._heard = 0  # number of the last packet sent, and of the latest packet answered
        self._due = 0  # number of the packet whose answer is due; 0 if none is
        self._values: tuple[float, ...] = (0.0,) * self._count

    def follow(self, mode: Callable[[], int]) -> None:
        """Send the rig the number of the laboratory's safety mode, which `mode` returns, with every packet."""
        self._mode = mode

    # -- the interface of a rig -----------------------------------------------------------------------

    def arm(self) -> None:
        """Measure the round trip and let the rig prepare; raises RigError with a reason if it does not get ready."""
        self._seq = TRIES + ECHOES
        self.echoes = found = echoes(self._peer, self.terms, self._session, self._channels)
        if found.answer is None:
            raise RigError(f"{unanswered(self.terms, found.faults)}.")
        self._compare(found.answer)
        self.idle_readings = len(found.answer.values) == self._count
        self._values = self._ready().values

    def _compare(self, answer: RigAnswer) -> None:
        if complaint := compared(answer, self._channels):
            raise RigError(f"{complaint}.")

    def _ready(self) -> RigAnswer:
        """Request the rig to arm until it answers that it is ready; raises RigError otherwise."""
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
        """The measurements at the end of the last interval, or the latest ones if the answer is missing.

        Raises:
            RigError: the rig has stopped, or `terms.most` answers in a row were missing or late.
            EmergencyStopError: the rig reports that its emergency stop was pressed.
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
        """Request the rig to stop safely; raises RigError if it does not confirm that."""
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
        """Receive packets until the answer that is due; returns whether it arrived before the deadline (ns)."""
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

    def _accepted(self, packet: bytes) -> RigAnswer | None:
        """The answer in a packet, None if it must not be used.

        Raises:
            RigError: the rig reports that it has stopped.
            EmergencyStopError: it reports that its emergency stop was pressed.
        """
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
        """The reason to stop the test because of missing answers, and what to do, as text."""
        terms, counts = self.terms, self.account.counts
        since = f"for {self.missed} intervals in a row no valid answer was there {terms.wait * 1e3:g} ms into the tick"
        seen = [f"{counts[name]} {text}" for name, text in causes.CAUSES.items() if counts[name]]
        return (
            f"{since} (answers: {', '.join(seen)}), so look at its program, its network and its time per step, "
            f"or raise answer_share in {terms.where}"
        )


def unanswered(terms: Terms, faults: int) -> str:
    """The text of the message on a rig that does not answer at all, or only with packets that are not valid."""
    if faults:
        return (
            f"{terms.address} answers with packets that are not valid ({faults} of wrong length, checksum or version): "
            "compare them with the layout in docs/reference/udp-rig.md"
        )
    return f"nothing answers at {terms.address}: start the rig's program there, or correct address in {terms.where}"


def compared(answer: RigAnswer, channels: int) -> str:
    """The text of the message on a rig with other channels than the plan's kind of laboratory; empty if they agree."""
    if answer.channels in (0, channels):
        return ""
    return (
        f"its channels have the number {answer.channels:#010x}, those of the plan {channels:#010x}, so it is the rig "
        "of another kind of laboratory: correct address in the plan, or the number in the rig's program"
    )
