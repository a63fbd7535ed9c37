"""Which items of a laboratory's stream may be recorded: its own topics, and values as the signals have them."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any

import msgpack

from common.lab.outlet import PIECE
from common.plan.plan import Plan
from common.roles import MASTER, latency_topic, ramp_topic
from common.signals import FieldType, Signal
from laboratories import kinds
from recorder.encoding import is_plain, layout

Item = list[Any]
Check = Callable[[Any], bool]

STAMPED = 3  # places of an item before its values: topic, log and publish time
STAMPS = range(2**63)  # those times, ns
INTEGERS = {
    FieldType.COUNT: range(2**32),
    FieldType.INDEX: range(-(2**31), 2**31),
    FieldType.STAMP: range(-(2**63), 2**63),
}


class Items:
    """What one laboratory of a plan may send to the recorder."""

    def __init__(self, plan: Plan, lab: str) -> None:
        topics = kinds.topics(plan)
        own = {"event", lab, ramp_topic(lab), *(map(latency_topic, plan.roles) if lab == MASTER else ())}
        own &= topics.keys()  # a master without a laboratory has no ramp
        self._ticks = range(plan.ticks)
        self._unbounded = ("event", ramp_topic(lab))  # the ramp to rest goes on after the last tick
        self._rows = {topic: checks(topics[topic], plan) for topic in own}
        self._plain = {topic: Plain(topics[topic]) for topic in own if is_plain(topics[topic], plan.storeys)}

    def unpack(self, packed: bytes) -> list[Item] | None:
        """The items of a piece; None where it holds anything that cannot be recorded."""
        try:
            items = msgpack.unpackb(packed)
        except (ValueError, msgpack.UnpackException):
            return None
        if type(items) is not list or not 0 < len(items) <= PIECE or not all(map(self._admits, items)):
            return None
        return items

    def _admits(self, item: Any) -> bool:
        if type(item) is not list or len(item) < 4 or type(item[0]) is not str or item[0] not in self._rows:
            return False
        topic, log_ns, publish_ns, tick = item[:4]
        if topic in self._plain and self._plain[topic].fits(item):
            return tick in self._ticks
        rows = self._rows[topic]
        if type(log_ns) is not int or type(publish_ns) is not int or len(item) - STAMPED != len(rows):
            return False
        if log_ns not in STAMPS or publish_ns not in STAMPS:
            return False
        if topic not in self._unbounded and tick not in self._ticks:
            return False
        return all(check(value) for check, value in zip(rows, item[STAMPED:], strict=True))


class Plain:
    """Items of a topic that has one number per signal, checked by calls into C: most of a test's items."""

    def __init__(self, rows: tuple[Signal, ...]) -> None:
        self._types = (str, int, int, *(TYPES[row.kind] for row in rows))
        self._pack = layout(rows).pack

    def fits(self, item: Item) -> bool:
        """Whether times and values are of exactly the types of their signals, and in their ranges."""
        if tuple(map(type, item)) != self._types:
            return False
        try:
            self._pack(*item[1:])
        except struct.error:
            return False
        return item[1] | item[2] in STAMPS


def checks(rows: tuple[Signal, ...], plan: Plan) -> list[Check]:
    """What each value of a topic must be, in the order of the signal table."""
    return [value_check(row, plan.storeys) for row in rows]


def value_check(row: Signal, storeys: int) -> Check:
    """What the value of a signal must be to be recorded."""
    one = CHECKS[row.kind]
    count = row.count(storeys)
    if count == 1:
        return one
    return lambda value: type(value) is list and len(value) == count and all(map(one, value))


def is_number(value: Any) -> bool:
    """Whether a value can be stored as a double; a sensor's may be no finite number."""
    return type(value) is float or type(value) is int


def is_values(value: Any) -> bool:
    """Whether a value is a table of numbers by name."""
    return type(value) is dict and all(
        type(name) is str and is_number(number) for name, number in value.items()
    )


def integer(kind: FieldType) -> Check:
    """Whether a value is a whole number that its field can hold."""
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

TYPES: dict[FieldType, type] = {
    FieldType.NUMBER: float,
    FieldType.STOREYS: float,
    FieldType.COUNT: int,
    FieldType.INDEX: int,
    FieldType.STAMP: int,
    FieldType.FLAG: bool,
}
