"""Work that is shared out among threads: kernels release the interpreter's lock while they run."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

WORKERS = 2  # threads that work at a time
Given = TypeVar("Given")
Found = TypeVar("Found")

_here = threading.local()
_idle = threading.Semaphore(WORKERS - 1)  # how many more threads may work


def each(work: Callable[[Given], Found], items: Iterable[Given]) -> list[Found]:
    """What `work` makes of every item, in their order.

    A second thread takes items as soon as fewer than `WORKERS` work, also of what an item shares out again: fits last
    unequally long, so that one is left at the end, whose slopes the idle thread then computes.
    """
    given = list(items)
    if len(given) < 2 or getattr(_here, "unshared", False):
        return [work(item) for item in given]
    left, found = deque(enumerate(given)), dict[int, Found]()

    def help_out() -> None:
        try:
            take(work, left, found)
        finally:
            _idle.release()

    with ThreadPoolExecutor(1) as pool:
        helper: Future[None] | None = None

        def called() -> None:
            nonlocal helper
            if helper is None and left and _idle.acquire(blocking=False):
                helper = pool.submit(help_out)

        try:
            take(work, left, found, called)
        finally:
            left.clear()
            if helper is not None:
                awaited(helper)
    return [found[place] for place in range(len(given))]


def take(
    work: Callable[[Given], Found],
    left: deque[tuple[int, Given]],
    found: dict[int, Found],
    before: Callable[[], None] = lambda: None,
) -> None:
    """Do what is left until nothing is; `before` is called when an item was taken and is not begun."""
    while left:
        try:
            place, item = left.popleft()
        except IndexError:  # another thread took the last one
            return
        before()
        found[place] = work(item)


def awaited(helper: Future[None]) -> None:
    """Wait for the end of another thread's work; meanwhile one more may work."""
    _idle.release()
    try:
        helper.result()
    finally:
        _idle.acquire()


@contextmanager
def unshared() -> Iterator[None]:
    """While it lasts `each` shares nothing out: for work so short that threads would wait for each other."""
    before = getattr(_here, "unshared", False)
    _here.unshared = True
    try:
        yield
    finally:
        _here.unshared = before
