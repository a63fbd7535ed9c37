"""A laboratory's stream to the recorder: items in order, sent in pieces, kept for sending again.

The pieces are sent between ticks, so that the loop writes no file and a slow recorder does not delay it. How much is
kept follows from the plan, so that the memory of every laboratory stops growing after the same time of any test.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import msgpack

from common.plan.plan import Plan
from common.protocol.messages import Finished, Message, Resend, Samples
from common.recording.rows import Item, RowPacker, other
from common.roles import MASTER

PIECE = 16  # items: at 500 ticks per second a piece leaves every 16 to 32 ms, so the file has it within 0.1 s
AT_ONCE = (
    "event"  # the topic whose items are sent at once: a stopped laboratory adds no more items to fill a piece
)
# Items of this many times the recorder's patience are kept for sending again, at the default of 10 s those of a minute:
# enough for a recorder that was silent for nearly its whole patience and then asks for its holes five pieces at a time.
PATIENCES = 6
KEPT_BYTES = (
    64 << 20
)  # at most, for tall buildings with many slaves; a minute of the default test takes 10 MB
EARLY = (
    4_000  # pieces that wait for a missing one: at 16 items each more than the minute that the sender keeps
)
EARLY_BYTES = 32 << 20  # of them, half of what the sender keeps; what does not fit is asked for again
PACKER = msgpack.Packer()  # kept, because `msgpack.packb` allocates a buffer of a megabyte at every call
BURST = 5  # pieces sent again at one request: they leave between ticks, and each takes some 50 µs


def kept_seconds(plan: Plan) -> float:
    """The length of the part of a test that a laboratory keeps for sending again, s."""
    return PATIENCES * plan.recording.patience


def kept_items(plan: Plan, lab: str) -> float:
    """The number of items in `kept_seconds`: one per tick, and for the master one more per slave."""
    per_tick = 1 + len(plan.roles) if lab == MASTER else 1
    return kept_seconds(plan) / plan.test.interval * per_tick


class Outlet:
    """Sending end of one laboratory's stream; its newest `kept` items can be sent again, up to `KEPT_BYTES`.

    `rows` packs the values of an item.
    """

    def __init__(self, session: int, lab: str, kept: float, rows: RowPacker) -> None:
        self._session = session
        self._lab = lab
        self._kept = kept
        self._rows = rows.rows
        self._pending: list[Item] = []
        self._sent: deque[Samples] = deque()  # consecutive: each begins where the one before ends
        self._sent_bytes = 0
        self._hurry = False
        self.total = 0
        self.due = False  # whether a message is to be sent now

    def add(self, topic: str, values: tuple[Any, ...]) -> None:
        """Queue one item, whose values are log time, publish time (ns) and those of its signals."""
        pending, row = self._pending, self._rows.get(topic)
        if row is None:
            pending.append(other(topic, values))
            self._hurry = self._hurry or topic == AT_ONCE
        else:
            pending.append((topic, row(*values)))
        self.due = self._hurry or len(pending) >= PIECE
        self.total += 1

    def pieces(self, *, everything: bool = False) -> list[Message]:
        """The messages to send now: full pieces, or `everything` that waits, as is done for an event."""
        messages: list[Message] = []
        everything, self._hurry, self.due = everything or self._hurry, False, False
        while len(self._pending) >= PIECE or (everything and self._pending):
            items, self._pending = self._pending[:PIECE], self._pending[PIECE:]
            first = self.total - len(self._pending) - len(items)
            piece = Samples(self._session, self._lab, first, PACKER.pack(items))
            self._keep(piece)
            messages.append(piece)
        return messages

    def _keep(self, piece: Samples) -> None:
        sent = self._sent
        sent.append(piece)
        self._sent_bytes += len(piece.items)
        while len(sent) > 1 and (piece.first - sent[1].first >= self._kept or self._sent_bytes > KEPT_BYTES):
            self._sent_bytes -= len(sent.popleft().items)

    def again(self, request: Resend) -> list[Message]:
        """The first pieces, at most `BURST`, that hold requested items and are still kept."""
        if not 0 <= request.first <= request.last < self.total:
            return []
        sent = self._sent
        begin = max(bisect_right(sent, request.first, key=lambda piece: piece.first) - 1, 0)
        pieces = [sent[place] for place in range(begin, min(begin + BURST, len(sent)))]
        return [piece for piece in pieces if piece.first <= request.last]

    def finished(self) -> Finished:
        """The message with the length of the stream."""
        return Finished(self._session, self._lab, self.total)


def pairs(packed: bytes) -> tuple[Item, ...]:
    """The items of a piece as `Outlet` packs them: topics and rows, whose types are not checked."""
    items: tuple[Item, ...] = msgpack.unpackb(packed, use_list=False)
    return items


def pack_nexts(nexts: Mapping[str, int]) -> bytes:
    """The number of the next item of each stream by role, packed as the recorder's message carries it."""
    packed: bytes = msgpack.packb(dict(nexts))
    return packed


def next_of(packed: bytes, lab: str) -> int:
    """The number of the item of a stream that the recorder waits for, 0 where its message does not hold it."""
    try:
        found = msgpack.unpackb(packed)
    except (ValueError, msgpack.UnpackException):
        return 0
    there = found.get(lab) if isinstance(found, dict) else None
    return there if isinstance(there, int) else 0


class Inlet:
    """Receiving end of one stream: hands items on in order, and lists which are missing.

    `unpack` returns the items of a piece, or None where they cannot be recorded: such a piece is counted as rejected
    and stays missing. `most` bounds the number of items, so that a wrong number in a message cannot make the stream
    endless.
    """

    def __init__(self, unpack: Callable[[bytes], tuple[Item, ...] | None] = pairs, most: int = 2**62) -> None:
        self.next = 0
        self.total: int | None = None
        self.lost = 0
        self.rejected = 0
        self._unpack = unpack
        self.most = most
        self._early: dict[
            int, tuple[tuple[Item, ...], int]
        ] = {}  # by first item: items, and bytes of the piece
        self._held = 0

    def take(self, piece: Samples) -> list[Item]:
        """The items that are complete and in order with this piece; a repeated piece gives none."""
        if piece.first < self.next or piece.first in self._early:
            return []
        items = self._unpack(piece.items) if piece.first < self.most else None
        if items is None:
            self.rejected += 1
            return []
        if piece.first == self.next:
            self.next += len(items)
            return [*items, *self._ready()]
        if len(self._early) < EARLY and self._held + len(piece.items) <= EARLY_BYTES:
            self._early[piece.first] = (items, len(piece.items))
            self._held += len(piece.items)
        return []

    def end(self, finished: Finished) -> None:
        """Take note of the length of the stream."""
        if finished.total <= self.most:
            self.total = finished.total
        else:
            self.rejected += 1

    def _ready(self) -> list[Item]:
        items: list[Item] = []
        while (found := self._early.pop(self.next, None)) is not None:
            new, size = found
            self._held -= size
            self.next += len(new)
            items += new
        self._forget()
        return items

    def _forget(self) -> None:
        """Discard pieces that begin within others that were handed on: they belong to another sender."""
        for first in [first for first in self._early if first < self.next]:
            self._held -= self._early.pop(first)[1]

    def missing(self) -> tuple[int, int] | None:
        """First and last missing item of the first hole, None where there is none."""
        return next(iter(self.holes()), None)

    def holes(self) -> Iterator[tuple[int, int]]:
        """First and last missing item of every hole, in order."""
        expected = self.next
        for first in sorted(self._early):
            if first > expected:
                yield expected, first - 1
            expected = first + len(self._early[first][0])
        if self.total is not None and expected < self.total:
            yield expected, self.total - 1

    def give_up(self) -> list[Item]:
        """Count the first hole as lost and hand on what follows it."""
        hole = self.missing()
        if hole is None:
            return []
        self.lost += hole[1] + 1 - hole[0]
        self.next = hole[1] + 1
        return self._ready()

    @property
    def begun(self) -> bool:
        """Whether any piece or the length of the stream has been received."""
        return self.next > 0 or bool(self._early) or self.total is not None

    @property
    def complete(self) -> bool:
        """Whether the stream has ended and all items were handed on, except those given up."""
        return self.total is not None and self.next >= self.total
