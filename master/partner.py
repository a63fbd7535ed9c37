"""One slave as the master knows it: what it has answered, what came from it, what was sent to it."""

from __future__ import annotations

from common.host.clock_offset import ClockOffset
from common.lab.laboratory import REPEAT_NS, Laboratory
from common.link.mailbox import LinkModel, Mailbox
from common.link.transport import addressed
from common.protocol.messages import Arm, Command, Feedback, Start, Sync, SyncReply
from common.protocol.tally import Tally
from common.roles import latency_topic, name_of, title
from common.safety.watchdog import Watchdog, WatchdogFinding
from common.signals import Channels
from master.latency import LatencyAccount
from master.step import Sent

# before the start: most exchanges wait in no queue, so that some of these show the shortest round trip
SYNC_EXCHANGES = 200
OFFSET_BLOCK, OFFSET_BLOCKS = 250, 40  # exchanges: the best of half a second each, twenty seconds of them
GIVEN_UP_NS = 5 * REPEAT_NS  # silence after which another process may register under the same name

# stands for what has not come; a partner's own has as many channels as its laboratory
NO_FEEDBACK = Feedback(0, -1, -1, 0, -1, 0, 0, 0, (0.0, 0.0, 0.0, 0.0))

NOTHING_SENT = (0.0, 0.0, 0.0, 0.0, 0.0)


class Partner:
    """A slave in a test; `role` is what it is called, `link` the impairment of what comes from it.

    `channels` are those of its laboratory.
    """

    def __init__(self, role: str, lab: Laboratory, link: LinkModel, channels: Channels) -> None:
        interval = lab.plan.test.interval
        self.role = role
        self.title = title(role)
        self._lab = lab
        self._address = addressed(role)
        self._feedback: Mailbox[Feedback] = Mailbox(link, "feedback", interval, nominal=1)
        self._offset = ClockOffset(length=OFFSET_BLOCK, blocks=OFFSET_BLOCKS)
        self._first_offset = 0
        self._sync_sent_ns = 0
        self._syncs = 0
        self._exchanges = SYNC_EXCHANGES
        self.trips: list[float] = []  # of the exchanges before the start, s
        self._asked = self._answered = 0  # how often for an exchange, how often it came back
        self._asked_ns = -REPEAT_NS
        self._watchdog = Watchdog(lab.plan.safety, interval)
        self._silence_ns = max(round(lab.plan.link.loss_timeout * 1e9), GIVEN_UP_NS)
        self.tally = Tally(lab.plan.ticks, lab.plan.window)
        self.account = LatencyAccount(lab, self._offset, latency_topic(role))
        self.instance = 0  # the process that takes part under this role, 0 for none yet
        self.armed = False
        self.scheduled = False
        self.stopped = False
        self.heard_ns = 0
        self.latched = False  # since a test before, so that it refuses this one
        self.commands = 0  # sent
        self.channels = channels
        self._force = channels.names.index(channels.force)
        self.used = NO_FEEDBACK._replace(measured=(0.0,) * len(channels.names))
        self.sent: Sent = NOTHING_SENT

    # -- handshake --------------------------------------------------------------------------------

    @property
    def registered(self) -> bool:
        """Whether it has registered."""
        return self.instance != 0

    def register(self, instance: int, now: int) -> None:
        """A process registers: the first one counts, or a later one once that has fallen silent."""
        if not self.registered or now - self.heard_ns > GIVEN_UP_NS:
            self.instance = instance
        if instance == self.instance:
            self.heard_ns = now

    @property
    def synchronised(self) -> bool:
        """Whether enough is known of its clock."""
        return self._syncs >= self._exchanges

    def there(self, now: int) -> bool:
        """Whether it takes part: its last message has not come, and it was not silent for too long."""
        return self.registered and not self.stopped and now - self.heard_ns < self._silence_ns

    def pass_gate(self, exchanges: int) -> None:
        """So many exchanges must be made before the start."""
        self._exchanges = max(exchanges, SYNC_EXCHANGES)

    @property
    def start_option(self) -> str:
        """The option that its process is started with, beside plan and address."""
        return f", --name {name_of(self.role)}" if self._address else ""

    def ask_anew(self, now: int) -> None:
        """Ask the next question at once, not when the last one is due again."""
        self._asked_ns = now - REPEAT_NS

    def due(self, now: int) -> bool:
        """Whether it is time to ask, and takes note of it."""
        if now - self._asked_ns < REPEAT_NS:
            return False
        self._asked_ns = now
        return True

    def arm(self) -> None:
        """Ask the process that has registered to arm; another of the same name learns by it that its place is taken."""
        self._lab.endpoint.send(Arm(self._lab.exchange.session, self.instance), self._address)

    def synchronise(self, now: int) -> None:
        """Ask for one exchange of clock readings."""
        self._asked += 1
        self._sync_sent_ns = now
        self._lab.endpoint.send(Sync(self._lab.exchange.session, self._syncs, now), self._address)

    @property
    def lost(self) -> int:
        """Exchanges asked for that never came back; one that was asked again and came twice is not lost."""
        return self._asked - self._answered

    def take_sync(self, reply: SyncReply, received_ns: int) -> bool:
        """Take in the answer to the last one asked for; whether it was that."""
        self._answered += 0 <= reply.seq <= self._syncs and self._answered < self._asked
        if reply.seq != self._syncs:
            return False
        self._offset.add(self._sync_sent_ns, reply.received_ns, reply.sent_ns, received_ns)
        self._syncs += 1
        self.trips.append((received_ns - self._sync_sent_ns) * 1e-9)
        self.ask_anew(received_ns)
        return True

    def settle(self) -> None:
        """Keep the present estimate of its clock, because the start is chosen by it."""
        self._first_offset = self._offset.at(self._lab.start_ns)

    def schedule(self) -> None:
        """Tell it the agreed start on its own clock."""
        lab = self._lab
        there = lab.start_ns + self._first_offset
        lab.endpoint.send(Start(lab.exchange.session, there, lab.epoch_ns), self._address)

    # -- ticks ------------------------------------------------------------------------------------

    def take(self, feedback: Feedback, received_ns: int, decoded_ns: int) -> None:
        """Take in a feedback, unless it is not fresh."""
        expected = self._lab.tick_at(received_ns - self._lab.start_ns)
        if not self.tally.admit(feedback.seq, expected):
            return
        self.heard_ns = received_ns
        extra = self._feedback.put(feedback.seq, feedback)
        if extra is None:
            self.tally.lose(feedback.seq)
        self.account.answer(feedback, received_ns, decoded_ns, extra)

    def heard(self, seq: int) -> bool:
        """Whether the feedback of a tick has come, or a later one."""
        return self._feedback.newest_seen >= seq

    def begin(self, tick: int, now: int) -> float:
        """The force (N) that a tick uses: that of the newest feedback received before the tick."""
        if (feedback := self._feedback.take(tick)) is not None:
            self.used = feedback
            self.tally.use(feedback.seq)
        self.account.close(tick - 1, now)
        return self.used.measured[self._force]

    @property
    def force(self) -> float:
        """The force (N) in use."""
        return self.used.measured[self._force]

    def look(self, tick: int) -> WatchdogFinding:
        """The watchdog's finding at a tick that came in time."""
        judged = self._feedback.judged(self.used)
        return self._watchdog.look(tick - 1, judged.seq, judged.heard_seq)

    def send(self, tick: int) -> tuple[int, int]:
        """Send the command; return when its turn came and when its frame was handed to the link, ns."""
        lab = self._lab
        now = lab.clock.now()
        shift = self._offset.at(now) - self._first_offset
        command = Command(lab.exchange.session, tick, now, shift, self._feedback.newest_seen, *self.sent)
        self.commands += 1
        return now, lab.endpoint.send(command, self._address)

    def exchanged(self) -> tuple[str, dict[str, float]]:
        """The fate of the messages of both directions as far as this end knows: a sentence and its numbers."""
        if (last := self._feedback.take(self.commands)) is not None:  # came for the tick after the last one
            self.tally.use(last.seq)
        values = {f"{self.role}.commands_sent": float(self.commands)}
        values |= self.tally.values(f"{self.role}.feedbacks")
        text = f"{self.commands} commands sent to the {self.title}, {self.tally.used} of its feedbacks used."
        return text, values

    def row(self, tick: int) -> tuple[float | int, ...]:
        """The force (N) in use at a tick, the tick at which it was measured, its age (s), and what was sent."""
        used = self.used
        age = (tick - used.seq) * self._lab.plan.test.interval if used.seq >= 0 else 0.0
        if self.channels.effort is None:
            target, _, *rates = self.sent
            return used.measured[self._force], used.seq, age, target, *rates
        return used.measured[self._force], used.seq, age, *self.sent
