"""The scheduler of simulated processes: order, clocks, waiting, pauses, and ends."""

from __future__ import annotations

import gc
import sys

import pytest

from simulation.world import Drift, Process, World

MS = 1_000_000


def world(limit_s: float = 10.0) -> World:
    return World(round(limit_s * 1e9))


def test_events_at_the_same_time_happen_in_the_order_in_which_they_were_scheduled() -> None:
    one = world()
    found: list[str] = []
    process = one.process("any")
    process.start(lambda: process.sleep_until(MS))
    for name in "abc":
        one.at(MS // 2, found.append, name)
    one.at(MS // 4, found.append, "first")
    one.run()
    assert found == ["first", "a", "b", "c"]


def test_two_processes_take_turns_by_time() -> None:
    one, found = world(), []

    def body(process: Process, period: int) -> None:
        for step in range(1, 4):
            process.sleep_until(step * period)
            found.append((one.time, process.name))

    for name, period in (("slow", 3 * MS), ("quick", 2 * MS)):
        process = one.process(name)
        process.start(lambda process=process, period=period: body(process, period))  # type: ignore[misc]
    one.run()
    assert [name for _, name in found] == ["quick", "slow", "quick", "slow", "quick", "slow"]
    assert [time // MS for time, _ in found] == [2, 3, 4, 6, 6, 9]


@pytest.mark.parametrize("ppb", [0, 100_000, -100_000, 1])
def test_a_clock_drifts_and_sleeps_by_its_own_time(ppb: int) -> None:
    one = world(3000.0)
    process = one.process("any", Drift(5_000 * MS, ppb))
    shown: list[int] = []

    def body() -> None:
        process.sleep_until(5_000 * MS + 1_000_000 * MS)
        shown.append(process.now())

    process.start(body)
    one.run()
    assert 0 <= shown[0] - 1_005_000 * MS <= 1
    assert one.time == pytest.approx(1_000_000 * MS / (1.0 + ppb * 1e-9), abs=2)


def test_a_pause_delays_what_was_due_in_it() -> None:
    one, found = world(), []
    process = one.process("any")

    def body() -> None:
        for step in range(1, 7):
            process.sleep_until(step * 2 * MS)
            found.append(one.time // MS)

    process.start(body)
    one.at(3 * MS, process.stall, 6 * MS)
    one.run()
    assert found == [2, 9, 9, 9, 10, 12]


def test_computation_takes_its_time_before_the_next_wait() -> None:
    one = world()
    process = one.process("any")
    seen: list[int] = []

    def body() -> None:
        process.spend(3 * MS)
        seen.append(process.now())
        process.sleep_until(2 * MS)
        seen.append(one.time)

    process.start(body)
    one.run()
    assert seen == [3 * MS, 3 * MS]


def test_a_killed_process_does_nothing_more_and_the_simulation_goes_on() -> None:
    one, found = world(), []

    def body(process: Process) -> None:
        for step in range(1, 5):
            process.sleep_until(step * MS)
            found.append((process.name, step))

    for name in ("dies", "lives"):
        process = one.process(name)
        process.start(lambda process=process: body(process))  # type: ignore[misc]
    one.at(2 * MS + 1, one.processes["dies"].kill)
    one.run()
    assert [step for name, step in found if name == "dies"] == [1, 2]
    assert [step for name, step in found if name == "lives"] == [1, 2, 3, 4]
    assert one.processes["dies"].killed
    assert one.processes["lives"].ended
    assert not one.processes["lives"].killed


def test_an_exception_is_kept_and_a_process_that_hangs_is_abandoned_at_the_limit() -> None:
    one = world(0.01)
    broken, hangs = one.process("broken"), one.process("hangs")

    def fail() -> None:
        raise ValueError("no")

    def forever() -> None:
        while True:
            hangs.sleep_until(hangs.now() + MS)

    broken.start(fail)
    hangs.start(forever)
    one.run()
    assert isinstance(broken.error, ValueError)
    assert broken.ended
    assert not hangs.ended
    assert hangs.error is None
    assert one.time <= one.limit


def test_the_interpreters_settings_are_restored_after_a_simulation() -> None:
    def body() -> None:
        gc.disable()
        sys.setswitchinterval(1e-4)

    gc.enable()  # a command that another test called may have left it off
    interval, frozen = sys.getswitchinterval(), gc.get_freeze_count()
    one = world()
    one.process("any").start(body)
    one.run()
    assert gc.isenabled()
    assert sys.getswitchinterval() == interval
    assert gc.get_freeze_count() <= frozen


def test_a_simulation_that_pauses_continues_where_it_was() -> None:
    one, found = world(), []
    process = one.process("any")

    def body() -> None:
        for step in range(1, 5):
            process.sleep_until(step * MS)
            found.append(step)

    process.start(body)
    one.at(3 * MS // 2, lambda: None)  # something to stop at
    one.run(lambda: len(found) >= 1)
    assert found == [1]
    assert process.started
    assert not process.ended
    one.run()
    assert found == [1, 2, 3, 4]
    assert process.ended


def test_a_wait_for_a_message_ends_with_the_message_or_after_its_timeout() -> None:
    one, found = world(), []
    hears, sends = one.process("hears"), one.process("sends")

    def hearing() -> None:
        for _ in range(2):
            hears.listen(5 * MS)
            found.append(one.time // MS)

    def sending() -> None:
        sends.sleep_until(2 * MS)
        hears.wake()

    hears.start(hearing)
    sends.start(sending)
    one.run()
    assert found == [2, 7]
