from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.lab import outlet
from common.lab.outlet import BURST, PATIENCES, PIECE, Inlet, Outlet, kept_items
from common.plan.plan import Plan
from common.protocol.messages import Resend, Samples
from common.recording.rows import Item, RowPacker, values_of
from tests.helpers import with_table

ROWS = RowPacker({}, 1)  # without topics every row is msgpack


def filled(count: int, kept: float = math.inf) -> tuple[Outlet, list[Samples]]:
    outlet = Outlet(1, "master", kept, ROWS)
    pieces: list[Any] = []
    for number in range(count):
        outlet.add("master", (number, number, number, 0.5))
        pieces += outlet.pieces()
    pieces += outlet.pieces(everything=True)
    return outlet, pieces


def numbers(items: list[Item]) -> list[int]:
    return [values_of(row)[2] for _, row in items]


@given(st.integers(0, 200), st.randoms(use_true_random=False), st.floats(0.0, 0.9))
def test_the_stream_is_complete_and_in_order_whatever_is_lost_swapped_or_repeated(
    count: int, random: Any, loss: float
) -> None:
    outlet, pieces = filled(count)
    inlet, got = Inlet(), []
    arriving = [piece for piece in pieces if random.random() >= loss]
    random.shuffle(arriving)
    for piece in arriving + arriving[:2]:
        got += inlet.take(piece)
    inlet.total = outlet.finished().total
    for _ in range(1000):
        if (hole := inlet.missing()) is None:
            break
        for again in outlet.again(Resend(1, "master", *hole)):
            assert isinstance(again, Samples)
            got += inlet.take(again)
    assert numbers(got) == list(range(count))
    assert inlet.complete
    assert inlet.lost == 0


def test_pieces_are_sent_when_they_are_full() -> None:
    outlet = Outlet(1, "slave", math.inf, ROWS)
    for number in range(PIECE - 1):
        outlet.add("slave", (0, 0, number))
    assert outlet.pieces() == []
    outlet.add("slave", (0, 0, PIECE - 1))
    assert len(outlet.pieces()) == 1


def test_a_gap_that_cannot_be_filled_is_counted() -> None:
    outlet, pieces = filled(3 * PIECE)
    inlet = Inlet()
    got = inlet.take(pieces[0]) + inlet.take(pieces[2])
    assert inlet.missing() == (PIECE, 2 * PIECE - 1)
    got += inlet.give_up()
    inlet.total = outlet.total
    assert inlet.lost == PIECE
    assert numbers(got) == [*range(PIECE), *range(2 * PIECE, 3 * PIECE)]
    assert inlet.complete


def test_a_missing_end_is_detected_once_the_length_is_known() -> None:
    outlet, pieces = filled(2 * PIECE)
    inlet = Inlet()
    inlet.take(pieces[0])
    assert inlet.missing() is None
    inlet.total = outlet.total
    assert inlet.missing() == (PIECE, 2 * PIECE - 1)
    assert not inlet.complete


def test_a_laboratory_resends_a_bounded_number_of_pieces_at_once() -> None:
    outlet, pieces = filled(100 * PIECE)
    assert outlet.again(Resend(1, "master", 0, outlet.total - 1)) == pieces[:BURST]
    assert outlet.again(Resend(1, "master", 3 * PIECE, 4 * PIECE - 1)) == [pieces[3]]
    assert outlet.again(Resend(1, "master", 3 * PIECE + 4, 3 * PIECE + 4)) == [pieces[3]]
    for first, last in ((-1, 5), (7, 6), (0, outlet.total)):
        assert outlet.again(Resend(1, "master", first, last)) == []


def test_a_resend_leaves_out_discarded_pieces_and_sends_the_later_ones() -> None:
    outlet, pieces = filled(103 * PIECE, kept=99 * PIECE)
    assert outlet.again(Resend(1, "master", 0, outlet.total - 1)) == pieces[3 : 3 + BURST]
    assert outlet.again(Resend(1, "master", 0, 3 * PIECE - 1)) == []


@given(st.integers(1, 500), st.integers(1, 300))
def test_only_about_the_requested_number_of_newest_items_is_kept(count: int, kept: int) -> None:
    outlet, _ = filled(count, kept)
    again = [item for item in range(count) if outlet.again(Resend(1, "master", item, item))]
    assert again == list(range(count - len(again), count))
    assert min(count, kept) <= len(again) < kept + 2 * PIECE


def test_the_kept_items_are_bounded_in_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outlet, "KEPT_BYTES", 5_000)
    sender, _ = filled(1_000 * PIECE)
    assert 4_000 < sum(len(piece.items) for piece in sender._sent) == sender._sent_bytes <= 5_000


def test_all_laboratories_keep_items_for_the_same_time_span(default_plan: Plan) -> None:
    ticks = 60.0 / default_plan.test.interval
    assert kept_items(default_plan, "slave") == pytest.approx(ticks)
    assert kept_items(default_plan, "master") == pytest.approx(2 * ticks)  # and its latency
    hasty = with_table(default_plan, "recording", patience=1.5)
    assert kept_items(hasty, "slave") == pytest.approx(PATIENCES * 1.5 / default_plan.test.interval)


def test_all_gaps_are_listed_at_once() -> None:
    outlet, pieces = filled(9 * PIECE)
    inlet = Inlet()
    for place in (0, 2, 3, 6):
        inlet.take(pieces[place])
    inlet.total = outlet.total
    assert list(inlet.holes()) == [
        (PIECE, 2 * PIECE - 1),
        (4 * PIECE, 6 * PIECE - 1),
        (7 * PIECE, 9 * PIECE - 1),
    ]
