"""Work shared out among threads: its order, and what shares out again within it."""

from __future__ import annotations

import threading

from diagnosis.fits.threads import WORKERS, each


def test_what_is_found_has_the_order_of_the_items() -> None:
    assert each(lambda item: item * item, range(100)) == [item * item for item in range(100)]
    assert each(abs, []) == []


def test_a_thread_of_several_shares_nothing_out_again() -> None:
    def inside(_: int) -> set[str]:
        here = threading.current_thread().name
        return {here, *each(lambda _: threading.current_thread().name, range(8))}

    assert all(len(names) == 1 for names in each(inside, range(4)))


def test_what_a_single_item_shares_out_goes_to_threads() -> None:
    meeting = threading.Barrier(WORKERS)

    def inside(_: int) -> list[int]:
        return each(lambda _: meeting.wait(timeout=10.0), range(WORKERS))

    assert sorted(each(inside, range(1))[0]) == list(range(WORKERS))
