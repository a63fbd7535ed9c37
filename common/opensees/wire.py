"""The messages of OpenSees' `genericClient` and `actuator` elements and of OpenFresco's `GenericTCP` control as bytes.

The client sends one header of eleven 32-bit integers: how many displacements, velocities, accelerations, forces and
times it commands, how many of each it acquires, and how many 64-bit numbers every later message has in both directions.
A message to a server begins with a code, followed by the commanded values; an answer holds values only. The messages do
not state the byte order: it is that of the machine, and a header without a valid meaning is refused.

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


class MessageCode(IntEnum):
    """The codes of messages to a server."""

    TRIAL = 3  # move to these displacements; not answered
    COMMIT = 5  # the step is complete; not answered
    ACQUIRE = 6  # request all quantities that the header acquires
    FORCE = 10
    INITIAL_STIFFNESS = 12  # matrices, column by column
    STIFFNESS = 13
    DAMPING = 14
    MASS = 15
    END = 99  # not answered


CODES = {float(code): code for code in MessageCode}
FIRST = struct.Struct("=d")
MATRICES = frozenset(
    {MessageCode.INITIAL_STIFFNESS, MessageCode.STIFFNESS, MessageCode.DAMPING, MessageCode.MASS}
)


class Sizes(NamedTuple):
    """The number of values of each quantity in a message, in this order."""

    displacement: int = 0
    velocity: int = 0
    acceleration: int = 0
    force: int = 0
    time: int = 0


class ClientHeader(NamedTuple):
    """The quantities that a client commands and acquires, and the length (`data`) of all messages in numbers."""

    control: Sizes
    acquired: Sizes
    data: int

    @property
    def least(self) -> int:
        """The least length of a message: the code and the commanded values, or the acquired values."""
        return max(1 + sum(self.control), sum(self.acquired))

    @property
    def size(self) -> int:
        """Bytes of a message."""
        return NUMBER * self.data


class Quantities(NamedTuple):
    """The values of a message by quantity, in m, m/s, m/s², N and s; empty for a quantity that it does not hold."""

    displacement: tuple[float, ...] = ()
    velocity: tuple[float, ...] = ()
    acceleration: tuple[float, ...] = ()
    force: tuple[float, ...] = ()
    time: tuple[float, ...] = ()


def element(dofs: int, data: int = 256) -> ClientHeader:
    """The header of a `genericClient` element with `dofs` degrees of freedom."""
    control = Sizes(displacement=dofs, velocity=dofs, acceleration=dofs, time=1)
    return ClientHeader(control, Sizes(force=dofs), max(data, 3 * dofs + 2, dofs * dofs))


def header_bytes(header: ClientHeader) -> bytes:
    """A header as a client sends it."""
    return HEADER.pack(*header.control, *header.acquired, header.data)


def read_header(data: bytes) -> ClientHeader:
    """The header in the first bytes of a connection, exactly `HEADER.size` of them.

    Raises:
        RemoteProtocolError: its numbers are not valid: it is of another program, or of a machine with the other
            byte order.
    """
    numbers = HEADER.unpack(data)
    header = ClientHeader(Sizes(*numbers[:5]), Sizes(*numbers[5:10]), numbers[10])
    if min(numbers) < 0 or not header.least <= header.data <= MOST_NUMBERS:
        raise RemoteProtocolError(
            f"the first {HEADER.size} bytes are no header of OpenSees or OpenFresco ({', '.join(map(str, numbers))}): "
            "is it another program, or a machine whose order of bytes differs?"
        )
    return header


def message(header: ClientHeader, code: MessageCode, values: Quantities | None = None) -> bytes:
    """A message to a server: a code, followed by the values that the header commands.

    Raises:
        ValueError: the numbers of values are not those of the header.
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


def answer(header: ClientHeader, values: Sequence[float]) -> bytes:
    """An answer of a server: the values, padded with zeros."""
    return packed(header, values)


def packed(header: ClientHeader, numbers: Sequence[float]) -> bytes:
    """Encode numbers as a message padded with zeros; raises ValueError if there are too many."""
    if len(numbers) > header.data:
        raise ValueError(f"{len(numbers)} numbers for a message of {header.data}")
    return struct.pack(f"={len(numbers)}d", *numbers).ljust(header.size, b"\0")


def numbers_in(header: ClientHeader, data: bytes, count: int, first: int = 0) -> tuple[float, ...]:
    """`count` numbers of a message, from the index `first` on."""
    return struct.unpack_from(f"={count}d", data, NUMBER * first)


def code_in(data: bytes) -> MessageCode:
    """The code of a message to a server.

    Raises:
        RemoteProtocolError: there is no such code.
    """
    (number,) = FIRST.unpack_from(data)
    code = CODES.get(number)
    if code is None:
        raise RemoteProtocolError(f"a message has the code {number:g}, which means nothing here.")
    return code


def commanded(header: ClientHeader, data: bytes) -> Quantities:
    """The values that a message to a server commands.

    Raises:
        RemoteProtocolError: one of them is not finite.
    """
    return quantities(header.control, numbers_in(header, data, sum(header.control), first=1))


def acquired(header: ClientHeader, data: bytes) -> Quantities:
    """The values of an answer to `MessageCode.ACQUIRE`; raises RemoteProtocolError if one is not finite."""
    return quantities(header.acquired, numbers_in(header, data, sum(header.acquired)))


def quantities(sizes: Sizes, numbers: Sequence[float]) -> Quantities:
    """Divide numbers into quantities; raises RemoteProtocolError if one is not finite."""
    if not math.isfinite(sum(numbers)) and not all(map(math.isfinite, numbers)):
        raise RemoteProtocolError("a message holds a value that is not finite.")
    found, place = [], 0
    for size in sizes:
        found.append(tuple(numbers[place : place + size]))
        place += size
    return Quantities(*found)
