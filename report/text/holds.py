"""The holds of a test in sentences."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any


def sentences(holds: Iterable[Mapping[str, Any]]) -> list[str]:
    """One sentence for each hold of a summary."""
    found = []
    for hold in holds:
        lasted = (
            "until its end" if hold["duration"] is None else f"for {hold['duration']:.3f} s with its ramps"
        )
        found.append(
            f"The test was held at t {hold['t']:.3f} s {lasted}; the earthquake's time stood still at "
            f"{hold['earthquake_time']:.3f} s."
        )
    return found
