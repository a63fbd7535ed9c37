"""Messages to bytes and back: msgpack arrays of fixed fields behind a keyed 64-bit check.

A frame is `msgpack([kind, field, …]) + check`. What does not have exactly the fields, types and ranges
of a known message, or whose check fails, is rejected with a reason and reaches nobody.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from enum import Enum
from typing import Any, get_args, get_type_hints

import msgpack

from common.messages import Message

CHECK_SIZE = 8
MOST_TEXT = 2_000
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


def _whole(value: object) -> bool:
    return type(value) is int and -1 <= value < 2**63


def _signed(value: object) -> bool:
    return type(value) is int and -(2**62) < value < 2**62


def _finite(value: object) -> bool:
    return type(value) is float and math.isfinite(value)


def _text(value: object) -> bool:
    return type(value) is str and len(value) <= MOST_TEXT


def _bytes(value: object) -> bool:
    return type(value) is bytes and len(value) <= MOST_BYTES


def _checks(message: type[Any]) -> tuple[Callable[[object], bool], ...]:
    by_type = {int: _whole, float: _finite, str: _text, bytes: _bytes}
    hints = get_type_hints(message)
    return tuple(_signed if name.endswith("_ns") else by_type[hints[name]] for name in message._fields)


CHECKS = tuple(_checks(message) for message in MESSAGES)


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
    checks = CHECKS[kind]
    if len(fields) != len(checks):
        raise RejectedFrame(Reject.FIELDS)
    for check, field in zip(checks, fields, strict=True):
        if not check(field):
            raise RejectedFrame(Reject.VALUE)
    message: Message = MESSAGES[kind](*fields)
    return message
