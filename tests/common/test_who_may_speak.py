"""Which role may send which message, on which channel and under which key."""

from __future__ import annotations

from typing import get_type_hints

import pytest

from common.link.endpoint import ALLOWED, OPEN, SPOKEN, channel_of
from common.link.rejections import NEWS_NS
from common.link.transport import CONTROL, SAMPLES, TICK
from common.protocol.codec import MESSAGES, decode, encode, session_key
from common.protocol.messages import (
    Arm,
    Message,
    Recorder,
    Refused,
    Register,
    Registered,
    Samples,
    Start,
    Stop,
    Trip,
    Waiting,
)
from common.roles import MASTER, RECORDER, SLAVE
from tests.common.listener import FEEDBACK, GOOD, SESSION, end
from tests.common.test_codec import COMMAND, KEY


@pytest.mark.parametrize(("channels", "heard"), [(4, True), (2, False)])
def test_a_feedback_must_have_as_many_channels_as_its_slave(channels: int, heard: bool) -> None:
    master = end()
    master.endpoint.expect({SLAVE: 4})
    frame = encode(FEEDBACK._replace(measured=FEEDBACK.measured[:channels]), KEY)
    assert (master.hears(SLAVE, TICK, frame) is not None) == heard
    assert master.endpoint.rejected == ({} if heard else {"fields": 1})


def test_every_kind_of_message_has_a_sender() -> None:
    assert frozenset().union(*SPOKEN.values()) == set(MESSAGES)


@pytest.mark.parametrize("role", [MASTER, SLAVE, RECORDER, "operator", "stranger"])
@pytest.mark.parametrize("channel", [TICK, CONTROL, SAMPLES])
def test_a_message_that_a_role_may_not_send_on_a_channel_is_rejected(role: str, channel: str) -> None:
    other = end()
    for kind in MESSAGES:
        session = 0 if kind is Recorder else SESSION
        hints = get_type_hints(kind)
        fields = {name: hints[name]() for name in kind._fields} | {"session": session}
        fields |= {"measured": (0.0,)} if "measured" in fields else {}
        if "lab" in fields:
            fields["lab"] = role
        frame = encode(kind(**fields), KEY)
        heard = other.hears(role, channel, frame) is not None
        assert heard == (kind in SPOKEN.get(role, ()) and channel_of(kind) == channel)
    expected = len(MESSAGES) - len(ALLOWED.get((role, channel), ()))
    assert other.endpoint.rejected == {"kind_not_allowed": expected}


def test_a_named_slave_may_send_what_a_slave_may_send() -> None:
    master = end()
    assert master.hears("slave.roof", TICK, encode(FEEDBACK, KEY)) == FEEDBACK
    assert master.hears("slave.roof", TICK, GOOD) is None
    assert master.endpoint.rejected == {"kind_not_allowed": 1}


def test_a_message_in_the_name_of_another_role_is_rejected() -> None:
    recorder = end()
    assert recorder.hears(MASTER, SAMPLES, encode(Samples(SESSION, SLAVE, 0, b""), KEY)) is None
    assert recorder.hears("slave.roof", CONTROL, encode(Trip(SESSION, "slave.cellar", "", ""), KEY)) is None
    assert recorder.endpoint.rejected == {"sender": 2}


def test_within_a_session_only_the_messages_that_need_it_are_accepted_under_the_shared_key() -> None:
    shared = session_key(0, "")
    keyed: list[tuple[Message, str]] = [
        (Start(SESSION, 1, 1), MASTER),
        (Stop(SESSION, 1, ""), MASTER),
        (Trip(SESSION, MASTER, "", ""), MASTER),
        (Registered(SESSION, 1), SLAVE),
        (Recorder(SESSION, "failed", "plan", "the disk is full.", b""), RECORDER),
    ]
    opened: list[tuple[Message, str]] = [
        (Register(9, 4, "plan"), MASTER),
        (Arm(SESSION, 1), MASTER),
        (Waiting(0, 1), SLAVE),
        (Refused(SESSION, "another plan."), SLAVE),
        (Recorder(0, "ready", "plan", "", b""), RECORDER),
    ]
    for message, role in keyed:
        one = end()
        assert one.hears(role, CONTROL, encode(message, shared)) is None
        assert one.endpoint.rejected == {"open_key": 1}
        assert one.hears(role, CONTROL, encode(message, KEY)) == message
    for message, role in opened:
        assert type(message) in OPEN
        for session in (SESSION, 0):
            assert end(session).hears(role, CONTROL, encode(message, shared)) == message


def test_an_endpoint_without_a_session_ignores_the_messages_of_other_sessions() -> None:
    idle = end(session=0)
    for channel, message in ((TICK, COMMAND), (CONTROL, Stop(SESSION, 1, ""))):
        assert idle.hears(MASTER, channel, encode(message, KEY)) is None
    assert idle.endpoint.rejected == {"unregistered": 2}
    assert idle.endpoint.news(10 * NEWS_NS) is None
    assert idle.hears(MASTER, TICK, encode(COMMAND, session_key(0, ""))) is None
    assert idle.endpoint.rejected["open_key"] == 1


def test_messages_are_sent_under_the_sessions_key_except_those_that_need_the_shared_one() -> None:
    for message, keyed in (
        (Stop(SESSION, 1, ""), True),
        (Registered(SESSION, 1), True),
        (Refused(SESSION, "no rig."), True),
        (Recorder(SESSION, "recording", "", "", b""), True),
        (Refused(SESSION + 1, "it takes part in another test already."), False),
        (Register(SESSION, 4, ""), False),
        (Arm(SESSION, 1), False),
    ):
        one = end()
        one.endpoint.send(message)
        ((_, frame),) = one.wire.sent
        assert decode(frame, KEY if keyed else session_key(0, "")) == message
