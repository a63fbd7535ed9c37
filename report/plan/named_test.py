"""What a plan says of its test by itself, before anything is computed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from common.plan.plan import Plan


def of_test(plan: Plan, file: Path) -> dict[str, Any]:
    """The entries of `rths check` on the file, the name and the length of a test."""
    return {
        "plan": str(file),
        "digest": plan.digest(),
        "test": plan.test.name,
        "duration": plan.test.duration,
        "interval": plan.test.interval,
        "ticks": plan.ticks,
    }
