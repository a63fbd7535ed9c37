"""Pieces of samples that a sender with the right key could send: the recorder lives, and records the rest whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgpack
import pytest
from hypothesis import given

from common.lab import outlet
from common.lab.outlet import PIECE, Inlet
from common.link.memory_link import MemoryEndpoint
from common.plan import reality
from common.plan.plan import Plan
from common.protocol.messages import Finished, Message, Samples
from common.recording.reader import read
from recorder.items import Items
from simulation import virtual
from tests.common.test_hostile import STRUCTURES
from tests.common.test_slaves import two

PLAN = Plan()
SLAVE_ITEM: list[Any] = ["slave", 1, 1, 0, 0.0, -1, *[0.5] * 10]
EVENT: list[Any] = ["event", 1, 1, 0.0, "slave", "info", "code", "text", {"a": 1.0}]


def changed(item: list[Any], place: int, value: object) -> list[Any]:
    return [*item[:place], value, *item[place + 1 :]]


HOSTILE: dict[str, object] = {
    "nothing": [],
    "a map": {"a": 1},
    "nil": None,
    "an empty item": [[]],
    "no list": [7],
    "too many": [SLAVE_ITEM] * (PIECE + 1),
    "an unknown topic": [changed(SLAVE_ITEM, 0, "roof")],
    "another laboratory's topic": [["master", *SLAVE_ITEM[1:]]],
    "a list as its topic": [changed(SLAVE_ITEM, 0, ["slave"])],
    "a negative time": [changed(SLAVE_ITEM, 1, -1)],
    "a time that no stamp holds": [changed(SLAVE_ITEM, 2, 2**63)],
    "a tick beyond the plan": [changed(SLAVE_ITEM, 3, PLAN.ticks)],
    "a tick of 2^32": [changed(SLAVE_ITEM, 3, 2**32)],
    "a truth value as its tick": [changed(SLAVE_ITEM, 3, True)],
    "a text as a number": [changed(SLAVE_ITEM, 7, "1.0")],
    "a list as a number": [changed(SLAVE_ITEM, 7, [1.0])],
    "a command of 2^31": [changed(SLAVE_ITEM, 5, 2**31)],
    "a value less": [SLAVE_ITEM[:-1]],
    "a value more": [[*SLAVE_ITEM, 0.0]],
    "an event whose values are none": [changed(EVENT, 8, [1.0])],
    "an event with a text as a value": [changed(EVENT, 8, {"a": "1"})],
    "an event with a number as its text": [changed(EVENT, 7, 1)],
    "the second one": [SLAVE_ITEM, changed(SLAVE_ITEM, 7, None)],
}
BYTES = {
    "empty": b"",
    "cut off": msgpack.packb([SLAVE_ITEM])[:-1],
    "trailing bytes": msgpack.packb([SLAVE_ITEM]) + b"\0",
    "deeply nested": b"\x91" * 100_000,
    "bad UTF-8": b"\x91\x91\xa2\xff\xfe",
    "said to be of 2^32 - 1": b"\xdd\xff\xff\xff\xff",
} | {name: msgpack.packb(content) for name, content in HOSTILE.items()}


@pytest.mark.parametrize("packed", BYTES.values(), ids=BYTES.keys())
def test_what_can_not_be_recorded_is_no_piece(packed: bytes) -> None:
    assert Items(PLAN, "slave").unpack(packed) is None


def test_what_a_laboratory_may_send_is_a_piece() -> None:
    assert Items(PLAN, "slave").unpack(msgpack.packb([SLAVE_ITEM, EVENT])) == [SLAVE_ITEM, EVENT]
    roof, cellar = Items(two(), "slave.roof"), Items(two(), "slave.cellar")
    packed = msgpack.packb([changed(SLAVE_ITEM, 0, "slave.roof")])
    assert roof.unpack(packed) is not None
    assert cellar.unpack(packed) is None


@given(STRUCTURES)
def test_any_structure_is_a_piece_or_none(content: object) -> None:
    packed = msgpack.packb(content)
    inlet = Inlet(Items(PLAN, "slave").unpack, most=100)
    found = inlet.take(Samples(1, "slave", 0, packed))
    assert len(found) == inlet.next
    assert inlet.rejected == (not found)
    assert isinstance(outlet.next_of(packed, "slave"), int)


def test_a_number_beyond_the_test_moves_no_stream() -> None:
    inlet = Inlet(Items(PLAN, "slave").unpack, most=100)
    packed = msgpack.packb([SLAVE_ITEM])
    assert inlet.take(Samples(1, "slave", 2**61, packed)) == []
    inlet.end(Finished(1, "slave", 2**61))
    assert (inlet.missing(), inlet.total, inlet.rejected) == (None, None, 2)


def test_pieces_that_wait_take_bounded_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    packed = msgpack.packb([SLAVE_ITEM])
    monkeypatch.setattr(outlet, "EARLY_BYTES", 10 * len(packed))
    inlet = Inlet(Items(PLAN, "slave").unpack)
    for first in range(1, 100):
        inlet.take(Samples(1, "slave", first, packed))
    assert len(inlet._early) == 10
    assert len(inlet.take(Samples(1, "slave", 0, packed))) == 11
    assert (inlet.next, inlet._held, inlet._early) == (11, 0, {})


def test_a_recorder_among_hostile_pieces_records_the_test_whole(
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
