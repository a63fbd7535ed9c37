from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from common.link.mailbox import Mailbox, PerfectLink

DT = 0.002


class Fates:
    """A link with a given extra delay for each message."""

    def __init__(self, delays: list[float | None]) -> None:
        self.delays = delays

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        assert direction == "feedback"
        assert t == seq * DT
        return self.delays[seq]


def test_on_a_perfect_link_a_message_is_used_at_its_nominal_tick() -> None:
    box: Mailbox[str] = Mailbox(PerfectLink(), "feedback", DT, nominal=1)
    box.put(0, "a")
    assert box.take(0) is None
    assert box.take(1) == "a"
    assert box.take(2) is None


def test_a_delay_of_one_interval_is_one_tick() -> None:
    box: Mailbox[str] = Mailbox(Fates([DT, 0.0]), "feedback", DT, nominal=0)
    box.put(0, "a")
    assert box.take(0) is None
    assert box.take(1) == "a"


@given(st.lists(st.one_of(st.none(), st.floats(0.0, 0.02)), min_size=1, max_size=40))
def test_each_tick_uses_the_newest_message_that_has_arrived(delays: list[float | None]) -> None:
    box: Mailbox[int] = Mailbox(Fates(delays), "feedback", DT, nominal=1)
    used, expected = -1, -1
    for tick in range(len(delays) + 12):
        if tick < len(delays):
            box.put(tick, tick)
        for seq, delay in enumerate(delays[: tick + 1]):
            if delay is not None and seq + 1 + math.ceil(delay / DT - 1e-9) <= tick:
                expected = max(expected, seq)
        taken = box.take(tick)
        used = used if taken is None else taken
        assert used == expected


def test_a_message_that_the_emulated_link_loses_still_counts_as_received_from_the_wire() -> None:
    box: Mailbox[str] = Mailbox(Fates([None]), "feedback", DT, nominal=1)
    box.put(0, "a")
    assert box.newest_seen == 0
    assert box.take(5) is None
