"""The function by which a process reports a running test: it takes the kind of a report and its data by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Report = Callable[[str, Mapping[str, Any]], None]


def silent(_kind: str, _data: Mapping[str, Any]) -> None:
    """Discard a report."""
