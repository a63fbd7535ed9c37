"""Hostile frames are each rejected and counted with their reason, and have no other effect."""

from __future__ import annotations

import math
import re
import struct
import threading
import tracemalloc
from typing import Any, get_type_hints

import msgpack
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from common.link.endpoint import CHANNELS, LARGEST, OPEN
from common.link.rejections import NEWS_NS, RejectionCount, Rejections
from common.link.transport import CONTROL, TICK
from common.protocol import codec
from common.protocol.codec import MESSAGES, MOST_TEXT, Reject, RejectedFrame, decode, encode, session_key
from common.protocol.messages import (
    MOST_CHANNELS,
    Command,
    Message,
    Stop,
    Trip,
)
from common.roles import MASTER, SLAVE
from tests.common.listener import GOOD, SESSION, end
from tests.common.test_codec import COMMAND, KEY, framed, messages_of
from tests.helpers import ROOT


def command(*fields: object) -> list[object]:
    """The items of a command whose first ones are given."""
    return [codec.KINDS[Command], *fields, *list(COMMAND)[len(fields) :]]


def signed(payload: bytes) -> bytes:
    return payload + codec._check(KEY, payload)


def bare(content: object) -> bytes:
    packed: bytes = msgpack.packb(content)
    return packed


BODY = GOOD[:-8]
# payloads that a sender with the right key could send, and why each is none
CONTENTS: dict[str, tuple[bytes, str]] = {
    "nothing at all": (b"", "length"),
    "nil": (bare(None), "format"),
    "truth": (bare(True), "format"),
    "a number": (bare(7), "format"),
    "a text": (bare("command"), "format"),
    "bytes": (bare(b"command"), "format"),
    "a map": (bare({"kind": 10}), "format"),
    "a map with whole numbers as keys": (b"\x81\x01\x02", "format"),
    "an empty array": (bare([]), "format"),
    "an extension": (msgpack.packb(msgpack.ExtType(1, b"x")), "format"),
    "a reserved byte": (b"\xc1", "format"),
    "two messages": (BODY * 2, "format"),
    "trailing bytes": (BODY + b"\x00", "format"),
    "cut off": (BODY[:-1], "format"),
    "an array said to be of 2^32 - 1": (b"\xdd\xff\xff\xff\xff", "format"),
    "a map said to be of 2^32 - 1": (b"\xdf\xff\xff\xff\xff", "format"),
    "bytes said to be 2^32 - 1": (b"\xc6\xff\xff\xff\xff", "format"),
    "a text said to be 2^32 - 1": (b"\xdb\xff\xff\xff\xff", "format"),
    "an extension said to be 2^32 - 1": (b"\xc9\xff\xff\xff\xff\x01", "format"),
    "deeply nested arrays": (b"\x91" * 200 + b"\xc0", "kind"),
    "nested arrays without an end": (b"\x91" * 200, "format"),
    "deeply nested maps": (b"\x81\xa0" * 100, "format"),
    "bad UTF-8": (b"\x92\x00\xa2\xff\xfe", "format"),
    "no kind": (bare([None]), "kind"),
    "a text as the kind": (bare(["10"]), "kind"),
    "a truth value as the kind": (bare([True, 7]), "kind"),
    "an unknown kind": (bare([len(MESSAGES), 7]), "kind"),
    "a negative kind": (bare([-1, 7]), "kind"),
    "a kind of its own channel only": (bare([codec.KINDS[Stop], 7, 3, "enough"]), "kind_not_allowed"),
    "a field less": (bare(command()[:-1]), "fields"),
    "a field more": (bare([*command(), 0.0]), "fields"),
    "a truth value as a number": (bare(command(7, True)), "type"),
    "a text as a number": (bare(command("7")), "type"),
    "a float as a number": (bare(command(7, 3.0)), "type"),
    "a whole number as a float": (bare(command(7, 3, 10, 0, 2, 1)), "type"),
    "nil as a float": (bare(command(7, 3, 10, 0, 2, None)), "type"),
    "a nested array as a float": (bare(command(7, 3, 10, 0, 2, [0.0])), "type"),
    "an extension as a float": (bare(command(7, 3, 10, 0, 2, msgpack.ExtType(5, b"12345678"))), "type"),
    "a time stamp as a number": (bare(command(7, msgpack.Timestamp(1))), "type"),
    "NaN": (bare(command(7, 3, 10, 0, 2, math.nan)), "value"),
    "infinity": (bare(command(7, 3, 10, 0, 2, math.inf)), "value"),
    "infinities that cancel": (bare(command(7, 3, 10, 0, 2, math.inf, -math.inf)), "value"),
    "a negative tick": (bare(command(7, -1)), "value"),
    "a negative session": (bare(command(-7)), "value"),
    "2^64 - 1": (bare(command(2**64 - 1)), "value"),
    "a drift below -2^62": (bare(command(7, 3, 10, -(2**63))), "value"),
    "a float of single precision": (
        BODY.replace(struct.pack(">Bd", 0xCB, 12.5), struct.pack(">Bf", 0xCA, 12.5)),
        "format",
    ),
    "a number in fewer bytes than others": (BODY.replace(b"\xd3" + bytes(7) + b"\x03", b"\x03"), "format"),
    "numbers in as few bytes as they need": (bare(command()), "format"),
    "a number without a sign": (BODY.replace(b"\xd3", b"\xcf", 1), "format"),
}


@pytest.mark.parametrize(("payload", "reason"), CONTENTS.values(), ids=CONTENTS.keys())
def test_each_hostile_content_under_the_right_key_is_rejected_for_its_reason(
    payload: bytes, reason: str
) -> None:
    slave = end()
    assert slave.hears(MASTER, TICK, signed(payload)) is None
    assert slave.endpoint.rejected == {reason: 1}
    assert slave.hears(MASTER, TICK, GOOD) == COMMAND


# whole frames, most of them without a valid check
FRAMES = {
    "empty": (b"", "length"),
    "a check only": (bytes(8), "length"),
    "no check": (BODY, "check"),
    "of another session": (encode(COMMAND, session_key(8, "plan")), "check"),
    "of another plan": (encode(COMMAND, session_key(SESSION, "other")), "check"),
    "under the key that all share": (encode(COMMAND, session_key(0, "plan")), "check"),
    "of a key without a secret": (BODY + bytes(8), "check"),
    "a flipped bit": (GOOD[:20] + bytes([GOOD[20] ^ 1]) + GOOD[21:], "check"),
    "oversize with a valid check": (signed(BODY + bytes(LARGEST[TICK])), "length"),
    "ten megabytes": (bytes(10_000_000), "length"),
}


@pytest.mark.parametrize(("frame", "reason"), FRAMES.values(), ids=FRAMES.keys())
def test_each_hostile_frame_is_rejected_for_its_reason(frame: bytes, reason: str) -> None:
    slave = end()
    assert slave.hears(MASTER, TICK, frame) is None
    assert slave.endpoint.rejected == {reason: 1}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("x" * MOST_TEXT, ""),
        ("x" * (MOST_TEXT + 1), "value"),
        ("a line\nand another", "value"),
        ("\x1b[2J", "value"),
        ("Schütteltisch, 5 µm", ""),
    ],
)
def test_texts_are_bounded_and_printable(text: str, reason: str) -> None:
    slave = end()
    stop = Stop(SESSION, 3, text)
    assert slave.hears(MASTER, CONTROL, encode(stop, KEY)) == (None if reason else stop)
    assert slave.endpoint.rejected == ({reason: 1} if reason else {})


@given(st.text() | st.text().map(lambda text: text * 200))
@example("\ud800")
def test_a_trip_with_any_text_of_a_rig_arrives_cut_to_the_longest_text(text: str) -> None:
    slave, master = end(), end()
    slave.endpoint.send(Trip(SESSION, SLAVE, "tripped", text))
    ((channel, frame),) = slave.wire.sent
    message = master.hears(SLAVE, channel, frame)
    assert isinstance(message, Trip)
    assert len(message.text) == min(len(text), MOST_TEXT)


def test_rejections_are_reported_at_most_once_a_second_with_totals_and_increments() -> None:
    found = Rejections()
    assert found.news(0) is None
    found.add(Reject.CHECK, "slave.roof", 5)
    news = found.news(10)
    assert news is not None
    assert (news["code"], news["level"]) == ("rejected", "warning")
    assert news["text"] == "Frames were rejected: 1 by check (last from the slave.roof)."
    for at in range(20, 30):
        found.add(Reject.VALUE, MASTER, at)
    found.add(Reject.CHECK, MASTER, 40)
    assert found.news(10 + NEWS_NS - 1) is None
    news = found.news(10 + NEWS_NS)
    assert news is not None
    assert news["text"] == (
        "Frames were rejected: 1 by check (last from the master), 10 by value (last from the master)."
    )
    assert news["values"] == {"check": 2.0, "value": 10.0}
    assert found.news(10 + 5 * NEWS_NS) is None
    assert found.seen["check"] == RejectionCount(5, MASTER)
    assert found.seen["value"].first_ns == 20


def test_no_rejection_is_lost_between_threads() -> None:
    found = Rejections()

    def flood() -> None:
        for at in range(2_000):
            found.add(Reject.CHECK, SLAVE, at)

    threads = [threading.Thread(target=flood) for _ in range(4)]
    for thread in threads:
        thread.start()
    told = 0
    for second in range(100):
        told += found.news(second * NEWS_NS) is not None
    for thread in threads:
        thread.join(10.0)
    assert not any(thread.is_alive() for thread in threads)
    found.news(1_000 * NEWS_NS)
    assert found.counts["check"] == 8_000


@pytest.mark.parametrize("unit", [b"\x90", b"\x80", b"\x91", b"\xc0", b"\xa0", b"\xca\x00\x00\x00\x00"])
def test_hostile_content_takes_memory_in_proportion_to_a_bounded_frame(unit: bytes) -> None:
    largest = LARGEST[CONTROL]
    count = (largest - 5 - codec.CHECK_SIZE) // len(unit)
    frame = signed(b"\xdd" + struct.pack(">I", count) + unit * count)
    tracemalloc.start()
    with pytest.raises(RejectedFrame):
        decode(frame, KEY, largest=largest)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 80 * largest


def test_an_oversize_frame_is_rejected_without_being_hashed() -> None:
    class Untouched:
        def copy(self) -> codec.Key:
            raise AssertionError

        update = digest = copy

    with pytest.raises(RejectedFrame) as rejection:
        decode(bytes(LARGEST[TICK] + 1), Untouched(), largest=LARGEST[TICK])  # type: ignore[arg-type]
    assert rejection.value.reason is Reject.LENGTH


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: kind.__name__)
def test_the_largest_message_of_numbers_fits_its_channel(kind: type[Any]) -> None:
    largest: dict[Any, Any] = {int: codec.MOST, float: 0.1, str: "slave." + "x" * 100, bytes: b"x" * 10_000}
    largest[tuple[float, ...]] = (0.1,) * MOST_CHANNELS
    fields = [largest[hint] for name, hint in get_type_hints(kind).items() if name in kind._fields]
    assert len(encode(kind(*fields), KEY)) <= LARGEST[CHANNELS.get(kind, CONTROL)]


ANY_MESSAGE = st.sampled_from(MESSAGES).flatmap(messages_of)
PLAIN = (
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=20)
    | st.binary(max_size=20)
    | st.builds(msgpack.ExtType, st.integers(0, 127), st.binary(max_size=9))
)
STRUCTURES = st.recursive(
    PLAIN,
    lambda inner: st.lists(inner, max_size=8) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=20,
)


def is_message_or_rejected(frame: bytes) -> None:
    """Decodes a payload, which must give a message or a rejection and raise nothing else."""
    try:
        message = decode(frame, KEY)
    except RejectedFrame as rejection:
        assert rejection.reason in Reject
        return
    assert type(message) in MESSAGES
    assert encode(message, KEY) == frame
    assert decode(frame, KEY) == message


@given(st.binary(max_size=400))
def test_any_bytes_are_decoded_or_rejected_without_another_error(noise: bytes) -> None:
    is_message_or_rejected(noise)
    is_message_or_rejected(signed(noise))


@given(STRUCTURES)
def test_any_structure_under_the_right_key_is_decoded_or_rejected(content: object) -> None:
    is_message_or_rejected(framed(content))


@given(st.integers(0, len(MESSAGES)), st.lists(PLAIN, max_size=14))
def test_any_fields_of_a_known_message_kind_are_decoded_or_rejected(kind: int, fields: list[object]) -> None:
    is_message_or_rejected(framed([kind, *fields]))


@given(ANY_MESSAGE, st.data())
def test_a_valid_message_with_exchanged_fields_is_decoded_or_rejected(
    message: Message, data: st.DataObject
) -> None:
    items: list[object] = [codec.KINDS[type(message)], *message]
    place = data.draw(st.integers(0, len(items) - 1))
    items[place] = data.draw(STRUCTURES)
    is_message_or_rejected(framed(items))
    is_message_or_rejected(framed(data.draw(st.permutations(items))))


@given(ANY_MESSAGE, st.data())
def test_a_valid_message_that_is_flipped_cut_or_extended_is_decoded_or_rejected(
    message: Message, data: st.DataObject
) -> None:
    payload = bytearray(encode(message, KEY)[:-8])
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, max(len(payload) - 1, 0)))
        match data.draw(st.sampled_from(["flip", "cut", "stuff", "move"])):
            case "flip" if payload:
                payload[place] ^= 1 << data.draw(st.integers(0, 7))
            case "cut":
                del payload[place : place + data.draw(st.integers(1, 9))]
            case "stuff":
                payload[place:place] = data.draw(st.binary(min_size=1, max_size=9))
            case _:
                payload = payload[place:] + payload[:place]
    is_message_or_rejected(signed(bytes(payload)))


def test_the_documentation_lists_every_reason_for_rejection_once_in_the_order_of_the_enum() -> None:
    text = (ROOT / "docs" / "reference" / "rejections.md").read_text(encoding="utf-8")
    table, _, keys = text.partition("## Keys")
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == [reason.value for reason in Reject]
    assert set(re.findall(r"^\| `(\w+)` \|", keys, re.MULTILINE)) == {kind.__name__ for kind in OPEN}
