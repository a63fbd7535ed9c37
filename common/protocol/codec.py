"""Encodes messages as frames and decodes them: msgpack arrays of fixed fields, followed by a keyed 64-bit check.

A frame is `msgpack([kind, field, …]) + check`. Messages that hold numbers only, those of a tick among them, have each
number in its widest form (int 64, float 64), so that all frames of such a kind have one layout. A frame that does not
have exactly the fields, types and ranges of a known message, or whose check fails, is rejected with a reason. The size
of a frame is checked first; unpacking hostile content within that size takes at most some sixty bytes of memory per
byte of the frame, for a short time.
"""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable, Container, Sequence
from enum import Enum
from math import isfinite
from operator import itemgetter
from typing import Any, Protocol, cast, get_args, get_origin, get_type_hints

import msgpack

from common.protocol.messages import MOST_CHANNELS, Message

CHECK_SIZE = 8  # bytes: one damaged frame in 2^64 passes
MOST = 2**62  # largest whole number: in ns 146 years, and the sum of two still fits 64 bits
# Characters of a text: an error message of a rig, or the keys of a plan that differ from their defaults. The plans that
# ship need up to 2000 characters.
MOST_TEXT = 4_000
# Bytes of a frame on any channel: some twenty times the largest piece of samples of 100 storeys.
MOST_FRAME = 1 << 20
LEAST = {
    "shift_ns": -MOST,
    "command_seq": -1,
    "heard_seq": -1,
}  # smallest value of these whole numbers, 0 for all others

MESSAGES: tuple[type[Any], ...] = get_args(Message)
KINDS = {message: kind for kind, message in enumerate(MESSAGES)}


class Reject(Enum):
    """Why a frame was rejected; `docs/reference/rejections.md` says what each means and what to do."""

    LENGTH = "length"
    CHECK = "check"
    UNREGISTERED = "unregistered"
    OPEN_KEY = "open_key"
    FORMAT = "format"
    KIND = "kind"
    KIND_NOT_ALLOWED = "kind_not_allowed"
    FIELDS = "fields"
    TYPE = "type"
    VALUE = "value"
    SENDER = "sender"


class RejectedFrame(ValueError):  # noqa: N818 - it describes a frame and is counted rather than shown
    """Raised for a frame that is not a valid message, with the reason."""

    def __init__(self, reason: Reject) -> None:
        super().__init__(reason.value)
        self.reason = reason


NUMBERS = {
    int: (0xD3, "q"),
    float: (0xCB, "d"),
}  # msgpack's int 64 and float 64: their marks, and struct's letters
ARRAY = 0x90  # msgpack's mark of an array of up to 15 items, plus their count


def checker(names: Sequence[str], types: Sequence[type]) -> Callable[..., bool]:
    """A function that tells whether the items of a message of numbers, its kind first, are in their ranges.

    It is generated as one expression, because right after a wake-up the processor's caches are cold and each function
    call takes longer than the comparisons.
    """
    hints = dict(zip(names, types, strict=True))
    whole = [f"{LEAST.get(name, 0)} <= {name} <= {MOST}" for name in names if hints[name] is int]
    floats = [name for name in names if hints[name] is float]
    finite = [f"isfinite({' + '.join(floats)})"] if floats else []
    source = f"lambda _kind, {', '.join(names)}: {' and '.join(whole + finite)}"
    admits: Callable[..., bool] = eval(source, {"isfinite": isfinite})  # noqa: S307 - of the fields' names alone
    return admits


class _Layout:
    """The payload of a message that holds numbers only: two bytes for array and kind, then nine bytes per number.

    It is valid msgpack, but `struct` reads and writes it, which takes a third of the time.
    """

    def __init__(self, names: Sequence[str], types: Sequence[type]) -> None:
        fields = [NUMBERS[kind] for kind in types[1:]]
        self.marks = bytes(mark for mark, _ in fields)
        self.size = 2 + 9 * len(fields)
        self.admits = checker(names, types[1:])
        self._write = struct.Struct(">BB" + "".join(f"B{letter}" for _, letter in fields)).pack
        self.read = struct.Struct(">xB" + "".join(f"x{letter}" for _, letter in fields)).unpack
        # only the loop's thread encodes, so the numbers of each message can replace those of the last one in place
        self._slots: list[Any] = [ARRAY + len(types), 0, *(item for mark in self.marks for item in (mark, 0))]

    def pack(self, kind: int, numbers: Sequence[int | float]) -> bytes:
        """The payload of a message of this kind that holds these numbers."""
        slots = self._slots
        slots[1] = kind
        slots[3::2] = numbers
        return self._write(*slots)


class _Shape:
    """The requirements on the items of one frame: exact types, whole numbers and texts in range, floats finite.

    The first item is the kind of the message. The checks use functions written in C where they can, since they run
    twice a tick. `channels` is the number of floats in the message's last field, which is a tuple of them, or 0.
    """

    def __init__(self, message: type[Any], channels: int = 0) -> None:
        hints = get_type_hints(message)
        self.message, self.channels = message, channels
        fields: tuple[str, ...] = message._fields[:-1] if channels else message._fields
        numbers = [f"{message._fields[-1]}_{place}" for place in range(channels)]
        self.names = (*fields, *numbers)
        self.types = (int, *(hints[name] for name in fields), *[float] * channels)
        self._numbers = self._items(int)
        self._counts = self._items(int, but=LEAST)
        self._floats = self._items(float)
        self._signed = [
            (place, LEAST[name]) for place, name in enumerate(self.names, start=1) if name in LEAST
        ]
        self.texts = [place for place, kind in enumerate(self.types) if kind is str]
        self.layout = _Layout(self.names, self.types) if set(self.types) <= NUMBERS.keys() else None

    def _items(self, kind: type, *, but: Container[str] = ()) -> Callable[[Sequence[Any]], tuple[Any, ...]]:
        """A function that returns the items of a type from those of a frame, without the fields named in `but`."""
        places = [
            place
            for place, name in enumerate(self.names, start=1)
            if self.types[place] is kind and name not in but
        ]
        first, *_ = places or [0]
        # an itemgetter of one place returns no tuple, so the kind, a small whole number, is added as a second place
        return itemgetter(*places, *[first] * (2 - len(places)))

    def admits(self, items: Sequence[Any]) -> bool:
        """Whether items of the right types have values that a message may have."""
        if min(self._counts(items)) < 0 or max(self._numbers(items)) > MOST:
            return False
        for place, least in self._signed:
            if items[place] < least:
                return False
        for place in self.texts:
            if not is_text(items[place]):
                return False
        return isfinite(sum(self._floats(items)))


def is_text(text: str) -> bool:
    """Whether a message may hold a text: it is not too long and all its characters are printable."""
    return len(text) <= MOST_TEXT and text.isprintable()


def as_text(text: str) -> str:
    """A text that a message may hold: clipped, with a space in place of each character that is not printable."""
    return text if is_text(text) else "".join(c if c.isprintable() else " " for c in text[:MOST_TEXT])


# `msgpack.packb` allocates and frees a buffer of a megabyte with every call, so packers are kept. `PACKER` is used by
# the loop's thread, `REPACKER` by the link's threads, which hold the interpreter's lock while they pack.
PACKER = msgpack.Packer()
REPACKER = msgpack.Packer()


def shapes(message: type[Any]) -> list[_Shape]:
    """The shapes that a message can have: one, or one per number of channels where its last field is a tuple."""
    several = get_origin(get_type_hints(message)[message._fields[-1]]) is tuple
    return [_Shape(message, count) for count in range(1, MOST_CHANNELS + 1)] if several else [_Shape(message)]


SHAPES = tuple(map(shapes, MESSAGES))
LAYOUTS = {
    bytes((ARRAY + len(shape.types), kind)): (shape, shape.layout)
    for kind, several in enumerate(SHAPES)
    for shape in several
    if shape.layout is not None
}  # by the first two bytes


class Key(Protocol):
    """A keyed hash without any input so far."""

    def copy(self) -> Key:
        """A copy of the hash in its present state."""

    def update(self, data: bytes, /) -> None:
        """Add bytes to the input."""

    def digest(self) -> bytes:
        """The check of the input."""


def session_key(session: int, plan_digest: str) -> Key:
    """The key of the check within a session; session 0, before one is agreed, has a key that all processes share."""
    text = f"{session}:{plan_digest}" if session else "unregistered"
    secret = hashlib.blake2b(text.encode(), digest_size=32).digest()
    return hashlib.blake2b(digest_size=CHECK_SIZE, key=secret)


def _check(key: Key, payload: bytes) -> bytes:
    keyed = key.copy()
    keyed.update(payload)
    return keyed.digest()


def encode(message: Message, key: Key) -> bytes:
    """The frame of a message."""
    kind = KINDS[type(message)]
    several, numbers = SHAPES[kind], cast(tuple[Any, ...], message)
    if len(several) > 1:
        shape, numbers = several[len(numbers[-1]) - 1], (*numbers[:-1], *numbers[-1])
    else:
        shape = several[0]
    layout = shape.layout
    payload: bytes = layout.pack(kind, numbers) if layout else PACKER.pack((kind, *numbers))
    return payload + _check(key, payload)


def fit(message: Message) -> Message:
    """A message whose texts a frame may hold: an error message of a rig may be too long or have several lines."""
    texts = SHAPES[KINDS[type(message)]][0].texts
    fields: list[Any] = list(message)
    if all(is_text(fields[place - 1]) for place in texts):
        return message
    for place in texts:
        fields[place - 1] = as_text(fields[place - 1])
    fitting: Message = type(message)(*fields)
    return fitting


def decode(frame: bytes, key: Key, *, allowed: Container[type] = KINDS, largest: int = MOST_FRAME) -> Message:
    """The message of a frame; raises RejectedFrame with the reason if it is not valid.

    `allowed` holds the message types that may come on this route, and `largest` is the largest size in bytes. Each
    message has exactly one valid frame: a frame that is packed in another way than by `encode` is rejected.
    """
    if not CHECK_SIZE < len(frame) <= largest:
        raise RejectedFrame(Reject.LENGTH)
    payload = frame[:-CHECK_SIZE]
    if _check(key, payload) != frame[-CHECK_SIZE:]:
        raise RejectedFrame(Reject.CHECK)
    shape, layout = LAYOUTS.get(payload[:2], NO_LAYOUT)
    if layout and shape and len(payload) == layout.size and payload[2::9] == layout.marks:
        items: Sequence[Any] = layout.read(payload)
        if shape.message not in allowed:
            raise RejectedFrame(Reject.KIND_NOT_ALLOWED)
        if not layout.admits(*items):
            raise RejectedFrame(Reject.VALUE)
    else:
        shape, items = _unpacked(payload, allowed)
    if shape.channels:
        items = (*items[: -shape.channels], items[-shape.channels :])
    message: Message = tuple.__new__(shape.message, items[1:])
    return message


NO_LAYOUT: tuple[_Shape | None, _Layout | None] = (None, None)


def _unpacked(payload: bytes, allowed: Container[type]) -> tuple[_Shape, list[Any]]:
    """Shape and items of a payload without a fixed layout; raises RejectedFrame where it is not a message."""
    try:
        items = msgpack.unpackb(payload)
    except (ValueError, msgpack.UnpackException):
        raise RejectedFrame(Reject.FORMAT) from None
    if type(items) is not list or not items:
        raise RejectedFrame(Reject.FORMAT)
    shape = _shape(items, allowed)
    if shape.layout or REPACKER.pack(items) != payload:
        raise RejectedFrame(Reject.FORMAT)
    return shape, items


def _shape(items: list[Any], allowed: Container[type]) -> _Shape:
    """The shape that the items of a frame have; raises RejectedFrame where they have none."""
    kind = items[0]
    if type(kind) is not int or not 0 <= kind < len(MESSAGES):
        raise RejectedFrame(Reject.KIND)
    if MESSAGES[kind] not in allowed:
        raise RejectedFrame(Reject.KIND_NOT_ALLOWED)
    shape = next((one for one in SHAPES[kind] if len(items) == len(one.types)), None)
    if shape is None:
        raise RejectedFrame(Reject.FIELDS)
    if tuple(map(type, items)) != shape.types:
        raise RejectedFrame(Reject.TYPE)
    if not shape.admits(items):
        raise RejectedFrame(Reject.VALUE)
    return shape
