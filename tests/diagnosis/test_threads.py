"""Work shared out among threads: its order, and what shares out again within it."""

from __future__ import annotations

import threading
import time

import pytest

from diagnosis.fits.threads import WORKERS, each, unshared


def test_what_is_found_has_the_order_of_the_items() -> None:
    assert each(lambda item: item * item, range(100)) == [item * item for item in range(100)]
    assert each(abs, []) == []


def name(_: int) -> str:
    """The thread that does something short."""
    time.sleep(1e-3)
    return threading.current_thread().name


def test_an_idle_thread_takes_of_what_another_one_shares_out_again() -> None:
    names = each(lambda item: each(name, range(200 * item)), range(2))[1]
    assert len(set(names)) == WORKERS


def test_no_more_threads_work_at_a_time_than_there_are_workers() -> None:
    lock, working, most = threading.Lock(), 0, 0

    def leaf(_: int) -> None:
        nonlocal working, most
        with lock:
            working += 1
            most = max(most, working)
        time.sleep(1e-3)
        with lock:
            working -= 1

    for _ in range(3):
        each(lambda item: each(lambda _: each(leaf, range(3)), range(item)), range(6))
    assert most == WORKERS


def test_what_a_single_item_shares_out_goes_to_threads() -> None:
    meeting = threading.Barrier(WORKERS)

    def inside(_: int) -> list[int]:
        return each(lambda _: meeting.wait(timeout=10.0), range(WORKERS))

    assert sorted(each(inside, range(1))[0]) == list(range(WORKERS))


def test_work_that_is_not_shared_stays_in_its_thread() -> None:
    with unshared():
        assert set(each(name, range(8))) == {threading.current_thread().name}
    assert len(set(each(name, range(100)))) == WORKERS


@pytest.mark.parametrize("bad", range(4))
def test_an_error_of_either_thread_is_raised_and_leaves_all_threads_free(bad: int) -> None:
    def work(item: int) -> int:
        time.sleep(1e-3)
        return 1 // (item - bad)

    with pytest.raises(ZeroDivisionError):
        each(work, range(4))
    assert len(set(each(name, range(100)))) == WORKERS
