"""Messages to bytes and back: msgpack arrays of fixed fields behind a keyed 64-bit check.

A frame is `msgpack([kind, field, …]) + check`. What does not have exactly the fields, types and ranges
of a known message, or whose check fails, is rejected with a reason and reaches nobody.
"""

from __future__ import annotations

import hashlib
from enum import Enum
from math import isfinite
from typing import Any, get_args, get_type_hints

import msgpack

from common.messages import Message

CHECK_SIZE = 8
MOST_COUNT = 2**63
MOST_TIME = 2**62  # ns, a century and a half
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
    """What the fields of one message must be: exact types, whole numbers and times in range, floats finite."""

    def __init__(self, message: type[Any]) -> None:
        hints = get_type_hints(message)
        self.message = message
        self.types = tuple(hints[name] for name in message._fields)
        self._times = self._places(message, int, times=True)
        self._counts = self._places(message, int, times=False)
        self._floats = self._places(message, float, times=False)
        self._texts = self._places(message, str, times=False) + self._places(message, bytes, times=False)

    def _places(self, message: type[Any], kind: type, *, times: bool) -> tuple[int, ...]:
        names = enumerate(message._fields)
        return tuple(
            place for place, name in names if self.types[place] is kind and name.endswith("_ns") is times
        )

    def admits(self, fields: list[Any]) -> bool:
        """Whether fields of the right types have values that a message may have."""
        total = 0.0
        for place in self._floats:
            total += fields[place]
        for place in self._counts:
            if not -1 <= fields[place] < MOST_COUNT:
                return False
        for place in self._times:
            if not -MOST_TIME < fields[place] < MOST_TIME:
                return False
        for place in self._texts:
            if len(fields[place]) > MOST_BYTES:
                return False
        return isfinite(total)


SHAPES = tuple(_Shape(message) for message in MESSAGES)


def session_key(session: int, plan_digest: str) -> bytes:
    """Key of the check within a session; before one is agreed, session 0 gives a key that all share."""
    text = f"{session}:{plan_digest}" if session else "unregistered"
    return hashlib.blake2b(text.encode(), digest_size=32).digest()


def _check(key: bytes, payload: bytes) -> bytes:
    return hashlib.blake2b(payload, digest_size=CHECK_SIZE, key=key).digest()


def encode(message: Message, key: bytes) -> bytes:
    """The frame of a message."""
    payload: bytes = msgpack.packb((KINDS[type(message)], *message))
    return payload + _check(key, payload)


def decode(frame: bytes, key: bytes) -> Message:
    """The message of a frame; raises RejectedFrame with the reason where it is none."""
    if len(frame) <= CHECK_SIZE:
        raise RejectedFrame(Reject.LENGTH)
    payload = frame[:-CHECK_SIZE]
    if _check(key, payload) != frame[-CHECK_SIZE:]:
        raise RejectedFrame(Reject.CHECK)
    try:
        content = msgpack.unpackb(payload)
    except (ValueError, msgpack.UnpackException):
        raise RejectedFrame(Reject.FORMAT) from None
    if type(content) is not list or not content:
        raise RejectedFrame(Reject.FORMAT)
    kind, *fields = content
    if type(kind) is not int or not 0 <= kind < len(MESSAGES):
        raise RejectedFrame(Reject.KIND)
    shape = SHAPES[kind]
    if len(fields) != len(shape.types):
        raise RejectedFrame(Reject.FIELDS)
    if tuple(map(type, fields)) != shape.types or not shape.admits(fields):
        raise RejectedFrame(Reject.VALUE)
    message: Message = shape.message(*fields)
    return message
