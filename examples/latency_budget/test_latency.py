"""A latency test for continuous integration: a short test in real time, judged by the fixture `latency_budget`."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).parent


def test_the_loop_keeps_its_budget(latency_budget: Callable[..., object], tmp_path: Path) -> None:
    """Run 5 s of the default test; fails above the budget, and is skipped on a machine too busy for a verdict."""
    recording = tmp_path / "latency.mcap"
    command = [sys.executable, "-m", "rths", "run", "default", "--duration", "5", "-o", str(recording)]
    subprocess.run(command, check=True)
    latency_budget(recording, budget=HERE / "budget.toml")
