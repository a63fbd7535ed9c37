"""Items of a laboratory's stream: a topic, and its values as one row of bytes.

A plain topic, which holds numbers only, has a fixed layout: the laboratory packs it once, and the recorder's kernels
read it. Rows of any other topic, such as events, are msgpack.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import msgpack

from common.signals import FieldType, Signal

Item = tuple[str, bytes]  # topic and row

STAMPS = 16  # bytes of log and publish time at the beginning of a plain row
HEAD = struct.Struct("<qqI")  # log and publish time in ns, and the tick
LETTERS: Mapping[FieldType, str] = {
    FieldType.NUMBER: "d",
    FieldType.STOREYS: "d",
    FieldType.COUNT: "I",
    FieldType.INDEX: "i",
    FieldType.STAMP: "q",
    FieldType.FLAG: "?",
}  # struct's letters for the types of signals


def is_plain(rows: Sequence[Signal]) -> bool:
    """Whether a topic is plain: it holds numbers only, the tick first."""
    return rows[0].kind is FieldType.COUNT and all(row.kind in LETTERS for row in rows)


def layout(rows: Sequence[Signal], storeys: int) -> struct.Struct:
    """The layout of a plain topic's row: log and publish time, and all numbers in the order of the signal table."""
    return struct.Struct("<qq" + "".join(LETTERS[row.kind] * row.count(storeys) for row in rows))


def layouts(topics: Mapping[str, Sequence[Signal]], storeys: int) -> dict[str, struct.Struct]:
    """The layouts of the plain ones among topics, by topic."""
    return {topic: layout(rows, storeys) for topic, rows in topics.items() if is_plain(rows)}


class RowPacker:
    """Packs values into items; `storeys` is the building's number of storeys."""

    def __init__(self, topics: Mapping[str, Sequence[Signal]], storeys: int) -> None:
        # by plain topic: the row of log time, publish time and all its numbers
        self.rows: dict[str, Callable[..., bytes]] = {
            topic: found.pack for topic, found in layouts(topics, storeys).items()
        }

    def item(self, topic: str, log_ns: int, publish_ns: int, values: Iterable[Any]) -> Item:
        """An item; for a plain topic `values` are all its numbers, those of storeys one by one."""
        row = self.rows.get(topic)
        if row is None:
            return other(topic, (log_ns, publish_ns, *values))
        return topic, row(log_ns, publish_ns, *values)


def other(topic: str, values: tuple[Any, ...]) -> Item:
    """An item of a topic that is not plain; `values` are log time, publish time (ns) and those of its signals."""
    return topic, msgpack.packb(values)


def values_of(row: bytes) -> list[Any]:
    """Log time, publish time and values of a row that is not plain, as a list.

    Raises:
        ValueError, msgpack.UnpackException: it is not msgpack.
    """
    found: list[Any] = msgpack.unpackb(row)
    return found


def named_values(signals: Sequence[Signal], row: bytes) -> dict[str, Any]:
    """The values of a row that is not plain by the names of its topic's `signals`; raises as `values_of`."""
    _, _, *values = values_of(row)
    return dict(zip((one.name for one in signals), values, strict=True))
