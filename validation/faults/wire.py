"""The link between simulated processes: delay, loss, duplicates, disorder, damage, outages and a hostile peer's frames.

    delay of a frame = minimum + e,    e ~ Exponential(mean)

on every route from one role to another, each with random draws of its own that depend only on the seed and the route's
name. Losses in runs follow the two-state chain of Gilbert (Bell Syst. Tech. J. 39 (1960) 1253-1265). Frames of a route
keep their order, as with zenoh and TCP, except those that `reorder` holds back. The fate of every frame is counted
here, by kind of message and by number; the loops' own accounts are compared with these true numbers.
"""

from __future__ import annotations

import zlib
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from common.link.endpoint import FrameEndpoint, Received
from common.link.transport import Packet, Route, heard, said
from common.protocol.messages import Command, Feedback, Message
from simulation.world import Process, World

DRAWN = 512  # random numbers drawn at once, because one call costs as much as a hundred draws
KEPT = 4096  # frames of a route that can be replayed: four times the largest number of a fault
SOCKET = 500  # frames that wait for a stalled process: 212 992 bytes, the default receive buffer of Linux
BACKLOG = 4000  # frames that wait in a sender for a silent link: 8 s of the default test, longer than a backlog lasts
NUMBERED = (Command, Feedback)
SEQ = Command._fields.index("seq")  # of a feedback too
INSIDER = "insider"  # origin of frames of a stranger who has the keys
OPEN, DROPS, QUEUES = (
    "open",
    "drops",
    "queues",
)  # a route works, loses all frames, or keeps them until it works again


class Conditions(NamedTuple):
    """State of a route; times in s, the others are probabilities of a frame but for `run`, in frames."""

    minimum: float = 0.0
    mean: float = 0.0  # of the delay above the minimum
    loss: float = 0.0  # each frame by itself
    burst: float = 0.0  # share of frames lost in runs
    run: float = 1.0  # mean length of such a run
    duplicate: float = 0.0
    reorder: float = 0.0  # held back, so that later frames overtake
    hold: float = 0.0  # time for which a frame is held back
    corrupt: float = 0.0  # one bit flipped
    state: str = OPEN

    def over(self, other: Conditions) -> Conditions:
        """Two conditions at once: times add up, probabilities are those of at least one event."""
        either = {
            name: 1.0 - (1.0 - getattr(self, name)) * (1.0 - getattr(other, name))
            for name in ("loss", "burst", "duplicate", "reorder", "corrupt")
        }
        return Conditions(
            minimum=self.minimum + other.minimum,
            mean=self.mean + other.mean,
            run=max(self.run, other.run),
            hold=max(self.hold, other.hold),
            state=max(self.state, other.state, key=(OPEN, QUEUES, DROPS).index),
            **either,
        )

    @property
    def quiet(self) -> bool:
        """Whether frames are only delayed."""
        return self.state == OPEN and not (
            self.loss or self.burst or self.duplicate or self.reorder or self.corrupt
        )


CABLE = Conditions(minimum=60e-6, mean=20e-6)  # two machines at one switch: usual delays of an idle Ethernet


class Letter(NamedTuple):
    """A frame on its way; `number` is its message's or −1, `origin` empty where a loop sent it."""

    frame: bytes
    kind: str
    number: int
    sent_ns: int  # world time
    origin: str = ""
    intact: bool = True


class Ledger:
    """The fates of a route's frames: counts by kind, and numbers of the tick's messages."""

    def __init__(self) -> None:
        self.counts: dict[str, Counter[str]] = defaultdict(Counter)
        self.numbers: dict[str, list[int]] = defaultdict(list)  # by fate: sent, lost, corrupted, overflow
        self.arrivals: list[tuple[int, int, int, str, bool]] = []  # time, number, sent, origin, intact
        self.strangers: list[int] = []  # arrival times of messages of a stranger who has the keys

    def enter(self, fate: str, letter: Letter) -> None:
        """Count the fate of a frame."""
        self.counts[letter.kind][fate] += 1
        if letter.number >= 0 and not letter.origin:
            self.numbers[fate].append(letter.number)

    def arrived(self, time: int, letter: Letter) -> None:
        """Count a frame that was delivered to its hearer's process."""
        self.counts[letter.kind]["delivered"] += 1
        if letter.origin == INSIDER:
            self.strangers.append(time)
        elif not letter.intact:
            self.counts[letter.kind]["damaged"] += 1
        if letter.number >= 0:
            self.arrivals.append((time, letter.number, letter.sent_ns, letter.origin, letter.intact))


class WireRoute:
    """One route to one hearer, with its condition and its random draws."""

    def __init__(self, world: World, route: Route, hearer: Port, base: Conditions, seed: int) -> None:
        self.route = route
        self.hearer = hearer
        self.name = f"{route.role}>{hearer.role}/{route.channel}/{route.to}"
        self.ledger = Ledger()
        self.history: deque[Letter] = deque(maxlen=KEPT)
        self._world = world
        self._base = base
        self._laid: dict[object, Conditions] = {}
        self.seed = zlib.crc32(self.name.encode())
        self._generator = np.random.default_rng([seed, self.seed])
        self._chance = self._draws(self._generator.random)
        self._scatter = self._draws(self._generator.standard_exponential)
        self._bad = False
        self._newest = 0  # world time of the newest arrival in order
        self._queue: deque[Letter] = deque()
        self._settle()

    @staticmethod
    def _draws(draw: Callable[[int], Any]) -> Iterator[float]:
        while True:
            yield from draw(DRAWN).tolist()

    # -- condition --------------------------------------------------------------------------------

    def lay(self, key: object, conditions: Conditions) -> None:
        """Impair the route until `lift` of the same key."""
        self._laid[key] = conditions
        self._settle()

    def lift(self, key: object) -> None:
        """End an impairment; waiting frames go out unless another impairment keeps them."""
        self._laid.pop(key, None)
        self._settle()
        if self._now.state != QUEUES:
            while self._queue:
                self._pass(self._queue.popleft(), self._world.time)

    def _settle(self) -> None:
        now = self._base
        for laid in self._laid.values():
            now = now.over(laid)
        self._now, self._quiet = now, now.quiet
        self._minimum, self._mean = now.minimum * 1e9, now.mean * 1e9
        leave = 1.0 / max(now.run, now.burst / (1.0 - now.burst)) if now.burst < 1.0 else 0.0
        self._stay = 1.0 - leave
        self._enter = leave * now.burst / (1.0 - now.burst) if now.burst < 1.0 else 1.0
        if not now.burst:
            self._bad = False

    # -- frames -----------------------------------------------------------------------------------

    def send(self, letter: Letter, time: int) -> None:
        """Take a frame from a sender at a world time."""
        self.ledger.enter("sent", letter)
        self.history.append(letter)
        if self._quiet:
            self._deliver(letter, time)
        else:
            self._pass(letter, time)

    def _pass(self, letter: Letter, time: int) -> None:
        now, chance = self._now, self._chance
        if now.state == QUEUES and len(self._queue) < BACKLOG:
            self._queue.append(letter)
            return
        if now.state != OPEN or self._lost():
            self.ledger.enter("lost", letter)
            return
        if now.duplicate and next(chance) < now.duplicate:
            self.ledger.enter("duplicated", letter)
            self._deliver(letter._replace(origin="duplicate"), time)
        if now.corrupt and next(chance) < now.corrupt:
            self.ledger.enter("corrupted", letter)
            letter = letter._replace(frame=self._flipped(letter.frame), intact=False)
        if now.reorder and next(chance) < now.reorder:
            self.ledger.enter("reordered", letter)
            self._world.at(time + self._delay() + round(now.hold * 1e9), self.arrive, letter)
        else:
            self._deliver(letter, time)

    def _lost(self) -> bool:
        now = self._now
        lost = bool(now.loss and next(self._chance) < now.loss)
        if now.burst:
            lost = lost or self._bad
            self._bad = next(self._chance) < (self._stay if self._bad else self._enter)
        return lost

    def _delay(self) -> int:
        return int(self._minimum + self._mean * next(self._scatter))

    def _deliver(self, letter: Letter, time: int) -> None:
        self._newest = max(self._newest, time + self._delay())
        self._world.at(self._newest, self.arrive, letter)

    def _flipped(self, frame: bytes) -> bytes:
        place = int(next(self._chance) * len(frame) * 8)
        damaged = bytearray(frame)
        damaged[place // 8] ^= 1 << place % 8
        return bytes(damaged)

    def put(self, letters: Iterable[Letter]) -> None:
        """Put a stranger's frames onto the route; they arrive unchanged."""
        for letter in letters:
            self.ledger.enter(letter.origin, letter)
            self._world.at(self._world.time + self._delay(), self.arrive, letter)

    def again(self, count: int) -> None:
        """Send the oldest stored frames again."""
        self.put([letter._replace(origin="replayed") for letter in list(self.history)[:count]])

    def arrive(self, letter: Letter) -> None:
        """A frame reaches its hearer's machine."""
        process = self.hearer.process
        if process.ended:
            self.ledger.enter("unheard", letter)
        elif process.stalled:
            self.hearer.keep(self, letter)
        else:
            self.hand(letter)

    def hand(self, letter: Letter) -> None:
        """A frame reaches its hearer's process."""
        process = self.hearer.process
        self.ledger.arrived(self._world.time, letter)
        route = self.route
        self.hearer.heard(Packet(route.role, route.channel, letter.frame, process.local(self._world.time)))
        process.wake()


class Port:
    """One role's access to the wire: a `common.link.transport.Transport`."""

    def __init__(self, wire: Wire, process: Process) -> None:
        self.role = process.name
        self.process = process
        self.message: Message | None = None  # whose frame comes next
        self.heard: Callable[[Packet], None] = lambda _packet: None
        self.taken: Counter[str] = Counter()  # messages that its loop was given, by kind
        self.answers: list[tuple[int, int]] = []  # of a slave: tick, and the number of the command in force
        self.out: dict[tuple[str, str], list[WireRoute]] = defaultdict(list)
        self._waiting: list[tuple[WireRoute, Letter]] = []
        self._wire = wire
        process.when_woken(self._catch_up)

    def send(self, channel: str, frame: bytes, to: str = "") -> None:
        """Hand a frame to every route that it takes."""
        time, message = self.process.time, self.message
        kind = type(message)
        number: Any = message[SEQ] if message is not None and kind in NUMBERED else -1
        letter = Letter(frame, kind.__name__, number, time)
        for direction in self.out[channel, to]:
            direction.send(letter, time)

    def listen(self, heard: Callable[[Packet], None]) -> None:
        """Call `heard` with every frame."""
        self.heard = heard

    def close(self) -> None:
        """Do nothing: a port holds no resource."""

    def keep(self, direction: WireRoute, letter: Letter) -> None:
        """Keep a frame for a stalled process."""
        if len(self._waiting) < SOCKET:
            self._waiting.append((direction, letter))
        else:
            direction.ledger.enter("overflow", letter)

    def _catch_up(self) -> None:
        waiting, self._waiting = self._waiting, []
        for direction, letter in waiting:
            direction.hand(letter)


class Wire:
    """All routes between the roles of a test; every port must exist before the first frame."""

    def __init__(self, world: World, slaves: tuple[str, ...], base: Conditions, seed: int) -> None:
        self.directions: list[WireRoute] = []
        self._world = world
        self._slaves = slaves
        self._base = base
        self._seed = seed
        self._ports: dict[str, Port] = {}

    def join(self, process: Process) -> Port:
        """The access of one role, connected with all existing ones."""
        port = Port(self, process)
        for other in self._ports.values():
            self._connect(other, port)
            self._connect(port, other)
        self._ports[process.name] = port
        return port

    def _connect(self, sender: Port, hearer: Port) -> None:
        wanted = set(heard(hearer.role, self._slaves))
        for route in said(sender.role, self._slaves):
            if route in wanted:
                direction = WireRoute(self._world, route, hearer, self._base, self._seed)
                sender.out[route.channel, route.to].append(direction)
                self.directions.append(direction)

    def between(self, sender: str, hearer: str) -> list[WireRoute]:
        """The routes from one role to another."""
        return [
            direction
            for direction in self.directions
            if direction.route.role == sender and direction.hearer.role == hearer
        ]


class WireEndpoint(FrameEndpoint):
    """The loops' own endpoint at a port; while it waits, the world's time goes on."""

    def __init__(self, port: Port, plan_digest: str) -> None:
        super().__init__(port, plan_digest, port.process)
        self._port = port
        self._process = port.process

    def send(self, message: Message, to: str = "") -> int:
        """Send a message; return the time at which it was encoded, ns."""
        self._port.message = message
        if type(message) is Feedback:
            self._port.answers.append((message.seq, message.command_seq))
        return super().send(message, to)

    @property
    def unread(self) -> int:
        """Number of messages that the loop has not taken; counting removes them."""
        return sum(1 for _ in iter(super().receive, None))

    def receive(self, timeout: float = 0.0) -> Received | None:
        """The next valid message, after waiting at most `timeout` s; None if there is none."""
        self._process.settle()
        received = super().receive(0.0)
        if received is None and timeout > 0.0:
            self._process.listen(round(timeout * 1e9))
            received = super().receive(0.0)
        if received is not None:
            self._port.taken[type(received.message).__name__] += 1
        return received
