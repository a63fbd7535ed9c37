"""What a process reports of a test while it runs: a kind of news, and its data by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Report = Callable[[str, Mapping[str, Any]], None]


def silent(_kind: str, _data: Mapping[str, Any]) -> None:
    """A report that is discarded."""
