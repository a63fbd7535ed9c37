"""Checks whether a disk has room for a recording, whose size is estimated from the table of signals."""

from __future__ import annotations

import shutil
from pathlib import Path

from common import signals
from common.lab.preflight import PreflightCheck
from common.plan.plan import Plan
from common.roles import kind_of
from common.safety.risks import Risk
from common.signals import FieldType, Signal
from laboratories import kinds

# bytes of a protobuf field: its value, with a stamp's at seven bytes of seven bits, and of flags and texts none
VALUES = {
    FieldType.NUMBER: 8,
    FieldType.STOREYS: 8,
    FieldType.COUNT: 2,
    FieldType.INDEX: 2,
    FieldType.STAMP: 7,
    FieldType.FLAG: -1,
}
ONE_BYTE_TAGS = 15  # fields up to this number
MESSAGE_HEAD = 31  # bytes before a message in a chunk
INDEX_ENTRY = 16  # bytes of the chunk's index for a message
COMPRESSED = (
    0.7  # compressed size over size of a chunk of noisy measurements with zstd; constant ones take less
)
GROUND_ROWS = 2 * 8  # bytes of the ground motion per tick
FIXED = 50_000  # bytes of plan, schemas and host, rounded up
SPARE = 1.1  # a tenth more for events and the index, whose size depends on the test


def need(plan: Plan) -> float:
    """Expected size of a test's recording, bytes."""
    per_tick = sum(
        COMPRESSED * (MESSAGE_HEAD + payload(rows, plan.storeys)) + INDEX_ENTRY
        for topic, rows in kinds.topics(plan).items()
        if kind_of(topic) in signals.TICK_TOPICS
    )
    return FIXED + SPARE * plan.ticks * (per_tick + GROUND_ROWS)


def payload(rows: tuple[Signal, ...], storeys: int) -> int:
    """Bytes of a message."""
    return sum(field(number, row, storeys) for number, row in enumerate(rows, start=1))


def field(number: int, row: Signal, storeys: int) -> int:
    """Bytes of one field of a message; several values follow one tag and their length."""
    tag = 1 if number <= ONE_BYTE_TAGS else 2
    count = row.count(storeys)
    value = VALUES.get(row.kind, 0)
    return max(tag + value, 0) if count == 1 else tag + 1 + (count * value >= 128) + count * value


def check(plan: Plan, folder: Path) -> PreflightCheck:
    """The check whether a folder has room for the recording of a test."""
    wanted = plan.preflight.disk_factor * need(plan)
    try:
        disk = shutil.disk_usage(folder)
    except OSError as error:
        return PreflightCheck(
            "", Risk("disk", f"the free space of the folder {folder} is unknown: {error.strerror}")
        )
    if (
        disk.free >= wanted or not disk.total
    ):  # a file system without a size is no disk, and writing there will fail
        return PreflightCheck(
            f"The disk has {disk.free / 1e6:.0f} MB free; the recording takes {need(plan) / 1e6:.1f} MB"
        )
    return PreflightCheck(
        "",
        Risk(
            "disk",
            f"the folder {folder} has {disk.free / 1e6:.1f} MB free, and the recording needs {wanted / 1e6:.1f} MB "
            f"({plan.preflight.disk_factor:g} times its expected {need(plan) / 1e6:.1f} MB), so free disk space, "
            "give another place with -o, or lower disk_factor in [preflight]",
        ),
    )
