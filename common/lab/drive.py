"""Drives a laboratory's loop through a test, in real or virtual time: handshake, ticks, ramp to rest, leaving."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from common.host.realtime import freeze
from common.host.waited import Waited
from common.lab.descent import Resting
from common.lab.laboratory import Laboratory
from common.lab.surroundings import Surroundings
from common.link.endpoint import Received
from common.plan.plan import Plan
from common.protocol.exchange import State
from common.safety.modes import Mode

# How often the handshake is polled: twenty times per repetition of a request (100 ms), so that polling adds little
# delay.
IDLE_NS = 5_000_000
# How long the closing messages are repeated where the recorder is not waited for: five leases of the link, within which
# a connection that broke is noticed and opened again.
LEAVE_NS = 5_000_000_000
# How long a laboratory stays after its last answer to an operator, who asks again every 100 ms while one is missing.
# Two such times and a half: without it, half of the emergency stops from the panel lost the slave's answer on its way.
ANSWERED_NS = 250_000_000
PROGRESS_NS = 200_000_000  # between two reports of progress: five a second are as many as a user can read
RESTING_NS = (
    500_000_000  # between two reports of the ramp to rest, which takes a few seconds at most by default
)
LATE_SHARE = 4  # on the ramp a tick late by more than a quarter of the interval is left out: see `ramp`


class DrivenLoop(Protocol):
    """What the master's and the slave's loop have in common."""

    lab: Laboratory
    ticks: int

    def take(self, received: Received) -> None:
        """Act on a received message."""

    def poll(self) -> None:
        """Take the next step of the handshake."""

    def begins(self, tick: int) -> tuple[int, int]:
        """When a tick may begin at the earliest, and when it begins if nothing is late, ns."""

    def latest(self, tick: int) -> int:
        """When a tick begins even if its message has not come, ns."""

    def heard(self, tick: int) -> bool:
        """Whether the message of a tick has come."""

    def nominal(self, tick: int) -> int:
        """When a tick begins if nothing is late, ns."""

    def tick(self, tick: int) -> None:
        """One control interval."""

    def ease(self, tick: int) -> None:
        """One interval on the ramp to rest."""

    def tell(self) -> None:
        """Tell the other laboratories that the test ends, and repeat it; may be called at any time."""

    def finish(self) -> None:
        """All ticks are done."""

    def stop(self, reason: str) -> None:
        """End the test early for this reason."""

    def disarm_rig(self) -> None:
        """Disarm the rig, once."""

    def disarm(self) -> None:
        """Bring the rig to a stop."""

    def leave(self, *, last: bool = False) -> None:
        """Send the closing messages, and repeat them; `last` where nothing follows them."""

    @property
    def left(self) -> bool:
        """Whether the closing messages have been received."""

    @property
    def completed(self) -> bool:
        """Whether the test had all its ticks."""

    @property
    def needed(self) -> bool:
        """Whether other laboratories that have not left yet are reached through this one alone."""

    @property
    def others_rest(self) -> float:
        """The longest time that the laboratories reached through this one take to come to rest, s."""

    @property
    def awaited(self) -> str:
        """The processes that have not joined the test yet, empty where all have."""

    @property
    def progress(self) -> Mapping[str, float]:
        """The figures of the progress report: see `common.terminal.plain_report.facts`."""

    @property
    def resting(self) -> Resting:
        """How far the rig is on its ramp to rest."""


def drive(loop: DrivenLoop, stopping: Callable[[], str], surroundings: Surroundings) -> None:
    """Run a test to its end; `stopping` returns the reason to end it early, empty while there is none."""
    try:
        handshake(loop, stopping)
        if loop.lab.running:
            surroundings.begin()
        freeze()
        following = run(loop, stopping)
        over = loop.lab.clock.now()
        if loop.lab.running:
            loop.finish()
        ramp(loop, following)
        if loop.lab.safety.mode is Mode.EMERGENCY_STOP:
            loop.disarm_rig()
        stay(loop, stopping)
    except Exception:  # an error of this program must not leave the rig armed
        loop.disarm()
        raise
    loop.disarm()
    surroundings.end(loop.ticks)
    leave(loop, over)


def handshake(loop: DrivenLoop, stopping: Callable[[], str]) -> None:
    """Run the handshake until the start is agreed or the test is over."""
    lab = loop.lab
    waited = Waited(lab.clock.now())
    while lab.exchange.state in (State.IDLE, State.REGISTERED, State.ARMED) and not stopping():
        loop.poll()
        if text := waited.news(loop.awaited, lab.plan.link.connect_timeout, lab.clock.now()):
            lab.report("waiting", {"lab": lab.name, "text": text})
        fetch(loop, lab.clock.now() + IDLE_NS)


def run(loop: DrivenLoop, stopping: Callable[[], str]) -> int:
    """Run the ticks until the last one or the test's early end; return the number of the tick that would come next."""
    lab = loop.lab
    reported = tick = 0
    while tick < lab.until:  # which grows while the test is held
        wait(loop, tick)
        if reason := stopping():
            loop.stop(reason)
        if not lab.running:
            return tick
        loop.tick(tick)
        if lab.outlet.due:
            lab.send_samples()
        if lab.clock.now() - reported >= PROGRESS_NS:
            reported = lab.clock.now()
            lab.tell_news(tick)
            lab.report("progress", {"tick": tick, "t": tick * lab.plan.test.interval, **loop.progress})
        tick += 1
    wait(loop, tick)
    return tick


def ramp(loop: DrivenLoop, tick: int) -> None:
    """The ramp to rest from a tick on, one interval at a time; missed intervals are left out and never caught up.

    A tick that is late by more than a quarter of the interval is left out too: the rig would get two commands within
    three quarters of an interval and follow them a third faster than the ramp's velocity allows.
    """
    lab = loop.lab
    late = lab.interval_ns // LATE_SHARE
    reported = -RESTING_NS
    while lab.safety.mode is Mode.RAMPING:
        tick += max(-((loop.nominal(tick) + late - lab.clock.now()) // lab.interval_ns), 0)
        lab.clock.sleep_until(loop.nominal(tick))
        take_all(loop)
        if lab.safety.mode is Mode.RAMPING:  # a message may have stopped the rig at once
            loop.ease(tick)
        loop.tell()
        lab.send_samples()
        if lab.safety.mode is Mode.RAMPING and lab.clock.now() - reported >= RESTING_NS:
            reported = lab.clock.now()
            lab.report("resting", {"lab": lab.name, **loop.resting._asdict()})
        tick += 1


def stay(loop: DrivenLoop, stopping: Callable[[], str]) -> None:
    """With `wait_for_reset`, stay until an operator has reset this laboratory; the master stays until all are reset."""
    lab = loop.lab
    while lab.plan.safety.wait_for_reset and (lab.safety.latched or loop.needed) and not stopping():
        fetch(loop, lab.clock.now() + IDLE_NS)
        loop.tell()
        lab.send_samples()


def wait(loop: DrivenLoop, tick: int) -> None:
    """Sleep until the time of a tick, take all messages that have come, and wait for the tick's own until `latest`.

    A laboratory that was held up reports its own overrun before it reads how the others have reacted to it.
    """
    lab, clock = loop.lab, loop.lab.clock
    earliest, nominal = loop.begins(tick)
    clock.sleep_until(earliest)
    late = clock.now() - nominal
    if late > 0 and lab.running and tick < lab.until and lab.overrun(late, tick):
        return
    take_all(loop)
    while not loop.heard(tick) and lab.running and (left := loop.latest(tick) - clock.now()) > 0:
        received = lab.endpoint.receive(left * 1e-9)
        if received is not None:
            loop.take(received)


def take_all(loop: DrivenLoop) -> None:
    """Take every message that has arrived."""
    receive = loop.lab.endpoint.receive
    while (received := receive()) is not None:
        loop.take(received)


def fetch(loop: DrivenLoop, deadline: int) -> None:
    """Take one message if it comes before the deadline (ns)."""
    received = loop.lab.endpoint.receive(max(deadline - loop.lab.clock.now(), 0) * 1e-9)
    if received is not None:
        loop.take(received)


def leave(loop: DrivenLoop, over: int) -> None:
    """Repeat the closing messages until they are received, for a bounded time.

    Meanwhile the recorder may ask for samples that it lacks.
    The recorder's patience counts from when it was last heard, as during the test, and `LEAVE_NS` is added for it to
    come back to the link and ask. A laboratory that routes for others stays while they come to rest, at most for the
    longest ramp to rest after the time `over` (ns) of the last tick; the recorder's time counts from then. One that has
    answered an operator stays for a repetition of the order, because its answer, or one that it forwards, may be lost.
    """
    lab = loop.lab
    begun, patience = lab.clock.now(), round(lab.plan.recording.patience * 1e9)
    rest = over + round(loop.others_rest * 1e9) if lab.start_ns else begun
    while (routes := coming_to_rest(loop, rest)) or not loop.left or answering(lab):
        if routes:
            begun = lab.clock.now()
        heard = lab.recorder_heard_ns if lab.recorded else begun - patience
        if lab.clock.now() >= max(begun, min(heard, begun) + patience) + LEAVE_NS:
            break
        loop.leave()
        fetch(loop, lab.clock.now() + IDLE_NS)
    loop.leave(last=True)


def answering(lab: Laboratory) -> bool:
    """Whether an operator may not have received this laboratory's answer yet, and ask again."""
    return lab.answered_ns is not None and lab.clock.now() - lab.answered_ns < ANSWERED_NS


def coming_to_rest(loop: DrivenLoop, rest: int) -> bool:
    """Whether other laboratories may still be on their ramp to rest, which ends at `rest` (ns) at the latest.

    After a trip they repeat their reason; in an orderly end they send nothing before they are at rest.
    """
    lab = loop.lab
    return (loop.needed or lab.exchange.state is State.STOPPING) and lab.clock.now() < rest


def longest_leave(plan: Plan) -> float:
    """The longest time that `leave` takes where no other laboratory is on its ramp to rest, s."""
    return LEAVE_NS * 1e-9 + plan.recording.patience
