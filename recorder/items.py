"""Checks which items of a laboratory's stream may be recorded: topics of its own, with values of the signals' types."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import msgpack

from common.lab.outlet import PIECE, pairs
from common.plan.plan import Plan
from common.recording.rows import Item, values_of
from common.roles import MASTER, latency_topic, ramp_topic
from common.signals import FieldType, Signal
from laboratories import kinds
from recorder.encoding import RowTable

Check = Callable[[Any], bool]

TUPLES, TEXTS, BYTES, PAIRS = {tuple}, {str}, {bytes}, {2}  # types of items and their parts; parts of an item
STAMPS = range(2**63)  # log and publish time, ns
INTEGERS = {
    FieldType.COUNT: range(2**32),
    FieldType.INDEX: range(-(2**31), 2**31),
    FieldType.STAMP: range(-(2**63), 2**63),
}


class Items:
    """The items that one laboratory of a plan may send to the recorder."""

    def __init__(self, plan: Plan, lab: str) -> None:
        topics = kinds.topics(plan)
        own = {"event", lab, ramp_topic(lab), *(map(latency_topic, plan.roles) if lab == MASTER else ())}
        own &= topics.keys()  # a master without a laboratory has no ramp
        self.ticks = plan.ticks  # of the test; more where it is held
        self._table = RowTable({topic: topics[topic] for topic in own}, plan.storeys)
        self._others = {topic: checks(topics[topic], plan) for topic in own if topic not in self._table.sizes}
        for topic, size in list(self._table.sizes.items())[:1]:  # loads the kernel before a test begins
            self._table.sound([topic], [bytes(size)], 1)

    def unpack(self, packed: bytes) -> tuple[Item, ...] | None:
        """The items of a piece; None where it holds anything that cannot be recorded."""
        try:
            items = pairs(packed)
        except (ValueError, msgpack.UnpackException):
            return None
        if (piece := columns(items)) is None:
            return None
        topics, rows = piece
        sizes = self._table.sizes
        if not all(map(sizes.__contains__, topics)):
            others = [item for item in items if item[0] not in sizes]
            if not all(self._admits(topic, row) for topic, row in others):
                return None
            if len(others) == len(items):
                return items
            topics, rows = zip(*(item for item in items if item[0] in sizes), strict=True)
        return items if self._table.sound(topics, rows, self.ticks) else None

    def _admits(self, topic: str, row: bytes) -> bool:
        """Whether a row that is not plain has valid stamps and values; its tick is not checked.

        Such rows are events and those of the ramp to rest, which continues after the last tick.
        """
        if topic not in self._others:
            return False
        try:
            found = values_of(row)
        except (ValueError, msgpack.UnpackException):
            return False
        if type(found) is not list or len(found) != 2 + len(self._others[topic]):
            return False
        log_ns, publish_ns, *values = found
        if type(log_ns) is not int or type(publish_ns) is not int:
            return False
        if log_ns not in STAMPS or publish_ns not in STAMPS:
            return False
        return all(check(value) for check, value in zip(self._others[topic], values, strict=True))


def columns(found: Any) -> tuple[tuple[str, ...], tuple[bytes, ...]] | None:
    """The topics and the rows of a tuple of at most `PIECE` items; None where a value is anything else."""
    if type(found) is not tuple or not 0 < len(found) <= PIECE or {*map(type, found)} != TUPLES:
        return None
    if {*map(len, found)} != PAIRS:
        return None
    topics, rows = zip(*found, strict=True)
    return (topics, rows) if {*map(type, topics)} == TEXTS and {*map(type, rows)} == BYTES else None


def checks(rows: tuple[Signal, ...], plan: Plan) -> list[Check]:
    """The checks of a topic's values, in the order of the signal table."""
    return [value_check(row, plan.storeys) for row in rows]


def value_check(row: Signal, storeys: int) -> Check:
    """The check of a signal's value."""
    one = CHECKS[row.kind]
    count = row.count(storeys)
    if count == 1:
        return one
    return lambda value: type(value) is list and len(value) == count and all(map(one, value))


def is_number(value: Any) -> bool:
    """Whether a value can be stored as a double; it need not be finite, since a sensor's may not be."""
    return type(value) is float or type(value) is int


def is_values(value: Any) -> bool:
    """Whether a value is a table of numbers by name."""
    return type(value) is dict and all(
        type(name) is str and is_number(number) for name, number in value.items()
    )


def integer(kind: FieldType) -> Check:
    """The check for a whole number that a field of this type can hold."""
    limits: Mapping[FieldType, range] = INTEGERS
    return lambda value: type(value) is int and value in limits[kind]


CHECKS: dict[FieldType, Check] = {
    FieldType.NUMBER: is_number,
    FieldType.STOREYS: is_number,
    FieldType.COUNT: integer(FieldType.COUNT),
    FieldType.INDEX: integer(FieldType.INDEX),
    FieldType.STAMP: integer(FieldType.STAMP),
    FieldType.FLAG: lambda value: type(value) is bool,
    FieldType.TEXT: lambda value: type(value) is str,
    FieldType.VALUES: is_values,
}
