"""The benchmark on the terminal, and as JSON."""

from __future__ import annotations

import math
import sys
from typing import Any

from report.text import terminal
from validation.benchmark2020.evidence import BenchmarkEvidence, GoalCheck
from validation.benchmark2020.runs import CellResult
from validation.benchmark2020.tables import tables


def show(evidence: BenchmarkEvidence, checks: list[GoalCheck]) -> None:
    """All tables, then the checks."""
    for table in tables(evidence):
        sys.stdout.write(f"{table.title}\n\n")
        terminal.table([table.head, *table.rows])
        sys.stdout.write("\n")
    for check in checks:
        verdict = "pass" if check.passed else "FAIL"
        sys.stdout.write(f"{verdict}  {check.name}: {check.value} (wanted: {check.goal})\n")


def as_json(evidence: BenchmarkEvidence, checks: list[GoalCheck]) -> dict[str, Any]:
    """All results as plain values in SI units; values that are not finite become null."""
    return {
        "plants": evidence.plants,
        "seed": evidence.seed,
        "checks": [check._asdict() for check in checks],
        "tests": [values_of(item) for item in evidence.results],
        "settings": [
            {name: plain(value) for name, value in item._asdict().items()} | {"meets": item.meets}
            for item in evidence.summaries
        ],
        "late_force": [
            {
                "delay": item.delay,
                **values_of(item.result),
                "force_path": None if item.path is None else plain(item.path.delay),
            }
            for item in evidence.late
        ],
        "critical_delays": [item._asdict() for item in evidence.critical],
    }


def values_of(result: CellResult) -> dict[str, Any]:
    """One test."""
    values = {name: plain(value) for name, value in result._asdict().items() if name != "found"}
    found = result.found._asdict() if result.found else {}
    return values | {name: plain(value) for name, value in found.items()}


def plain(value: Any) -> Any:
    """A value that JSON can hold."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
