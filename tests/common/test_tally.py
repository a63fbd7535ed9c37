from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from common.protocol.tally import Tally

TICKS, WINDOW = 200, 50


def test_a_message_that_is_not_fresh_is_rejected_with_its_reason() -> None:
    tally = Tally(TICKS, WINDOW)
    assert tally.admit(10, expected=10)
    for seq, expected, reason in (
        (10, 11, "repeated"),
        (4, 11, "old"),
        (11, 62, "stale"),
        (62, 11, "ahead"),
        (TICKS, 190, "ahead"),
        (-1, 11, "ahead"),
    ):
        before = tally.reasons[reason]
        assert not tally.admit(seq, expected), reason
        assert tally.reasons[reason] == before + 1
    assert tally.admit(61, expected=11)
    assert tally.admit(62, expected=112)


@given(
    st.lists(
        st.tuples(
            st.integers(-3, TICKS + 3), st.integers(-20, TICKS + 80), st.sampled_from(["use", "keep", "lose"])
        ),
        max_size=150,
    )
)
def test_every_sequence_number_is_counted_once_and_admitted_numbers_increase(
    frames: list[tuple[int, int, str]],
) -> None:
    tally, admitted, used, lost, seen = Tally(TICKS, WINDOW), [], set(), set(), set()
    for seq, expected, then in frames:
        fresh = tally.admit(seq, expected)
        if 0 <= seq < TICKS and (fresh or seq <= expected + WINDOW):
            seen.add(seq)
        if not fresh:
            continue
        admitted.append(seq)
        if then == "use":
            tally.use(seq)
            used.add(seq)
        elif then == "lose":
            tally.lose(seq)
            lost.add(seq)
    assert admitted == sorted(set(admitted))
    assert tally.used == len(used)
    assert tally.used + tally.rejected <= len(seen)
    assert tally.used + tally.rejected >= len(seen - lost)
    assert sum(tally.reasons.values()) == len(frames) - len(admitted)
