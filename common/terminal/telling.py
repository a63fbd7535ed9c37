"""Progress reports of long work."""

from __future__ import annotations

from collections.abc import Callable

Tell = Callable[
    [str, int, int], None
]  # name of the work, how much of it is done, and of how much (0: unknown)


def untold(_what: str, _done: int, _total: int) -> None:
    """Discard a report."""
