"""The two packets between a laboratory and a rig in another process: their layout, checks and meaning.

Both have 128 bytes of fixed layout in little-endian order, so that a Simulink model, a LabVIEW program or a few lines
of C can read them. The tables of bytes in docs/reference/udp-rig.md are generated from `REQUEST` and `ANSWER`.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from common.signals import Channels

VERSION = 1
SIZE = 128  # bytes of a packet, either way
VALUES = 8  # numbers in a packet; the kinds of rths have at most six channels
TEXT = 36  # bytes of a rig's text: those that are left of 128
TO_RIG, FROM_RIG = b"RTHR", b"RTHA"
CHECKED = SIZE - 4  # bytes before the checksum


class Field(NamedTuple):
    """One field of a packet."""

    name: str
    form: str  # of `struct`
    kind: str  # for the documentation
    text: str


REQUEST = (
    Field("magic", "4s", "4 bytes", 'the letters "RTHR"'),
    Field("version", "H", "uint16", "1"),
    Field("kind", "H", "uint16", "what is asked: 1 echo, 2 arm, 3 command, 4 disarm"),
    Field("session", "I", "uint32", "number of this test, drawn anew for each; an answer repeats it"),
    Field("seq", "I", "uint32", "number of this packet, which rises by one; an answer repeats it"),
    Field("interval", "d", "float64", "control interval, s"),
    Field(
        "silence",
        "d",
        "float64",
        "time without a packet after which the rig stops on its own once it moves, s",
    ),
    Field("seed", "Q", "uint64", "seed of the test's noise, for a rig that is emulated"),
    Field("mode", "H", "uint16", "the laboratory's safety mode, by its number"),
    Field("count", "H", "uint16", "numbers that are used in values: the commands"),
    Field("channels", "I", "uint32", "number that stands for the names and units of all channels"),
    Field("values", f"{VALUES}d", f"{VALUES} × float64", "the commands in their order; the rest is zero"),
    Field("reserved", "12s", "12 bytes", "zero"),
    Field("checksum", "I", "uint32", f"CRC-32 of the {CHECKED} bytes before it"),
)
"""The packet from a laboratory to its rig."""

ANSWER = (
    Field("magic", "4s", "4 bytes", 'the letters "RTHA"'),
    Field("version", "H", "uint16", "1"),
    Field("kind", "H", "uint16", "kind of the packet that is answered"),
    Field("session", "I", "uint32", "session of the packet that is answered"),
    Field("seq", "I", "uint32", "number of the packet that is answered"),
    Field("channels", "I", "uint32", "the rig's own number of its channels; 0: not compared"),
    Field("state", "H", "uint16", "state of the rig, by its number"),
    Field("count", "H", "uint16", "numbers that are used in values; 0: nothing is measured"),
    Field("values", f"{VALUES}d", f"{VALUES} × float64", "what is measured, in the channels' order"),
    Field(
        "text", f"{TEXT}s", f"{TEXT} bytes", "why the rig is not ready or has stopped, UTF-8, zeros behind"
    ),
    Field("checksum", "I", "uint32", f"CRC-32 of the {CHECKED} bytes before it"),
)
"""The packet from a rig to its laboratory."""


def layout(fields: Sequence[Field]) -> struct.Struct:
    """The binary layout of a packet."""
    return struct.Struct("<" + "".join(field.form for field in fields))


_REQUEST, _ANSWER = layout(REQUEST), layout(ANSWER)
_HEAD = struct.Struct("<4sH")


class Asked(IntEnum):
    """The kinds of packets to a rig."""

    ECHO = 1  # answer without moving
    ARM = 2  # prepare to move
    COMMAND = 3  # follow the commands over the coming interval
    DISARM = 4  # stop safely


class RigState(IntEnum):
    """The state that a rig reports."""

    IDLE = 0  # not armed
    PREPARING = 1  # about to be ready
    READY = 2  # armed, nothing moves
    RUNNING = 3  # following commands
    STOPPED = 4  # stopped on its own: a fault, or no packet for too long
    EMERGENCY = 5  # its emergency stop was pressed


STATES = {
    RigState.IDLE: "not armed",
    RigState.PREPARING: "about to be ready, ask again",
    RigState.READY: "armed, nothing moves",
    RigState.RUNNING: "following the commands",
    RigState.STOPPED: "stopped on its own: a fault, or no packet for longer than `silence`",
    RigState.EMERGENCY: "its emergency stop was pressed",
}


class Request(NamedTuple):
    """The content of a packet to a rig."""

    kind: Asked
    session: int
    seq: int
    interval: float  # s
    silence: float  # s
    seed: int
    mode: int
    channels: int
    values: Sequence[float] = ()


class RigAnswer(NamedTuple):
    """The content of a packet from a rig."""

    kind: int
    session: int
    seq: int
    channels: int
    state: int
    values: tuple[float, ...]
    text: str


def number(channels: Channels) -> int:
    """The number of channels: CRC-32 of 'name unit' of commands and measurements, joined by ';', in UTF-8."""
    driving = (channels.command, *([channels.effort] if channels.effort else []))
    words = ";".join(f"{row.name} {row.unit}" for row in (*driving, *channels.measured))
    return zlib.crc32(words.encode())


def pack(request: Request) -> bytes:
    """Encode a packet to a rig."""
    head = request[:8]
    padded = (*request.values, *[0.0] * (VALUES - len(request.values)))
    body = _REQUEST.pack(
        TO_RIG, VERSION, *head[:7], len(request.values), request.channels, *padded, bytes(12), 0
    )
    return body[:CHECKED] + zlib.crc32(body[:CHECKED]).to_bytes(4, "little")


def fault(packet: bytes) -> str:
    """The fault of a packet from a rig: 'damaged', or 'version' for another layout; empty if it is valid."""
    if len(packet) != SIZE or zlib.crc32(packet[:CHECKED]) != int.from_bytes(packet[CHECKED:], "little"):
        return "damaged"
    magic, version = _HEAD.unpack_from(packet)
    if magic != FROM_RIG:
        return "damaged"
    return "" if version == VERSION else "version"


def unpack(packet: bytes) -> RigAnswer:
    """Decode a packet without a fault."""
    _, _, kind, session, seq, channels, state, count, *rest = _ANSWER.unpack(packet)
    values, (text, _) = rest[:VALUES], rest[VALUES:]
    said = text.partition(b"\0")[0].decode(errors="replace")
    clean = "".join(letter if letter.isprintable() else " " for letter in said)
    return RigAnswer(kind, session, seq, channels, state, tuple(values[: min(count, VALUES)]), clean.strip())
