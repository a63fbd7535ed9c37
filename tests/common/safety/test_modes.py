from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import LocalProtocolError
from common.safety.modes import LATCHED, MEANING, TURNS, Cause, Mode, Safety, Turn, mermaid

CAUSE = Cause("limit", "too far", 1.0, "slave")


def silent(_before: Mode, _turn: Turn, _after: Mode) -> None:
    pass


def safety_after(*turns: Turn) -> Safety:
    safety = Safety(silent)
    for turn in turns:
        safety.take(turn)
    return safety


def test_every_safety_mode_is_reachable_and_every_transition_is_documented() -> None:
    found, frontier = {Mode.IDLE}, [Mode.IDLE]
    while frontier:
        new = set(TURNS[frontier.pop()].values()) - found
        found |= new
        frontier += new
    assert found == set(Mode) == set(TURNS)
    assert {turn for row in TURNS.values() for turn in row} == set(Turn) == set(MEANING)


def test_an_emergency_stop_is_possible_from_every_other_mode() -> None:
    for mode in set(Mode) - {Mode.EMERGENCY_STOP}:
        assert TURNS[mode][Turn.EMERGENCY] is Mode.EMERGENCY_STOP


def test_only_a_reset_leaves_a_latched_mode() -> None:
    for mode in LATCHED:
        assert set(TURNS[mode]) <= {Turn.RESET, Turn.EMERGENCY}
        assert TURNS[mode][Turn.RESET] is Mode.IDLE


def test_a_moving_rig_ramps_to_rest_after_a_trip_or_the_end() -> None:
    for mode in (Mode.RUNNING, Mode.HOLDING):
        assert TURNS[mode][Turn.TRIP] is TURNS[mode][Turn.END] is Mode.RAMPING


def test_the_modes_of_a_test_follow_in_order_from_configure_to_idle() -> None:
    told: list[tuple[Mode, Turn, Mode]] = []
    safety = Safety(lambda *turn: told.append(turn))
    for turn in (Turn.CONFIGURE, Turn.ARM, Turn.RUN, Turn.HOLD, Turn.RESUME, Turn.END):
        safety.take(turn)
    assert safety.moving
    safety.at_rest()
    assert safety.mode is Mode.IDLE
    assert [after for _, _, after in told][-3:] == [Mode.RUNNING, Mode.RAMPING, Mode.IDLE]


def test_the_first_cause_is_kept_and_its_latched_mode_follows_the_ramp() -> None:
    safety = safety_after(Turn.CONFIGURE, Turn.ARM, Turn.RUN)
    safety.trip(CAUSE)
    safety.trip(CAUSE._replace(code="watchdog"))
    safety.at_rest()
    assert safety.mode is Mode.SAFE
    assert safety.latched
    assert safety.cause == CAUSE


def test_a_trip_during_the_ramp_after_an_orderly_end_is_latched() -> None:
    safety = safety_after(Turn.CONFIGURE, Turn.ARM, Turn.RUN, Turn.END)
    safety.trip(CAUSE)
    safety.at_rest()
    assert safety.mode is Mode.SAFE


def test_only_the_reset_method_resets_and_it_clears_the_cause() -> None:
    safety = safety_after(Turn.CONFIGURE, Turn.ARM)
    safety.trip(CAUSE)
    assert safety.mode is Mode.SAFE
    with pytest.raises(LocalProtocolError):
        safety.take(Turn.RESET)
    safety.reset()
    assert (safety.mode, safety.cause) == (Mode.IDLE, None)


def test_an_operators_key_that_is_held_repeated_or_replayed_counts_as_one_press() -> None:
    safety = Safety(silent)
    assert safety.pressed(5)
    assert not safety.pressed(5)
    assert safety.pressed(6)
    assert not safety.pressed(5)


@given(st.lists(st.sampled_from(Turn)))
def test_only_transitions_of_the_table_change_the_mode(turns: list[Turn]) -> None:
    safety = Safety(silent)
    for turn in turns:
        before = safety.mode
        if turn in TURNS[before]:
            safety.take(turn)
            assert safety.mode is TURNS[before][turn]
        else:
            with pytest.raises(LocalProtocolError):
                safety.take(turn)
            assert safety.mode is before


def test_the_state_diagram_has_every_transition() -> None:
    lines = mermaid().splitlines()
    assert lines[0] == "stateDiagram-v2"
    assert sum(" --> " in line and ": " in line for line in lines) == sum(map(len, TURNS.values()))
