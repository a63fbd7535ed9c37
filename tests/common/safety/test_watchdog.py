from __future__ import annotations

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from common.plan.tables import SafetyTable
from common.safety.watchdog import Watchdog, WatchdogFinding

PLAN = SafetyTable(hold_after=3, ramp_after=5)


def started(safety: SafetyTable = PLAN) -> Watchdog:
    watchdog = Watchdog(safety, 0.002)
    assert watchdog.look(0, 0, 0) is WatchdogFinding.FINE
    return watchdog


def test_the_watchdog_holds_after_three_and_ramps_after_five_intervals_of_silence() -> None:
    watchdog = started()
    found = [watchdog.look(tick, 0, 0) for tick in range(1, 6)]
    assert found == [
        WatchdogFinding.FINE,
        WatchdogFinding.FINE,
        WatchdogFinding.HOLD,
        WatchdogFinding.HOLD,
        WatchdogFinding.RAMP,
    ]


def test_a_fresh_message_restarts_the_watchdogs_count() -> None:
    watchdog = started()
    for tick in range(1, 5):
        watchdog.look(tick, 0, 0)
    assert watchdog.look(5, 5, 5) is WatchdogFinding.FINE
    assert [watchdog.look(tick, 5, 5) for tick in range(6, 9)][-1] is WatchdogFinding.HOLD


def test_a_peer_that_sends_but_does_not_receive_counts_as_silent() -> None:
    watchdog = started()
    found = [watchdog.look(tick, tick, 0) for tick in range(1, 8)]
    assert found.index(WatchdogFinding.HOLD) == 4
    assert (
        found.index(WatchdogFinding.RAMP) == 6
    )  # a round trip of two intervals later than one who says nothing


def test_a_constant_delay_below_the_message_age_is_not_silence() -> None:
    watchdog = Watchdog(PLAN, 0.002)
    found = [watchdog.look(tick, tick - 20, tick - 20) for tick in range(200)]
    assert set(found) == {WatchdogFinding.FINE}


def test_messages_older_than_the_message_age_count_as_silence() -> None:
    watchdog = Watchdog(replace(PLAN, message_age=0.02), 0.002)
    found = [watchdog.look(tick, tick - 11, tick - 11) for tick in range(30)]
    assert found.index(WatchdogFinding.RAMP) == 9


@given(st.lists(st.booleans(), max_size=60))
def test_the_watchdog_ramps_exactly_when_five_messages_in_a_row_are_missing(there: list[bool]) -> None:
    watchdog, newest, run = started(), 0, 0
    for tick, came in enumerate(there, start=1):
        newest, run = (tick, 0) if came else (newest, run + 1)
        assert (watchdog.look(tick, newest, newest) is WatchdogFinding.RAMP) == (run >= 5)


@given(st.lists(st.booleans(), max_size=60))
def test_an_echo_that_stays_the_same_for_seven_intervals_counts_as_silence(heard: list[bool]) -> None:
    watchdog, echo, run = started(), 0, 0
    for tick, came in enumerate(heard, start=1):
        echo, run = (tick, 0) if came else (echo, run + 1)
        assert (watchdog.look(tick, tick, echo) is WatchdogFinding.RAMP) == (run >= 7)
