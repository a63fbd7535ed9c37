"""The wire format of OpenSees and OpenFresco: values are read back as written, and wrong bytes are refused."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from common.opensees import wire
from common.opensees.wire import ClientHeader, MessageCode, Quantities, Sizes

COUNTS = st.integers(0, 6)
SIZES = st.builds(Sizes, COUNTS, COUNTS, COUNTS, COUNTS, st.integers(0, 1))
HEADERS = st.builds(
    lambda control, acquired, more: ClientHeader(
        control, acquired, max(1 + sum(control), sum(acquired)) + more
    ),
    SIZES,
    SIZES,
    st.integers(0, 300),
)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)


def values_of(sizes: Sizes) -> st.SearchStrategy[Quantities]:
    return st.builds(Quantities, *(st.tuples(*[NUMBERS] * size) for size in sizes))


def test_the_header_of_an_element_is_what_opensees_sends() -> None:
    """GenericClient.cpp: n displacements, velocities and accelerations, no force, a time; n forces; the size."""
    assert struct.unpack("=11i", wire.header_bytes(wire.element(2))) == (2, 2, 2, 0, 1, 0, 0, 0, 2, 0, 256)
    assert wire.element(20).data == 400  # its stiffness matrix needs more than the default


@given(HEADERS)
def test_headers_are_read_back_as_written(header: ClientHeader) -> None:
    assert wire.read_header(wire.header_bytes(header)) == header


@given(st.data())
def test_commanded_values_are_read_back_to_the_last_bit(data: st.DataObject) -> None:
    header, code = data.draw(HEADERS), data.draw(st.sampled_from(MessageCode))
    values = data.draw(values_of(header.control))
    sent = wire.message(header, code, values)
    assert len(sent) == header.size
    assert wire.code_in(sent) is code
    assert repr(wire.commanded(header, sent)) == repr(values)  # minus zero is another number than zero


@given(st.data())
def test_acquired_values_are_read_back_to_the_last_bit(data: st.DataObject) -> None:
    header = data.draw(HEADERS)
    values = data.draw(values_of(header.acquired))
    sent = wire.answer(header, [number for several in values for number in several])
    assert len(sent) == header.size
    assert repr(wire.acquired(header, sent)) == repr(values)


@given(st.binary(min_size=44, max_size=44))
def test_any_first_bytes_are_read_as_a_valid_header_or_refused(data: bytes) -> None:
    try:
        header = wire.read_header(data)
    except RemoteProtocolError:
        return
    assert header.least <= header.data <= wire.MOST_NUMBERS


@given(st.binary(min_size=8 * 16, max_size=8 * 16))
def test_any_bytes_are_read_as_a_message_or_refused(data: bytes) -> None:
    header = wire.element(4, data=16)
    try:
        assert wire.code_in(data) in MessageCode
        wire.commanded(header, data)
    except RemoteProtocolError:
        pass


def test_a_value_that_is_not_finite_is_refused() -> None:
    header = wire.element(1)
    for bad in (float("nan"), float("inf"), float("-inf")):
        sent = wire.message(header, MessageCode.TRIAL, Quantities((bad,), (0.0,), (0.0,), (), (0.0,)))
        with pytest.raises(RemoteProtocolError, match="not finite"):
            wire.commanded(header, sent)


def test_large_finite_values_are_accepted_although_their_sum_overflows() -> None:
    header = wire.element(1)
    values = Quantities((1.7e308,), (1.7e308,), (1.7e308,), (), (0.0,))
    assert wire.commanded(header, wire.message(header, MessageCode.TRIAL, values)) == values


def test_big_endian_headers_are_refused() -> None:
    with pytest.raises(RemoteProtocolError, match="order of bytes"):
        wire.read_header(struct.pack(">11i", 1, 1, 1, 0, 1, 0, 0, 0, 1, 0, 256))


def test_a_caller_whose_values_do_not_fit_the_header_gets_a_value_error() -> None:
    header = wire.element(1)
    with pytest.raises(ValueError, match="2 values of displacement"):
        wire.message(header, MessageCode.TRIAL, Quantities((0.0, 0.0), (0.0,), (0.0,), (), (0.0,)))
    with pytest.raises(ValueError, match="257 numbers"):
        wire.answer(header, [0.0] * 257)
