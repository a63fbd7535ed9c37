"""When late ticks are reported, and how often."""

from __future__ import annotations

from common.host.lateness import CALM, MOST, WINDOW, LateTicks, sentence


def told(late: set[int], ticks: int) -> list[tuple[int, int]]:
    """The tick and the count of every warning."""
    watch = LateTicks()
    found = [(tick, watch.take(tick, late=tick in late)) for tick in range(ticks)]
    return [(tick, count) for tick, count in found if count]


def test_one_pause_of_50_ms_gives_no_warning() -> None:
    assert told(set(range(400, 425)), 5 * WINDOW) == []


def test_one_late_tick_more_than_preflight_accepts_gives_a_warning() -> None:
    assert told(set(range(MOST)), WINDOW) == []
    assert told(set(range(MOST + 1)), WINDOW) == [(MOST, MOST + 1)]


def test_late_ticks_count_for_a_window_only() -> None:
    spread = set(range(0, 20 * WINDOW, WINDOW // MOST))
    assert told(spread, 20 * WINDOW) == []


def test_a_run_that_is_always_late_gives_one_warning() -> None:
    assert told(set(range(6000)), 6000) == [(MOST, MOST + 1)]


def test_a_second_late_episode_after_a_calm_one_gives_a_second_warning() -> None:
    first, soon = set(range(100)), set(range(3000, 3100))
    later = set(range(3100 + CALM + WINDOW, 3200 + CALM + WINDOW))
    assert [tick for tick, _ in told(first | soon | later, 20_000)] == [MOST, 3100 + CALM + WINDOW + MOST]


def test_the_warning_states_count_window_and_worst_lateness() -> None:
    assert sentence(51).startswith("51 of the last 1000 ticks came late, more than the 50 ")
