"""Schedules of faults are drawn, written and read."""

from __future__ import annotations

import pytest

from common.errors import InputError
from validation.faults.schedule import KINDS, InjectedFault, Schedule, draw, parse

MANY = 300


def test_a_schedule_is_the_same_after_being_written_and_read() -> None:
    for seed in range(MANY):
        for recorded in (False, True):
            schedule = draw(seed, recorded=recorded)
            assert parse(str(schedule)) == schedule
            assert "\n" not in str(schedule)


def test_the_same_seed_gives_the_same_schedule_and_all_kinds_of_faults_occur() -> None:
    schedules = [draw(seed) for seed in range(MANY)]
    assert schedules == [draw(seed) for seed in range(MANY)]
    assert {fault.kind for one in schedules for fault in one.faults} == set(KINDS)
    assert {one.slaves for one in schedules} == {1, 2}
    assert any(not one.faults for one in schedules)
    assert all(10.0 <= one.duration <= 60.0 for one in schedules)
    assert {fault.where for one in schedules for fault in one.faults} >= {"master", "slave", "master<>slave"}
    assert any("recorder" in str(draw(seed, recorded=True)) for seed in range(20))


def test_a_given_duration_moves_the_faults_into_it() -> None:
    for seed in range(20):
        schedule = draw(seed, 5.0)
        assert schedule.duration == 5.0
        assert all(fault.at <= 5.0 for fault in schedule.faults)


def test_a_schedule_may_be_written_by_hand() -> None:
    found = parse("seed=3 duration=2 outage@0.5+0.1:master>slave loss@1+1:master<>slave(loss=0.1)")
    outage = InjectedFault("outage", "master>slave", 0.5, 0.1)
    loss = InjectedFault("loss", "master<>slave", 1.0, 1.0, {"loss": 0.1})
    assert found == Schedule(3, 2.0, faults=(outage, loss))


@pytest.mark.parametrize(
    ("line", "part"),
    [
        ("duration=2", "has no seed"),
        ("seed=1 nonsense", "is not a fault"),
        ("seed=1 stal@1+1:slave", "did you mean stall"),
        ("seed=1 stall@1+1:roof", "names no place"),
        ("seed=1 stall@1+1:recorder", "names no place"),
        ("seed=1 recorded=1 nan@1+1:recorder(place=1)", "names no place"),
        ("seed=1 outage@1+1:slave", "names no place"),
        ("seed=1 loss@1+1:master>slave", "the values loss, and no others"),
        ("seed=1 loss@1+1:master>slave(loss=nan)", "is not a number"),
        ("seed=1 slaves=3", "1 or 2 slaves"),
        ("seed=x", "is not a number"),
    ],
)
def test_a_wrong_schedule_is_refused_in_one_sentence(line: str, part: str) -> None:
    with pytest.raises(InputError, match=part):
        parse(line)
