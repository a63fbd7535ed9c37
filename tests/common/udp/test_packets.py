"""The packets: every byte is checked, and the example for users reads and writes the same packets."""

from __future__ import annotations

import math
import re

import pytest

from common.signals import COLUMN_CHANNELS, TABLE_CHANNELS
from common.udp import packets
from common.udp.packets import Asked, Request, RigState
from laboratories.kinds import KINDS
from tests.common.udp.server import changed, example, words
from tests.helpers import ROOT

ARM = Request(Asked.ARM, 7, 5, 0.002, 0.02, 2**64 - 1, 2, packets.number(COLUMN_CHANNELS))


def test_both_packets_have_their_documented_lengths() -> None:
    for fields in (packets.REQUEST, packets.ANSWER):
        assert packets.layout(fields).size == packets.SIZE
        assert len({field.name for field in fields}) == len(fields)


def test_the_floats_of_a_packet_are_aligned_to_eight_bytes() -> None:
    for fields in (packets.REQUEST, packets.ANSWER):
        place = 0
        for field in fields:
            assert field.form[-1] not in "dQ" or place % 8 == 0, field
            place += packets.layout([field]).size


def test_the_example_reads_what_a_laboratory_sends() -> None:
    values = (1.5, -math.pi)
    found = example.REQUEST.unpack(packets.pack(ARM._replace(values=values)))
    assert found[:10] == (b"RTHR", 1, 2, 7, 5, 0.002, 0.02, 2**64 - 1, 2, 2)
    assert found[10] == packets.number(COLUMN_CHANNELS)
    assert found[11:19] == (*values, *[0.0] * 6)


def test_a_laboratory_reads_what_the_example_answers() -> None:
    answer = example.Server(example.Column).answer(packets.pack(ARM))
    assert packets.fault(answer) == ""
    found = packets.unpack(answer)
    assert found == (2, 7, 5, packets.number(COLUMN_CHANNELS), RigState.READY, (0.0, 0.0), "")


def test_the_example_names_the_channels_of_the_table_of_signals() -> None:
    assert words(COLUMN_CHANNELS) == example.CHANNELS
    assert packets.number(COLUMN_CHANNELS) != packets.number(TABLE_CHANNELS)
    assert f'"{example.CHANNELS}"' in (ROOT / "examples" / "udp_rig.c").read_text()


def test_a_packet_has_room_for_the_channels_of_every_kind() -> None:
    assert all(len(kind.channels.names) <= packets.VALUES for kind in KINDS.values())


@pytest.mark.parametrize("place", range(packets.SIZE))
def test_both_programs_detect_a_wrong_bit_anywhere(place: int) -> None:
    sent = bytearray(packets.pack(ARM))
    answer = bytearray(example.Server(example.Column).answer(bytes(sent)))
    sent[place] ^= 0x10
    answer[place] ^= 0x10
    assert packets.fault(bytes(answer)) == "damaged"
    assert example.Server(example.Column).answer(bytes(sent)) == b""


@pytest.mark.parametrize("size", [0, 1, packets.CHECKED, packets.SIZE - 1, packets.SIZE + 1])
def test_a_packet_of_another_length_counts_as_damaged(size: int) -> None:
    answer = example.Server(example.Column).answer(packets.pack(ARM))
    assert packets.fault((answer + answer)[:size]) == "damaged"
    assert example.Server(example.Column).answer((packets.pack(ARM) * 2)[:size]) == b""


def test_a_packet_of_another_version_is_distinguished_from_a_damaged_one() -> None:
    answer = example.Server(example.Column).answer(packets.pack(ARM))
    assert packets.fault(changed(answer, version=2)) == "version"


def test_a_rigs_text_cannot_send_control_characters_to_the_terminal() -> None:
    answer = example.Server(example.Column).answer(packets.pack(ARM))
    text = packets.unpack(changed(answer, text=b"\x1b[2Jred\xff")).text
    assert re.fullmatch(r"\[2Jred.", text)
    assert text.isprintable()
