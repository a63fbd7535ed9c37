from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import LocalProtocolError
from common.safety.modes import LATCHED, MEANING, TURNS, Cause, Mode, Safety, Turn, mermaid

CAUSE = Cause("limit", "too far", 1.0, "slave")


def silent(_before: Mode, _turn: Turn, _after: Mode) -> None:
    pass


def brought_to(*turns: Turn) -> Safety:
    safety = Safety(silent)
    for turn in turns:
        safety.take(turn)
    return safety


def test_every_mode_is_in_the_table_reachable_and_every_turn_explained() -> None:
    found, frontier = {Mode.IDLE}, [Mode.IDLE]
    while frontier:
        new = set(TURNS[frontier.pop()].values()) - found
        found |= new
        frontier += new
    assert found == set(Mode) == set(TURNS)
    assert {turn for row in TURNS.values() for turn in row} == set(Turn) == set(MEANING)


def test_an_emergency_stop_is_possible_everywhere_but_in_itself() -> None:
    for mode in set(Mode) - {Mode.EMERGENCY_STOP}:
        assert TURNS[mode][Turn.EMERGENCY] is Mode.EMERGENCY_STOP


def test_a_latched_mode_is_left_by_a_reset_alone() -> None:
    for mode in LATCHED:
        assert set(TURNS[mode]) <= {Turn.RESET, Turn.EMERGENCY}
        assert TURNS[mode][Turn.RESET] is Mode.IDLE


def test_a_moving_rig_never_stops_by_a_jump_to_safe() -> None:
    for mode in (Mode.RUNNING, Mode.HOLDING):
        assert TURNS[mode][Turn.TRIP] is TURNS[mode][Turn.END] is Mode.RAMPING


def test_the_course_of_a_test() -> None:
    told: list[tuple[Mode, Turn, Mode]] = []
    safety = Safety(lambda *turn: told.append(turn))
    for turn in (Turn.CONFIGURE, Turn.ARM, Turn.RUN, Turn.HOLD, Turn.RESUME, Turn.END):
        safety.take(turn)
    assert safety.moving
    safety.at_rest()
    assert safety.mode is Mode.IDLE
    assert [after for _, _, after in told][-3:] == [Mode.RUNNING, Mode.RAMPING, Mode.IDLE]


def test_the_first_cause_stays_and_ends_in_the_latched_mode() -> None:
    safety = brought_to(Turn.CONFIGURE, Turn.ARM, Turn.RUN)
    safety.trip(CAUSE)
    safety.trip(CAUSE._replace(code="watchdog"))
    safety.at_rest()
    assert safety.mode is Mode.SAFE
    assert safety.latched
    assert safety.cause == CAUSE


def test_a_trip_on_the_way_to_rest_after_an_orderly_end_is_latched_too() -> None:
    safety = brought_to(Turn.CONFIGURE, Turn.ARM, Turn.RUN, Turn.END)
    safety.trip(CAUSE)
    safety.at_rest()
    assert safety.mode is Mode.SAFE


def test_reset_needs_to_be_admitted_and_forgets_the_cause() -> None:
    safety = brought_to(Turn.CONFIGURE, Turn.ARM)
    safety.trip(CAUSE)
    assert safety.mode is Mode.SAFE
    with pytest.raises(LocalProtocolError):
        safety.take(Turn.RESET)
    safety.reset()
    assert (safety.mode, safety.cause) == (Mode.IDLE, None)


def test_a_press_that_is_held_repeated_or_replayed_is_one_press() -> None:
    safety = Safety(silent)
    assert safety.pressed(5)
    assert not safety.pressed(5)
    assert safety.pressed(6)
    assert not safety.pressed(5)


@given(st.lists(st.sampled_from(Turn)))
def test_only_what_the_table_has_changes_the_mode(turns: list[Turn]) -> None:
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


def test_the_diagram_has_every_turn() -> None:
    lines = mermaid().splitlines()
    assert lines[0] == "stateDiagram-v2"
    assert sum(" --> " in line and ": " in line for line in lines) == sum(map(len, TURNS.values()))
