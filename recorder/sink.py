"""Takes the recorder's items: straight into the file, or through a bounded queue and a thread."""

from __future__ import annotations

import threading
from queue import Empty, Queue
from typing import Protocol

from common.host.clock import Clock
from common.lab.outlet import AT_ONCE
from common.recording.rows import Item, values_of
from common.recording.run import MACHINES, PEAKS
from common.recording.writer import Recording
from common.roles import MASTER, SLAVE, kind_of
from recorder.encoding import RowEncoder

FLUSH_NS = (
    50_000_000  # between two flushes: with the time of a piece on its way, the file lacks less than 0.1 s
)
# The same in virtual time, where a second passes in some hundredths of one: full chunks take half the time.
SELDOM_NS = 1_000_000_000
BLOCK_BYTES = (
    8 << 10
)  # of rows encoded at once, an eighth of a chunk: a kernel's call takes as long as ten rows
SYNC_NS = 1_000_000_000  # a power failure loses a second at most; a sync takes tens of ms on a slow disk
QUEUE_ITEMS = 60_000  # a disk may block for forty seconds of a default test before items are dropped
CLOSE_S = 25.0  # to write the queue at the end: less than `rths run` waits for the recorder


class Sink(Protocol):
    """Takes items for the file."""

    @property
    def failure(self) -> str:
        """Why nothing can be written, empty while it can."""

    @property
    def dropped(self) -> int:
        """Items that were not written."""

    @property
    def most_waiting(self) -> int:
        """The largest number of items that waited to be written."""

    def put(self, items: list[Item]) -> None:
        """Take items; never waits for the disk in real time."""

    def close(self, summary: dict[str, str], machines: dict[str, str]) -> None:
        """Write the remaining items, the summary and the metadata of the machines."""


class FileSink:
    """Writes at once; flushes twenty times a second and after every event, syncs once a second.

    If it is not `timely`, as in virtual time, it flushes once a second and syncs at the end.
    """

    def __init__(self, recording: Recording, clock: Clock, *, timely: bool = True) -> None:
        self._recording = recording
        self._clock = clock
        self._encoder = RowEncoder(recording.topics, recording.channels, recording.storeys)
        self._numbers: list[Item] = []  # plain items that wait to be encoded together
        self._held = 0  # bytes of their rows
        self._timely = timely
        self._flush_ns = FLUSH_NS if timely else SELDOM_NS
        self._flushed_ns = self._synced_ns = clock.now()
        self.failure = ""
        self.dropped = 0
        self.most_waiting = 0

    def put(self, items: list[Item]) -> None:
        """Write items; after a failure of the disk they are only counted."""
        if self.failure:
            self.dropped += len(items)
            return
        at_once, sizes, numbers, held = False, self._encoder.sizes, self._numbers, self._held
        for item in items:
            topic, row = item
            if topic in sizes:
                numbers.append(item)
                held += sizes[topic]
                continue
            at_once = at_once or topic == AT_ONCE
            self._encode()
            held = 0
            log_ns, publish_ns, *values = values_of(row)
            self._recording.add(topic, log_ns, publish_ns, values)
        self._held = held
        if held >= BLOCK_BYTES:
            self._encode()
        self.keep_up(at_once=at_once)

    def _encode(self) -> None:
        """Encode the waiting plain rows into the file."""
        if self._numbers:
            self._recording.add_block(self._encoder.encode(self._numbers))
            self._numbers.clear()
            self._held = 0

    def keep_up(self, *, at_once: bool = False) -> None:
        """Flush and sync when they are due; flush in any case if `at_once`."""
        now = self._clock.now()
        try:
            if at_once or now - self._flushed_ns >= self._flush_ns:
                self._flushed_ns = now
                self._encode()
                self._recording.flush()
            if self._timely and now - self._synced_ns >= SYNC_NS:
                self._synced_ns = now
                self._recording.sync()
        except OSError as error:
            self.failure = f"the disk cannot be written ({error.strerror})."

    def _peaks(self) -> dict[str, str]:
        """The peak of each real quantity of the laboratories, and its tick, by topic and name."""
        return {
            f"{topic}/{name}": f"{peak!r} {tick}"
            for topic in self._encoder.sizes
            if kind_of(topic) in (MASTER, SLAVE)
            for name, (peak, tick) in self._encoder.peaks(topic).items()
        }

    def close(self, summary: dict[str, str], machines: dict[str, str]) -> None:
        """Finish the file; after a failure it stays readable up to that point."""
        try:
            if not self.failure:
                self._encode()
                if machines:
                    self._recording.metadata(MACHINES, machines)
                self._recording.metadata(PEAKS, self._peaks())
                self._recording.close(summary)
                return
        except OSError as error:
            self.failure = f"the disk cannot be written ({error.strerror})."
        self._recording.abandon()


class ThreadedSink:
    """A bounded queue before another sink, emptied by a thread: a slow disk drops items, but delays nothing."""

    def __init__(self, sink: FileSink, capacity: int = QUEUE_ITEMS) -> None:
        self._sink = sink
        self._capacity = capacity
        self._queue: Queue[list[Item]] = Queue()
        self._lock = threading.Lock()
        self._waiting = 0  # items in the queue and in the thread's hands
        self._overflow = 0
        self.most_waiting = 0
        self._hung = ""
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work, name="rths-recorder-disk", daemon=True)
        self._thread.start()

    @property
    def failure(self) -> str:
        """Why nothing can be written, empty while it can."""
        if self._overflow and not self._sink.failure:
            return f"the disk is too slow: {self._overflow} samples were dropped."
        return self._sink.failure or self._hung

    @property
    def dropped(self) -> int:
        """Items that were not written."""
        return self._overflow + self._sink.dropped

    def put(self, items: list[Item]) -> None:
        """Queue items, or count them as dropped if the queue is full."""
        with self._lock:
            if self._waiting + len(items) > self._capacity:
                self._overflow += len(items)
                return
            self._waiting += len(items)
            self.most_waiting = max(self.most_waiting, self._waiting)
        self._queue.put(items)

    def _work(self) -> None:
        while not (self._ending.is_set() and self._queue.empty()):
            try:
                items = self._queue.get(timeout=0.05)
            except Empty:
                self._sink.keep_up()
                continue
            self._sink.put(items)
            with self._lock:
                self._waiting -= len(items)

    def close(self, summary: dict[str, str], machines: dict[str, str]) -> None:
        """Write the queue, the summary and the metadata of the machines; give up after `CLOSE_S` if the disk blocks."""
        self._ending.set()
        self._thread.join(CLOSE_S)
        if self._thread.is_alive():
            self._hung = f"the disk has not written the last {self._waiting} samples within {CLOSE_S:g} s."
            return
        self._sink.close(summary, machines)
