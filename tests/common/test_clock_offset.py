from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.host.clock_offset import ClockOffset

US, MS, S = 1_000, 1_000_000, 1_000_000_000
YEAR = 365 * 86_400 * S
PPM = st.integers(-200, 200)
EXCHANGES = st.lists(  # there, held, back, pause, drift from then on
    st.tuples(st.integers(0, MS), st.integers(0, 2 * MS), st.integers(0, MS), st.integers(0, 50 * MS), PPM),
    min_size=1,
    max_size=60,
)
Delays = Callable[[int], tuple[int, int]]


class Clocks:
    """Two clocks in whole numbers; the offset in millionths of a ns, so that ppm of whole ns are exact."""

    def __init__(self, offset: int = 0, ppm: int = 0, own: int = 0) -> None:
        self.own, self.ppm, self.millionths = own, ppm, offset * 1_000_000

    def elapse(self, ns: int) -> None:
        self.own += ns
        self.millionths += ns * self.ppm

    def other(self) -> int:
        return self.own + (self.millionths + 500_000) // 1_000_000

    def exchange(self, there: int, held: int, back: int) -> tuple[int, int, int, int]:
        t1 = self.own
        self.elapse(there)
        t2 = self.other()
        self.elapse(held)
        t3 = self.other()
        self.elapse(back)
        return t1, t2, t3, self.own

    def error(self, estimate: ClockOffset) -> float:
        return (estimate.at(self.own) * 1_000_000 - self.millionths) * 1e-6

    def is_within_bound(self, estimate: ClockOffset) -> bool:
        error = estimate.at(self.own) * 1_000_000 - self.millionths
        return abs(error) <= estimate.bound_at(self.own) * 1_000_000


def scattered(seed: int = 3) -> Delays:
    random = np.random.default_rng(seed)
    pool = random.integers(40 * US, 60 * US, size=(30_000, 2)).tolist()
    return lambda _: tuple(pool.pop())


def run(
    clocks: Clocks, estimate: ClockOffset, delays: Delays, *, ticks: int, handshake: int = 200
) -> Iterator[int]:
    """A handshake, a quarter of a second of silence, an exchange every 2 ms; yields times since the start."""
    start = clocks.own
    for number in range(handshake + ticks):
        there, back = delays(clocks.own - start)
        begin = clocks.own
        estimate.add(*clocks.exchange(there, 100 * US, back))
        yield clocks.own - start
        if number >= handshake:
            clocks.elapse(2 * MS - (clocks.own - begin))
        elif number == handshake - 1:
            clocks.elapse(250 * MS)
        yield clocks.own - start


@given(st.integers(-(10**12), 10**12), st.integers(0, YEAR), PPM, EXCHANGES, st.booleans())
def test_the_error_of_the_clock_offset_never_exceeds_its_bound(
    offset: int, own: int, ppm: int, exchanges: list[tuple[int, ...]], wandering: bool
) -> None:
    clocks, estimate = Clocks(offset, ppm, own), ClockOffset(length=4, blocks=5)
    for there, held, back, pause, then in exchanges:
        estimate.add(*clocks.exchange(there, held, back))
        assert clocks.is_within_bound(estimate)
        assert (estimate.offset, estimate.bound) == (estimate.at(clocks.own), estimate.bound_at(clocks.own))
        clocks.elapse(pause)
        assert clocks.is_within_bound(estimate)
        clocks.ppm = then if wandering else ppm


@given(st.integers(-(10**12), 10**12), EXCHANGES)
def test_the_bound_with_blocks_of_one_is_never_wider_than_the_newest_round_trip(
    offset: int, exchanges: list[tuple[int, ...]]
) -> None:
    clocks, estimate = Clocks(offset), ClockOffset(length=1)
    for there, held, back, pause, _ in exchanges:
        estimate.add(*clocks.exchange(there, held, back))
        # the value may sit at one edge of the interval, and a drift would have shown in the time held
        assert estimate.bound <= there + back + (there + held + back) * 200e-6 * 2 + 4
        clocks.elapse(pause)


def test_the_estimate_is_zero_before_the_first_exchange() -> None:
    estimate = ClockOffset()
    assert (estimate.offset, estimate.bound, estimate.drift) == (0, 0, 0.0)
    assert (estimate.at(YEAR), estimate.bound_at(YEAR)) == (0, 0)


def test_one_fast_exchange_gives_a_tight_estimate() -> None:
    clocks, estimate = Clocks(S), ClockOffset()
    for there, back in ((900, 100), (50, 50), (700, 2000)):
        estimate.add(*clocks.exchange(there * US, 10, back * US))
    assert estimate.offset == S
    assert 50 * US <= estimate.bound < 51 * US


def test_the_bound_grows_with_the_age_of_the_newest_exchange() -> None:
    clocks, estimate = Clocks(S), ClockOffset()
    estimate.add(*clocks.exchange(50 * US, 0, 50 * US))
    assert estimate.bound_at(clocks.own + S) - estimate.bound == pytest.approx(200 * US, abs=2)


@pytest.mark.parametrize("ppm", [-100, 0, 50, 100])
def test_a_drifting_clock_is_followed(ppm: int) -> None:
    clocks, estimate, late = Clocks(S, ppm), ClockOffset(), []
    for t in run(clocks, estimate, scattered(), ticks=20_000):
        error = abs(clocks.error(estimate))
        assert error < (15 * US if t > S else 60 * US)
        assert clocks.is_within_bound(estimate)
        if t > S:
            late.append(estimate.bound_at(clocks.own))
    assert estimate.drift == pytest.approx(ppm * 1e-6, abs=10e-6)
    assert 40 * US <= min(late) <= max(late) < 80 * US  # 40 µs is half the shortest round trip


@pytest.mark.parametrize("ways", [(50, 1), (1, 50)])
@pytest.mark.parametrize("ppm", [0, 100])
def test_a_second_of_congestion_does_not_change_the_estimated_drift(ways: tuple[int, int], ppm: int) -> None:
    usual = scattered()

    def delays(t: int) -> tuple[int, int]:
        there, back = usual(t)
        return (there * ways[0], back * ways[1]) if 4 * S < t < 5 * S else (there, back)

    clocks, estimate = Clocks(S, ppm), ClockOffset()
    for t in run(clocks, estimate, delays, ticks=4_500):
        assert clocks.is_within_bound(estimate)
        if t > S:
            assert abs(clocks.error(estimate)) < 20 * US


def test_a_change_of_drift_is_followed_within_the_window() -> None:
    clocks, estimate = Clocks(S, 50), ClockOffset()
    for t in run(clocks, estimate, scattered(), ticks=12_500):
        if t > 20 * S:
            clocks.ppm = -50
        assert clocks.is_within_bound(estimate)
        if t > S:
            assert abs(clocks.error(estimate)) < (50 * US if 20 * S < t < 22.2 * S else 15 * US)
    assert estimate.drift == pytest.approx(-50e-6, abs=10e-6)


def test_an_asymmetric_delay_gives_an_error_of_half_the_difference_within_the_bound() -> None:
    clocks, estimate = Clocks(S), ClockOffset()
    for _ in run(clocks, estimate, lambda _: (90 * US, 30 * US), ticks=2_000):
        assert clocks.error(estimate) == 30 * US
        assert clocks.is_within_bound(estimate)
    assert estimate.drift == 0.0


@pytest.mark.parametrize("ppm", [0, 37])
def test_large_time_stamps_lose_no_precision(ppm: int) -> None:
    clocks = Clocks(0, ppm), Clocks(-YEAR // 2 - 1, ppm, YEAR + 7)
    estimates = ClockOffset(), ClockOffset()
    runs = [run(pair, each, scattered(), ticks=3_000) for pair, each in zip(clocks, estimates, strict=True)]
    for t, _ in zip(*runs, strict=True):
        small, large = (each.at(pair.own) for pair, each in zip(clocks, estimates, strict=True))
        assert abs(large - small + YEAR // 2 + 1) <= 2, t


def test_exchanges_without_delay_give_the_offset_to_the_nanosecond() -> None:
    clocks, estimate = Clocks(S), ClockOffset()
    for _ in run(clocks, estimate, lambda _: (0, 0), ticks=1_000):
        assert clocks.error(estimate) == 0.0


def test_a_clock_that_is_set_anew_is_followed_at_once() -> None:
    clocks, estimate = Clocks(S, 20), ClockOffset()
    for _ in run(clocks, estimate, scattered(), ticks=1_000):
        pass
    clocks.millionths += 10 * MS * 1_000_000
    for number, _ in enumerate(run(clocks, estimate, scattered(4), ticks=1_500, handshake=0)):
        if number > 2 * 50:  # two steps per exchange: a block has begun since
            assert clocks.is_within_bound(estimate)
            assert abs(clocks.error(estimate)) < 80 * US
    assert abs(clocks.error(estimate)) < 15 * US


def test_a_drift_larger_than_the_assumed_one_is_followed() -> None:
    clocks, estimate = Clocks(S, 500), ClockOffset()
    for t in run(clocks, estimate, scattered(), ticks=5_000):
        if t > 2 * S:
            # half a round trip, and 300 ppm too much for as long as it takes to see a block's minimum
            assert abs(clocks.error(estimate)) < (45 + 300e-6 * 200_000) * US
    assert estimate.drift == pytest.approx(500e-6, abs=20e-6)


def test_an_exchange_with_a_negative_round_trip_is_ignored() -> None:
    clock = ClockOffset(length=5, blocks=4)
    for k in range(40):
        late = 10**9 if k >= 20 else 0  # the other end's second stamp lies in the future
        clock.add(k * 10**6, k * 10**6 + 1050, k * 10**6 + 1060 + late, k * 10**6 + 110)
    assert clock.offset == 1000
    assert clock.bound_at(40 * 10**6) > clock.bound_at(20 * 10**6)
