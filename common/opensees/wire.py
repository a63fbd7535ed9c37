"""The messages of OpenSees' `genericClient` and `actuator` elements and of OpenFresco's `GenericTCP` control as bytes.

Whoever connects sends one header of eleven 32-bit integers: how many displacements, velocities, accelerations, forces
and times it commands, how many it acquires, and how many 64-bit numbers every later message has, both ways. A message
to a server begins with a code, behind which the commanded values stand; an answer holds values alone. Nothing on the
wire says the order of bytes: it is the machine's own, and a header that makes no sense is refused.

Source: OpenSees, `SRC/element/generic/GenericClient.cpp` and `SRC/actor/channel/TCP_Socket.cpp`; OpenFresco,
`SRC/experimentalControl/ECGenericTCP.cpp`.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from common.errors import RemoteProtocolError

HEADER = struct.Struct("=11i")
NUMBER = 8  # bytes
# numbers of a message: a client's default is 256, and 4096 hold the matrices of 64 degrees of freedom
MOST_NUMBERS = 4096


class Code(IntEnum):
    """What a message to a server wants."""

    TRIAL = 3  # move to these displacements; not answered
    COMMIT = 5  # the step is done; not answered
    ACQUIRE = 6  # all that the header acquires
    FORCE = 10
    INITIAL_STIFFNESS = 12  # matrices, column by column
    STIFFNESS = 13
    DAMPING = 14
    MASS = 15
    END = 99  # not answered


CODES = frozenset(Code)
MATRICES = frozenset({Code.INITIAL_STIFFNESS, Code.STIFFNESS, Code.DAMPING, Code.MASS})


class Sizes(NamedTuple):
    """How many values of each quantity a message carries, in this order."""

    displacement: int = 0
    velocity: int = 0
    acceleration: int = 0
    force: int = 0
    time: int = 0


class Header(NamedTuple):
    """What a client commands and acquires, and how many numbers (`data`) every message of both sides has."""

    control: Sizes
    acquired: Sizes
    data: int

    @property
    def least(self) -> int:
        """The numbers that a message needs at least: a code with the commanded values, or those acquired."""
        return max(1 + sum(self.control), sum(self.acquired))

    @property
    def size(self) -> int:
        """Bytes of a message."""
        return NUMBER * self.data


class Quantities(NamedTuple):
    """The values of a message, quantity by quantity: m, m/s, m/s², N, s; empty where it carries none."""

    displacement: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()
    acceleration: tuple[float, ...] = ()
    force: tuple[float, ...] = ()
    time: tuple[float, ...] = ()


def element(dofs: int, data: int = 256) -> Header:
    """The header of a `genericClient` element with so many degrees of freedom."""
    control = Sizes(displacement=dofs, velocity=dofs, acceleration=dofs, time=1)
    return Header(control, Sizes(force=dofs), max(data, 3 * dofs + 2, dofs * dofs))


def header_bytes(header: Header) -> bytes:
    """A header as a client sends it."""
    return HEADER.pack(*header.control, *header.acquired, header.data)


def read_header(data: bytes) -> Header:
    """The header in the first bytes of a connection, exactly `HEADER.size` of them.

    Raises:
        RemoteProtocolError: its numbers make no sense: another program, or a machine of the other order of bytes.
    """
    numbers = HEADER.unpack(data)
    header = Header(Sizes(*numbers[:5]), Sizes(*numbers[5:10]), numbers[10])
    if min(numbers) < 0 or not header.least <= header.data <= MOST_NUMBERS:
        raise RemoteProtocolError(
            f"the first {HEADER.size} bytes are no header of OpenSees or OpenFresco ({', '.join(map(str, numbers))}): "
            "is it another program, or a machine whose order of bytes differs?"
        )
    return header


def message(header: Header, code: Code, values: Quantities | None = None) -> bytes:
    """A message to a server: a code, and behind it the values that the header commands.

    Raises:
        ValueError: there are other numbers of values than the header says.
    """
    numbers = [float(code)]
    for name, size, given in zip(Sizes._fields, header.control, values or zeros(header.control), strict=True):
        if len(given) != size:
            raise ValueError(f"{len(given)} values of {name}, but the header says {size}")
        numbers += given
    return packed(header, numbers)


def zeros(sizes: Sizes) -> Quantities:
    """Values that are all zero."""
    return Quantities(*((0.0,) * size for size in sizes))


def answer(header: Header, values: Sequence[float]) -> bytes:
    """An answer of a server: some values, the rest of the message is zero."""
    return packed(header, values)


def packed(header: Header, numbers: Sequence[float]) -> bytes:
    """Numbers as a message, filled up with zeros; raises ValueError where there are too many."""
    if len(numbers) > header.data:
        raise ValueError(f"{len(numbers)} numbers for a message of {header.data}")
    return struct.pack(f"={len(numbers)}d", *numbers).ljust(header.size, b"\0")


def numbers_in(header: Header, data: bytes, count: int, first: int = 0) -> tuple[float, ...]:
    """Some numbers of a message, from the place `first` on."""
    return struct.unpack_from(f"={count}d", data, NUMBER * first)


def code_in(data: bytes) -> Code:
    """The code of a message to a server.

    Raises:
        RemoteProtocolError: there is no such code.
    """
    (number,) = struct.unpack_from("=d", data)
    if number not in CODES:
        raise RemoteProtocolError(f"a message has the code {number:g}, which means nothing here.")
    return Code(int(number))


def commanded(header: Header, data: bytes) -> Quantities:
    """The values that a message to a server commands.

    Raises:
        RemoteProtocolError: one of them is not finite.
    """
    return quantities(header.control, numbers_in(header, data, sum(header.control), first=1))


def acquired(header: Header, data: bytes) -> Quantities:
    """The values of an answer to `Code.ACQUIRE`; raises RemoteProtocolError where one is not finite."""
    return quantities(header.acquired, numbers_in(header, data, sum(header.acquired)))


def quantities(sizes: Sizes, numbers: Sequence[float]) -> Quantities:
    """Numbers quantity by quantity; raises RemoteProtocolError where one is not finite."""
    if not math.isfinite(sum(numbers)) and not all(map(math.isfinite, numbers)):
        raise RemoteProtocolError("a message holds a value that is not finite.")
    found, place = [], 0
    for size in sizes:
        found.append(tuple(numbers[place : place + size]))
        place += size
    return Quantities(*found)
