"""The emulated laboratories as rigs that write every command with its time to a file, and that fail when told to.

The file is mapped into memory: what a process has written is there when it is killed, and a byte in its head tells the
rig from outside to read beyond its limit or to raise an emergency stop.
"""

from __future__ import annotations

import mmap
import struct
import time
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.errors import EmergencyStopError
from common.plan.plan import Plan
from common.plan.read import from_tables
from common.rig import ColumnMeasurement, TableMeasurement
from laboratories.column.kind import COLUMN
from laboratories.emulated import EmulatedLab
from laboratories.table.kind import TABLE
from models.system import System

HEAD = struct.Struct("<qq")  # what the rig shall do, commands written
ENTRY = struct.Struct("<qdd")  # monotonic time, ns; displacement, m; force, N
FAR = 1.0  # m, beyond the limit of every reading of a displacement


class Wish(IntEnum):
    """What a rig shall do."""

    SERVE = 0
    READ_FAR = 1
    EMERGENCY = 2


class Written(NamedTuple):
    """The commands that went to a rig, in order."""

    ns: NDArray[np.int64]
    displacement: NDArray[np.float64]
    force: NDArray[np.float64]


class Log:
    """A rig's file, in the rig's process and in the test's."""

    def __init__(self, path: Path, entries: int = 0) -> None:
        if entries:
            path.write_bytes(bytes(HEAD.size + entries * ENTRY.size))
        with path.open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), 0)
        self._count = 0

    @property
    def wish(self) -> int:
        """What the rig shall do."""
        return self._map[0]

    def want(self, wish: Wish) -> None:
        """Tell the rig from outside."""
        self._map[0] = wish

    def add(self, displacement: float, force: float) -> None:
        """Write one command."""
        place = HEAD.size + self._count * ENTRY.size
        ENTRY.pack_into(self._map, place, time.monotonic_ns(), displacement, force)
        self._count += 1
        struct.pack_into("<q", self._map, 8, self._count)

    def written(self) -> Written:
        """All commands so far."""
        count = HEAD.unpack_from(self._map)[1]
        kind = np.dtype([("ns", "<i8"), ("displacement", "<f8"), ("force", "<f8")])
        table = np.frombuffer(self._map[HEAD.size : HEAD.size + count * ENTRY.size], kind)
        return Written(table["ns"], table["displacement"], table["force"])


def ticking(interval: float) -> Plan:
    """The default plan, whose laboratories advance by this interval (s) with each command."""
    return from_tables({"test": {"interval": interval}}, Path())


class Column(EmulatedLab):
    """Laboratory A with a log."""

    def __init__(self, interval: float, seed: int, log: str) -> None:
        super().__init__(COLUMN, System(ticking(interval)), seed)
        self._log = Log(Path(log))

    def read(self) -> ColumnMeasurement:
        """Readings, or what is wished."""
        found = ColumnMeasurement(*super().read())
        if self._log.wish == Wish.EMERGENCY:
            raise EmergencyStopError("the red button of laboratory A.")
        if self._log.wish == Wish.READ_FAR:
            return found._replace(column_displacement=FAR)
        return found

    def write(self, command: tuple[float, ...]) -> None:
        """Move, and keep the command."""
        self._log.add(command[0], 0.0)
        super().write(command)


class Table(EmulatedLab):
    """Laboratory B with a log."""

    def __init__(self, interval: float, seed: int, log: str) -> None:
        super().__init__(TABLE, System(ticking(interval)), seed)
        self._log = Log(Path(log))

    def read(self) -> TableMeasurement:
        """Readings, or what is wished."""
        found = TableMeasurement(*super().read())
        if self._log.wish == Wish.EMERGENCY:
            raise EmergencyStopError("the red button of laboratory B.")
        if self._log.wish == Wish.READ_FAR:
            return found._replace(table_displacement=FAR)
        return found

    def write(self, command: tuple[float, ...]) -> None:
        """Move, and keep the command."""
        self._log.add(*command)
        super().write(command)
