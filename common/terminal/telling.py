"""Progress reports of long work."""

from __future__ import annotations

from collections.abc import Callable

Tell = Callable[[str, int, int], None]  # what is being done, how much of it is done, of how much (0: unknown)


def untold(_what: str, _done: int, _total: int) -> None:
    """Discard a report."""
