"""Hostile pieces of samples from a sender with the right key do not harm the recorder or the recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgpack
import pytest
from hypothesis import given

from common import signals
from common.lab import outlet
from common.lab.outlet import PIECE, Inlet
from common.link.memory_link import MemoryEndpoint
from common.plan.plan import Plan
from common.protocol.messages import Finished, Message, Samples
from common.reality import reality
from common.recording.reader import read
from common.recording.rows import Item, RowPacker
from recorder.items import Items
from simulation import virtual
from tests.common.test_hostile import STRUCTURES
from tests.common.test_slaves import two

PLAN = Plan()
NUMBERS = (0, 0.0, -1, *[0.5] * 10)
SLAVE_ITEM: Item = RowPacker(signals.TOPICS, 1).item("slave", 1, 1, NUMBERS)
EVENT_VALUES: list[Any] = [1, 1, 0.0, "slave", "info", "code", "text", {"a": 1.0}]
EVENT: Item = ("event", msgpack.packb(EVENT_VALUES))
RAMP_VALUES: list[Any] = [1, 1, 0, 0.0, "ramping", *[0.5] * 6]
LATENCY = RowPacker(signals.TOPICS, 1).item("latency", 1, 1, (0, *[0.0] * 8, True, *[0.0] * 4, *[1] * 8))
FLAG_AT = 16 + 4 + 8 * 8  # behind two stamps, the tick and eight numbers


def row(log_ns: int = 1, publish_ns: int = 1, tick: int = 0) -> Item:
    return RowPacker(signals.TOPICS, 1).item("slave", log_ns, publish_ns, (tick, *NUMBERS[1:]))


def event(place: int, value: object) -> Item:
    return "event", msgpack.packb([*EVENT_VALUES[:place], value, *EVENT_VALUES[place + 1 :]])


def ramp(place: int, value: object) -> Item:
    return "slave_ramp", msgpack.packb([*RAMP_VALUES[:place], value, *RAMP_VALUES[place + 1 :]])


HOSTILE: dict[str, object] = {
    "nothing": [],
    "a map": {"a": 1},
    "nil": None,
    "an empty item": [[]],
    "no list": [7],
    "two texts": ["ab", "cd"],
    "too many": [SLAVE_ITEM] * (PIECE + 1),
    "an unknown topic": [("roof", SLAVE_ITEM[1])],
    "another laboratory's topic": [("master", SLAVE_ITEM[1])],
    "a list as its topic": [(["slave"], SLAVE_ITEM[1])],
    "a text as its row": [("slave", "row")],
    "three parts": [(*SLAVE_ITEM, b"")],
    "a negative time": [row(log_ns=-1)],
    "a negative time of publication": [row(publish_ns=-(2**63))],
    "a tick beyond the plan": [row(tick=PLAN.ticks)],
    "a tick of 2^32 - 1": [row(tick=2**32 - 1)],
    "a byte less": [("slave", SLAVE_ITEM[1][:-1])],
    "a byte more": [("slave", SLAVE_ITEM[1] + b"\0")],
    "a row of msgpack": [("slave", msgpack.packb([1, 1, *NUMBERS]))],
    "an event that is no msgpack": [("event", b"\xc1")],
    "an event of a row of numbers": [("event", SLAVE_ITEM[1])],
    "an event that is a map": [("event", msgpack.packb({"a": 1}))],
    "an event with a negative time": [event(0, -1)],
    "an event at a time that no stamp holds": [event(1, 2**63)],
    "an event whose values are none": [event(7, [1.0])],
    "an event with a text as a value": [event(7, {"a": "1"})],
    "an event with a number as its text": [event(6, 1)],
    "an event with a value less": [("event", msgpack.packb(EVENT_VALUES[:-1]))],
    "an event with a value more": [("event", msgpack.packb([*EVENT_VALUES, 0.0]))],
    "a ramp with a truth value as its tick": [ramp(2, True)],
    "a ramp at a tick of 2^32": [ramp(2, 2**32)],
    "a ramp with a text as a number": [ramp(5, "1.0")],
    "a ramp with a list as a number": [ramp(5, [1.0])],
    "the second one": [SLAVE_ITEM, row(log_ns=-1)],
    "the second one an event": [SLAVE_ITEM, event(6, None)],
}
BYTES = {
    "empty": b"",
    "cut off": msgpack.packb([SLAVE_ITEM])[:-1],
    "trailing bytes": msgpack.packb([SLAVE_ITEM]) + b"\0",
    "deeply nested": b"\x91" * 100_000,
    "bad UTF-8": b"\x91\x92\xa2\xff\xfe\xc4\x00",
    "said to be of 2^32 - 1": b"\xdd\xff\xff\xff\xff",
} | {name: msgpack.packb(content) for name, content in HOSTILE.items()}


@pytest.mark.parametrize("packed", BYTES.values(), ids=BYTES.keys())
def test_pieces_that_cannot_be_recorded_are_rejected(packed: bytes) -> None:
    assert Items(PLAN, "slave").unpack(packed) is None


def test_a_flag_must_be_true_or_false() -> None:
    topic, latency = LATENCY
    for flag, recorded in ((0, True), (1, True), (2, False)):
        changed = latency[:FLAG_AT] + bytes([flag]) + latency[FLAG_AT + 1 :]
        found = Items(PLAN, "master").unpack(msgpack.packb([(topic, changed)]))
        assert (found is not None) == recorded


def test_pieces_that_a_laboratory_may_send_are_accepted() -> None:
    items = (SLAVE_ITEM, EVENT, ramp(2, PLAN.ticks + 1))
    assert Items(PLAN, "slave").unpack(msgpack.packb(items)) == items
    roof, cellar = Items(two(), "slave.roof"), Items(two(), "slave.cellar")
    packed = msgpack.packb([("slave.roof", SLAVE_ITEM[1])])
    assert roof.unpack(packed) is not None
    assert cellar.unpack(packed) is None


@given(STRUCTURES)
def test_any_structure_is_accepted_as_a_piece_or_rejected(content: object) -> None:
    packed = msgpack.packb(content)
    inlet = Inlet(Items(PLAN, "slave").unpack, most=100)
    found = inlet.take(Samples(1, "slave", 0, packed))
    assert len(found) == inlet.next
    assert inlet.rejected == (not found)
    assert isinstance(outlet.next_of(packed, "slave"), int)


def test_a_sequence_number_beyond_the_test_does_not_advance_a_stream() -> None:
    inlet = Inlet(Items(PLAN, "slave").unpack, most=100)
    packed = msgpack.packb([SLAVE_ITEM])
    assert inlet.take(Samples(1, "slave", 2**61, packed)) == []
    inlet.end(Finished(1, "slave", 2**61))
    assert (inlet.missing(), inlet.total, inlet.rejected) == (None, None, 2)


def test_pieces_that_wait_for_earlier_ones_take_bounded_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    packed = msgpack.packb([SLAVE_ITEM])
    monkeypatch.setattr(outlet, "EARLY_BYTES", 10 * len(packed))
    inlet = Inlet(Items(PLAN, "slave").unpack)
    for first in range(1, 100):
        inlet.take(Samples(1, "slave", first, packed))
    assert len(inlet._early) == 10
    assert len(inlet.take(Samples(1, "slave", 0, packed))) == 11
    assert (inlet.next, inlet._held, inlet._early) == (11, 0, {})


def test_a_recorder_that_gets_hostile_pieces_records_the_test_completely(
    short_plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deliver, hostile = MemoryEndpoint.send, iter([*BYTES.values()] * 4)
    sent = 0

    def attacked(self: MemoryEndpoint, message: Message, to: str = "") -> int:
        nonlocal sent
        if isinstance(message, Samples) and (packed := next(hostile, None)) is not None:
            sent += 1
            deliver(self, message._replace(items=packed))
            deliver(self, message._replace(items=packed, first=2**61))
        return deliver(self, message, to)

    monkeypatch.setattr(MemoryEndpoint, "send", attacked)
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), tmp_path / "a.mcap")
    assert virtual.run(bench, lambda: "") is None
    run = read(tmp_path / "a.mcap")
    for topic in ("master", "slave", "latency"):
        assert run.sequences[topic].tolist() == list(range(short_plan.ticks))
    summary = run.metadata["summary"]
    assert (summary["items_lost"], summary["pieces_rejected"]) == ("0", str(2 * sent))
