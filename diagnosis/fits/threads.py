"""Work that is shared out among threads: kernels release the interpreter's lock while they run."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

WORKERS = 2
Given = TypeVar("Given")
Found = TypeVar("Found")

_here = threading.local()


def each(work: Callable[[Given], Found], items: Iterable[Given]) -> list[Found]:
    """What `work` makes of every item, in their order.

    The threads of one call share its items out; what these share out again, each thread does by itself.
    """
    given = list(items)
    if len(given) < 2 or getattr(_here, "shared", False):
        return [work(item) for item in given]
    with ThreadPoolExecutor(WORKERS, initializer=mark) as pool:
        return list(pool.map(work, given))


@contextmanager
def unshared() -> Iterator[None]:
    """While it lasts `each` shares nothing out: for work so short that threads would wait for each other."""
    before = getattr(_here, "shared", False)
    mark()
    try:
        yield
    finally:
        _here.shared = before


def mark() -> None:
    """Mark a thread as one of several that share items out."""
    _here.shared = True
