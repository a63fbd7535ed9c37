from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import LocalProtocolError, RemoteProtocolError
from common.protocol.exchange import FINAL, TRANSITIONS, Event, Exchange, State


def reachable() -> set[State]:
    found, frontier = {State.IDLE}, [State.IDLE]
    while frontier:
        for state in TRANSITIONS[frontier.pop()].values():
            if state not in found:
                found.add(state)
                frontier.append(state)
    return found


def test_every_state_of_the_exchange_is_reachable() -> None:
    assert set(TRANSITIONS) == set(State)
    assert reachable() == set(State)


def test_every_state_that_is_not_final_allows_trip_loss_and_stop() -> None:
    for state in set(State) - FINAL:
        assert TRANSITIONS[state][Event.TRIP] is State.TRIPPED
        assert TRANSITIONS[state][Event.LOSE] is State.LOST
        assert Event.STOP in TRANSITIONS[state] or state is State.STOPPING
    assert {State.DONE, State.REFUSED, State.TRIPPED, State.LOST} == FINAL


def test_the_states_of_a_completed_test_follow_in_order() -> None:
    exchange = Exchange()
    course = [Event.REGISTER, Event.ARM, Event.SCHEDULE, Event.RUN, Event.STOP, Event.FINISH]
    for event in course:
        exchange.happen(event)
    assert exchange.state is State.DONE
    assert exchange.ended


def test_an_error_tells_a_local_from_a_remote_fault() -> None:
    with pytest.raises(LocalProtocolError, match="'run' is not allowed in the state 'idle'"):
        Exchange().happen(Event.RUN)
    with pytest.raises(RemoteProtocolError):
        Exchange().happen(Event.RUN, remote=True)


@given(st.lists(st.sampled_from(Event)))
def test_the_first_cause_is_kept_and_final_states_are_latched(events: list[Event]) -> None:
    exchange = Exchange()
    first = ""
    for number, event in enumerate(events):
        if not exchange.allows(event):
            with pytest.raises(LocalProtocolError):
                exchange.happen(event)
            continue
        assert exchange.state not in FINAL
        exchange.happen(event, cause=f"cause {number}")
        first = first or f"cause {number}"
    assert exchange.cause == first


@given(st.lists(st.integers(0, 50)))
def test_a_frame_is_fresh_only_if_it_is_newer_than_all_before(seqs: list[int]) -> None:
    exchange = Exchange()
    newest = -1
    for seq in seqs:
        assert exchange.fresh(seq) is (seq > newest)
        newest = max(newest, seq)


def test_no_message_belongs_to_a_laboratory_without_session() -> None:
    exchange = Exchange()
    assert not exchange.belongs(0)
    exchange.session = 5
    assert exchange.belongs(5)
    assert not exchange.belongs(6)
