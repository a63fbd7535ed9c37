from __future__ import annotations

import math
from typing import Any, get_type_hints

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.protocol import codec
from common.protocol.codec import MESSAGES, RejectedFrame, decode, encode, session_key
from common.protocol.messages import MOST_CHANNELS, Command, Feedback, Message, Register

KEY = session_key(7, "plan")

FIELDS = {
    int: st.integers(0, codec.MOST),
    float: st.floats(-1e300, 1e300),
    str: st.text(st.characters(exclude_categories=("C", "Z")) | st.just(" "), max_size=50),
    bytes: st.binary(max_size=200),
    tuple[float, ...]: st.lists(st.floats(-1e300, 1e300), min_size=1, max_size=MOST_CHANNELS).map(tuple),
}


def messages_of(kind: type[Any]) -> st.SearchStrategy[Message]:
    hints = get_type_hints(kind)
    fields = {name: FIELDS[hints[name]] for name in kind._fields}
    signed = {name: st.integers(codec.LEAST[name], codec.MOST) for name in fields.keys() & codec.LEAST}
    return st.builds(kind, **fields | signed)


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: kind.__name__)
@given(data=st.data())
def test_every_message_is_decoded_as_it_was_encoded(kind: type[Any], data: st.DataObject) -> None:
    message = data.draw(messages_of(kind))
    returned = decode(encode(message, KEY), KEY)
    assert type(returned) is kind
    assert returned == message


REST = (0.0, 0.0, 0.0)  # the rates of the target
COMMAND = Command(7, 3, 10, 0, 2, 0.001, 12.5, 0.02, 0.3, 4.0)


def framed(content: object, key: codec.Key = KEY) -> bytes:
    payload: bytes = msgpack.packb(content)
    return payload + codec._check(key, payload)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ([codec.KINDS[Command], 7, 3, 10, 0, 2, math.nan, 0.0, *REST], "value"),
        ([codec.KINDS[Command], 7, 3, 10, 0, 2, math.inf, 0.0, *REST], "value"),
        ([codec.KINDS[Command], 7, 3, 10, 0, 2, 1, 0.0, *REST], "type"),
        ([codec.KINDS[Command], 7, True, 10, 0, 2, 1.0, 0.0, *REST], "type"),
        ([codec.KINDS[Command], 7, -2, 10, 0, 2, 1.0, 0.0, *REST], "value"),
        ([codec.KINDS[Command], 2**64 - 1, 3, 10, 0, 2, 1.0, 0.0, *REST], "value"),
        ([codec.KINDS[Command], 7, -1, 10, 0, 2, 1.0, 0.0, *REST], "value"),
        ([codec.KINDS[Command], "7", 3, 10, 0, 2, 1.0, 0.0, *REST], "type"),
        ([codec.KINDS[Command], 7, 3, 10, 0, 2, 1.0, *REST], "fields"),
        ([codec.KINDS[Command], 7, 3, 10, 0, 2, 1.0, 0.0, *REST, 0.0], "fields"),
        ([len(MESSAGES), 7], "kind"),
        ([-1, 7], "kind"),
        (["0", 7], "kind"),
        ({"a": 1}, "format"),
        ([], "format"),
        (None, "format"),
    ],
)
def test_bytes_that_are_not_a_message_are_rejected_with_the_reason(content: object, reason: str) -> None:
    with pytest.raises(RejectedFrame) as rejection:
        decode(framed(content), KEY)
    assert rejection.value.reason.value == reason


@pytest.mark.parametrize("channels", range(1, MOST_CHANNELS + 1))
def test_a_feedback_has_its_own_layout_for_each_number_of_channels(channels: int) -> None:
    feedback = Feedback(7, 3, 2, 11, 2, 11, 12, 13, tuple(float(place) for place in range(channels)))
    frame = encode(feedback, KEY)
    assert len(frame) == 2 + 9 * (8 + channels) + codec.CHECK_SIZE
    assert decode(frame, KEY) == feedback


@pytest.mark.parametrize("channels", [0, MOST_CHANNELS + 1])
def test_a_feedback_of_too_few_or_too_many_channels_is_rejected(channels: int) -> None:
    with pytest.raises(RejectedFrame) as rejection:
        decode(framed([codec.KINDS[Feedback], 7, 3, 2, 11, 2, 11, 12, 13, *[0.0] * channels]), KEY)
    assert rejection.value.reason.value == "fields"


def test_two_messages_in_one_frame_are_rejected() -> None:
    payload = msgpack.packb((codec.KINDS[Command], *COMMAND)) * 2
    with pytest.raises(RejectedFrame) as rejection:
        decode(payload + codec._check(KEY, payload), KEY)
    assert rejection.value.reason.value == "format"


@given(place=st.integers(0, 10_000), bit=st.integers(0, 7))
def test_any_flipped_bit_is_detected(place: int, bit: int) -> None:
    frame = bytearray(encode(COMMAND, KEY))
    frame[place % len(frame)] ^= 1 << bit
    with pytest.raises(RejectedFrame) as rejection:
        decode(bytes(frame), KEY)
    assert rejection.value.reason.value == "check"


@given(st.binary(max_size=300))
def test_random_bytes_are_rejected(noise: bytes) -> None:
    with pytest.raises(RejectedFrame):
        decode(noise, KEY)


@given(st.binary(max_size=300))
def test_random_bytes_with_a_valid_checksum_are_rejected_or_decoded(noise: bytes) -> None:
    try:
        message = decode(noise + codec._check(KEY, noise), KEY)
    except RejectedFrame as rejection:
        assert rejection.reason.value in ("length", "format", "kind", "fields", "type", "value")
    else:
        assert type(message) in MESSAGES


def test_another_session_or_plan_has_another_key() -> None:
    frame = encode(COMMAND, KEY)
    for other in (session_key(8, "plan"), session_key(7, "other"), session_key(0, "plan")):
        with pytest.raises(RejectedFrame) as rejection:
            decode(frame, other)
        assert rejection.value.reason.value == "check"


def test_before_a_session_the_key_does_not_depend_on_the_plan() -> None:
    register = Register(7, 1, "plan")
    assert decode(encode(register, session_key(0, "a")), session_key(0, "b")) == register


def test_frames_of_feedback_and_command_are_shorter_than_128_bytes() -> None:
    feedback = Feedback(2**62, 10**6, 10**6, 2**60, 10**6, 2**60, 2**60, 2**60, (0.1, 0.2, 0.3, 0.4))
    assert len(encode(feedback, KEY)) < 128
    assert len(encode(COMMAND._replace(session=2**62), KEY)) < 128
