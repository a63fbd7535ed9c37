"""Messages to bytes and back: msgpack arrays of fixed fields behind a keyed 64-bit check.

A frame is `msgpack([kind, field, …]) + check`. What does not have exactly the fields, types and ranges
of a known message, or whose check fails, is rejected with a reason and reaches nobody.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from enum import Enum
from math import isfinite
from operator import itemgetter
from typing import Any, Protocol, get_args, get_type_hints

import msgpack

from common.messages import Message

CHECK_SIZE = 8
MOST = 2**62  # of a whole number; in ns a century and a half, either way
MOST_BYTES = 1_000_000

MESSAGES: tuple[type[Any], ...] = get_args(Message)
KINDS = {message: kind for kind, message in enumerate(MESSAGES)}


class Reject(Enum):
    """Why a frame was rejected."""

    LENGTH = "length"
    CHECK = "check"
    FORMAT = "format"
    KIND = "kind"
    FIELDS = "fields"
    VALUE = "value"


class RejectedFrame(ValueError):  # noqa: N818 - it is a finding about a frame, counted rather than shown
    """A frame that is no valid message."""

    def __init__(self, reason: Reject) -> None:
        super().__init__(reason.value)
        self.reason = reason


class _Shape:
    """What the items of one frame must be: exact types, whole numbers and times in range, floats finite.

    The first item is the kind of the message. Checks are calls into C wherever they can be: they run twice a tick.
    """

    def __init__(self, message: type[Any]) -> None:
        hints = get_type_hints(message)
        self.message = message
        self.types = (int, *(hints[name] for name in message._fields))
        self._numbers = self._items(message, int)
        self._counts = self._items(message, int, but="_ns")
        self._floats = self._items(message, float)
        self._texts = [place for place, kind in enumerate(self.types) if kind in (str, bytes)]

    def _items(
        self, message: type[Any], kind: type, *, but: str = " "
    ) -> Callable[[list[Any]], tuple[Any, ...]]:
        """What takes the items of a type out of a frame's, but for those whose names end so."""
        places = [
            place
            for place, name in enumerate(message._fields, start=1)
            if self.types[place] is kind and not name.endswith(but)
        ]
        first, *_ = places or [0]
        # the getter of a single place gives no tuple; the kind, a small count, is a harmless second
        return itemgetter(*places, *[first] * (2 - len(places)))

    def admits(self, items: list[Any]) -> bool:
        """Whether items of the right types have values that a message may have."""
        numbers = self._numbers(items)
        if min(self._counts(items)) < -1 or min(numbers) < -MOST or max(numbers) > MOST:
            return False
        if self._texts and any(len(items[place]) > MOST_BYTES for place in self._texts):
            return False
        return isfinite(sum(self._floats(items)))


# `msgpack.packb` allocates and frees a buffer of a megabyte with every call; this one is the loop's thread's alone
PACKER = msgpack.Packer()

SHAPES = tuple(_Shape(message) for message in MESSAGES)


class Key(Protocol):
    """A keyed hash that has taken nothing in yet."""

    def copy(self) -> Key:
        """Another one like it."""

    def update(self, data: bytes, /) -> None:
        """Take in some bytes."""

    def digest(self) -> bytes:
        """The check of what was taken in."""


def session_key(session: int, plan_digest: str) -> Key:
    """Key of the check within a session; before one is agreed, session 0 gives a key that all share."""
    text = f"{session}:{plan_digest}" if session else "unregistered"
    secret = hashlib.blake2b(text.encode(), digest_size=32).digest()
    return hashlib.blake2b(digest_size=CHECK_SIZE, key=secret)


def _check(key: Key, payload: bytes) -> bytes:
    keyed = key.copy()
    keyed.update(payload)
    return keyed.digest()


def encode(message: Message, key: Key) -> bytes:
    """The frame of a message."""
    payload: bytes = PACKER.pack((KINDS[type(message)], *message))
    return payload + _check(key, payload)


def decode(frame: bytes, key: Key) -> Message:
    """The message of a frame; raises RejectedFrame with the reason where it is none."""
    payload = frame[:-CHECK_SIZE]
    if _check(key, payload) != frame[-CHECK_SIZE:] or not payload:
        raise RejectedFrame(Reject.CHECK if payload else Reject.LENGTH)
    try:
        items = msgpack.unpackb(payload)
    except (ValueError, msgpack.UnpackException):
        raise RejectedFrame(Reject.FORMAT) from None
    if type(items) is not list or not items:
        raise RejectedFrame(Reject.FORMAT)
    kind = items[0]
    if type(kind) is not int or not 0 <= kind < len(MESSAGES):
        raise RejectedFrame(Reject.KIND)
    shape = SHAPES[kind]
    if len(items) != len(shape.types):
        raise RejectedFrame(Reject.FIELDS)
    if tuple(map(type, items)) != shape.types or not shape.admits(items):
        raise RejectedFrame(Reject.VALUE)
    message: Message = tuple.__new__(shape.message, items[1:])
    return message
