from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from common.clock_offset import ClockOffset

MS = 1_000_000


def exchanges(offset: int, forward: list[int], back: list[int], drift_ppm: float = 0.0) -> ClockOffset:
    estimate = ClockOffset()
    t = 0
    for there, here in zip(forward, back, strict=True):
        other = offset + round(t * drift_ppm * 1e-6)
        estimate.add(t, t + there + other, t + there + other + 10, t + there + 10 + here)
        t += 2 * MS
    return estimate


@given(
    st.integers(-(10**12), 10**12), st.lists(st.tuples(st.integers(1, MS), st.integers(1, MS)), min_size=1)
)
def test_the_error_never_exceeds_the_bound(offset: int, delays: list[tuple[int, int]]) -> None:
    estimate = exchanges(offset, [there for there, _ in delays], [here for _, here in delays])
    assert abs(estimate.offset - offset) <= estimate.bound + 1


def test_one_quick_exchange_is_enough() -> None:
    estimate = exchanges(10**9, [900_000, 50_000, 700_000], [100_000, 50_000, 2_000_000])
    assert estimate.offset == 10**9
    assert estimate.bound == 50_000


def test_a_drifting_clock_is_followed() -> None:
    random = np.random.default_rng(3)
    delays = random.integers(40_000, 60_000, size=(2, 20_000))
    estimate = exchanges(10**9, delays[0].tolist(), delays[1].tolist(), drift_ppm=50.0)
    truth = 10**9 + round(20_000 * 2 * MS * 50e-6)
    assert abs(estimate.offset - truth) < 60_000  # two milliseconds have been drifted by then


def test_nothing_is_known_before_the_first_exchange() -> None:
    assert (ClockOffset().offset, ClockOffset().bound) == (0, 0)
