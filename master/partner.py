"""The master's state of one slave: its answers, the messages from it, the messages to it."""

from __future__ import annotations

from common.host.clock_offset import ClockOffset
from common.lab.laboratory import REPEAT_NS, Laboratory
from common.link.mailbox import LinkModel, Mailbox
from common.link.transport import addressed
from common.named import maker
from common.protocol.messages import Arm, Command, Feedback, Start, Sync, SyncReply
from common.protocol.tally import Tally
from common.roles import latency_topic, name_of, title
from common.safety.watchdog import Watchdog, WatchdogFinding
from common.signals import Channels
from laboratories.kind import Moving
from master.building import Sent
from master.latency import LatencyAccount

# Exchanges of clock readings before the start. Most of them wait in no queue, so some of 200 have nearly the shortest
# round trip; they take less than 0.1 s on a local network.
SYNC_EXCHANGES = 200
# Blocks of exchanges for the clock's offset: the best of each half a second, over twenty seconds, in which the drift of
# a crystal changes little.
OFFSET_BLOCK, OFFSET_BLOCKS = 250, 40
GIVEN_UP_NS = (
    5 * REPEAT_NS
)  # silence, five unanswered requests, after which another process may take the role

# the feedback before the first one; `Partner.used` has as many channels as the slave's laboratory
NO_FEEDBACK = Feedback(0, -1, -1, 0, -1, 0, 0, 0, (0.0, 0.0, 0.0, 0.0))

made = maker(Command)

NOTHING_SENT = (0.0, 0.0, 0.0, 0.0, 0.0)


class Partner:
    """A slave in a test; `link` is the plug-in that delays its messages, `channels` are those of its laboratory."""

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
        self._asked = self._answered = 0  # exchanges requested, and answered
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
        self.latched = False  # latched since an earlier test, so that it refuses this one
        self.commands = 0  # sent
        self.channels = channels
        self._force = channels.names.index(channels.force)
        self.position = channels.names.index(channels.position)
        self.force_name = channels.force
        self.used = self._before = NO_FEEDBACK._replace(measured=(0.0,) * len(channels.names))
        self.sent: Sent = NOTHING_SENT

    # -- handshake --------------------------------------------------------------------------------

    @property
    def registered(self) -> bool:
        """Whether it has registered."""
        return self.instance != 0

    def register(self, instance: int, now: int) -> None:
        """Register a process: the first one, or a later one if the first has fallen silent."""
        if not self.registered or now - self.heard_ns > GIVEN_UP_NS:
            self.instance = instance
        if instance == self.instance:
            self.heard_ns = now

    @property
    def synchronised(self) -> bool:
        """Whether enough exchanges of clock readings were made."""
        return self._syncs >= self._exchanges

    def there(self, now: int) -> bool:
        """Whether it takes part: it has not left, and was not silent for too long."""
        return self.registered and not self.stopped and now - self.heard_ns < self._silence_ns

    def pass_gate(self, exchanges: int) -> None:
        """Require at least so many exchanges before the start."""
        self._exchanges = max(exchanges, SYNC_EXCHANGES)

    @property
    def start_option(self) -> str:
        """The option with which its process is started, in addition to plan and address."""
        return f", --name {name_of(self.role)}" if self._address else ""

    def ask_anew(self, now: int) -> None:
        """Let the next request be sent at once."""
        self._asked_ns = now - REPEAT_NS

    def due(self, now: int) -> bool:
        """Whether a request is due; takes note of the time if it is."""
        if now - self._asked_ns < REPEAT_NS:
            return False
        self._asked_ns = now
        return True

    def arm(self) -> None:
        """Ask the registered process to arm; another process of this role learns by it that the role is taken."""
        self._lab.endpoint.send(Arm(self._lab.exchange.session, self.instance), self._address)

    def synchronise(self, now: int) -> None:
        """Request an exchange of clock readings."""
        self._asked += 1
        self._sync_sent_ns = now
        self._lab.endpoint.send(Sync(self._lab.exchange.session, self._syncs, now), self._address)

    @property
    def lost(self) -> int:
        """The number of exchanges without an answer."""
        return self._asked - self._answered

    def take_sync(self, reply: SyncReply, received_ns: int) -> bool:
        """Take an answer; returns whether it is that to the last request."""
        self._answered += 0 <= reply.seq <= self._syncs and self._answered < self._asked
        if reply.seq != self._syncs:
            return False
        self._offset.add(self._sync_sent_ns, reply.received_ns, reply.sent_ns, received_ns)
        self._syncs += 1
        if (
            self._syncs <= self._exchanges
        ):  # later ones, ten a second, are made while the start waits for an operator
            self.trips.append((received_ns - self._sync_sent_ns) * 1e-9)
            self.ask_anew(received_ns)
        return True

    def settle(self) -> None:
        """Keep the present estimate of the offset, by which the start is chosen."""
        self._first_offset = self._offset.at(self._lab.start_ns)

    def schedule(self) -> None:
        """Tell it the agreed start on its own clock."""
        lab = self._lab
        there = lab.start_ns + self._first_offset
        lab.endpoint.send(Start(lab.exchange.session, there, lab.epoch_ns), self._address)

    # -- ticks ------------------------------------------------------------------------------------

    def take(self, feedback: Feedback, received_ns: int, decoded_ns: int) -> None:
        """Take a feedback, if it is fresh."""
        expected = self._lab.tick_at(received_ns - self._lab.start_ns)
        if not self.tally.admit(feedback.seq, expected):
            return
        self.heard_ns = received_ns
        extra = self._feedback.put(feedback.seq, feedback)
        if extra is None:
            self.tally.lose(feedback.seq)
        self.account.answer(feedback, received_ns, decoded_ns, extra)

    def heard(self, seq: int) -> bool:
        """Whether the feedback of a tick or a later one has come."""
        return self._feedback.newest_seen >= seq

    def begin(self, tick: int, now: int) -> float:
        """Begin a tick; returns the force (N) that it uses, that of the newest feedback available."""
        if (feedback := self._feedback.take(tick)) is not None:
            self._before, self.used = self.used, feedback
            self.tally.use(feedback.seq)
        self.account.close(tick - 1, now)
        return self.used.measured[self._force]

    @property
    def force(self) -> float:
        """The force (N) in use."""
        return self.used.measured[self._force]

    def moving(self, duration: float, interval: float) -> Moving:
        """The motion of its laboratory by the newest feedback and the one before; `duration` (s) of a standstill."""
        used, before = self.used, self._before
        _, effort, velocity, *_ = self.sent
        between = max(used.seq - before.seq, 1) * interval
        rates = tuple((new - old) / between for new, old in zip(used.measured, before.measured, strict=True))
        return Moving(velocity, effort, used.measured, rates, duration)

    def look(self, tick: int) -> WatchdogFinding:
        """The watchdog's finding at a tick that came in time."""
        judged = self._feedback.judged(self.used)
        return self._watchdog.look(tick - 1, judged.seq, judged.heard_seq)

    def send(self, tick: int) -> tuple[int, int]:
        """Send the command; returns when its turn came and when its frame was handed to the link, ns."""
        lab = self._lab
        now = lab.clock.now()
        shift = self._offset.at(now) - self._first_offset
        fields = (lab.exchange.session, tick, now, shift, self._feedback.newest_seen, *self.sent)
        self.commands += 1
        return now, lab.endpoint.send(made(fields), self._address)

    def exchanged(self) -> tuple[str, dict[str, float]]:
        """The counts of the messages of both directions that the master knows: a sentence and its values."""
        if (last := self._feedback.take(self.commands)) is not None:  # for the tick after the last one
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
