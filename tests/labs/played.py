"""A test played in virtual time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from common.plan.plan import Plan
from common.reality import reality
from common.reality.reality import Reality
from common.recording.reader import read
from common.recording.run import Run
from simulation import virtual
from simulation.virtual import VirtualTest


def run(plan: Plan, path: Path, real: Reality | None = None) -> tuple[Run, Any, VirtualTest]:
    """The recording of a test, the error that ended it, and its loops; without a reality they are as planned."""
    bench = virtual.assemble(plan, real or reality.as_planned(plan), path)
    error = virtual.run(bench, lambda: "")
    return read(path), error, bench
