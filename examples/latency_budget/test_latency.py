"""A latency test for continuous integration: a short test in real time, judged by rths' fixture `latency_budget`."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).parent


def test_the_loop_keeps_its_budget(latency_budget: Callable[..., object], tmp_path: Path) -> None:
    """Five seconds of the default test; over the budget fails, a machine too busy for a verdict skips."""
    recording = tmp_path / "latency.mcap"
    command = [sys.executable, "-m", "rths", "run", "default", "--duration", "5", "-o", str(recording)]
    subprocess.run(command, check=True)
    latency_budget(recording, budget=HERE / "budget.toml")
