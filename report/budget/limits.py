"""A latency budget: its TOML file, checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from common.errors import PlanError
from common.plan.schema import fill, key, nearest, table_fields
from common.plan.toml_file import load_tables

DEFAULT = Path(__file__).with_name("default.toml")
PERCENTILES = {"p50": 50.0, "p90": 90.0, "p99": 99.0, "p99.9": 99.9}
WAITS = {  # segments in the order of a tick, with the number of threads that must wake in each; see the default budget
    "wake_lateness": 1,
    "compute_time": 1,
    "encode_time": 1,
    "command_one_way": 2,
    "slave_time": 1,
    "slave_compute_time": 1,
    "feedback_one_way": 2,
    "decode_time": 1,
    "age_at_use": 1,
    "round_trip": 5,
}


@dataclass(frozen=True)
class SegmentLimits:
    """Limits on percentiles of one segment, s."""

    percentiles: dict[str, float] = key("limits by percentile", default={}, more=True)


@dataclass(frozen=True)
class LateLimits:
    """Limits on ticks that were late; inf for none."""

    share: float = key("share of late ticks", default=math.inf, least=0.0, most=1.0, infinite=True)
    missed_share: float = key(
        "share of ticks without a command", default=math.inf, least=0.0, most=1.0, infinite=True
    )
    longest_gap: float = key("late ticks in a row", default=math.inf, unit="ticks", least=0.0, infinite=True)


@dataclass(frozen=True)
class MachineLimits:
    """Limits beyond which lateness is attributed to the machine and not to the test."""

    lateness: float = key(
        "largest lateness of the bare loop that is added to a limit", default=0.3e-3, unit="s", least=0.0
    )
    share: float = key(
        "largest share of late ticks of the bare loop that is added to a limit",
        default=0.005,
        least=0.0,
        most=1.0,
    )
    standstill_share: float = key(
        "share of late ticks of the bare loop beyond which late ticks and wake-ups over their limits are not judged",
        default=0.005,
        least=0.0,
        most=1.0,
    )
    unfit_share: float = key(
        "share of late ticks of the bare loop beyond which nothing over its limit is judged",
        default=0.02,
        least=0.0,
        most=1.0,
    )
    stolen_share: float = key(
        "share of the processors' time taken by the host beyond which nothing over its limit is judged",
        default=0.05,
        least=0.0,
        most=1.0,
    )


@dataclass(frozen=True)
class Budget:
    """Limits by segment and percentile (s), and on late ticks; what is not named is not judged."""

    name: str = "default"
    segments: dict[str, dict[str, float]] = field(default_factory=dict)
    late: LateLimits = LateLimits()
    machine: MachineLimits = MachineLimits()

    def plain(self) -> dict[str, Any]:
        """The budget as plain values, without the limits that it does not set."""
        late = {name: value for name, value in values(self.late).items() if math.isfinite(value)}
        return {"name": self.name, **self.segments, "late": late, "machine": values(self.machine)}


def values(table: LateLimits | MachineLimits) -> dict[str, float]:
    """The numbers of a table by name."""
    return {field.name: getattr(table, field.name) for field in table_fields(table)}


def load(path: Path | None) -> Budget:
    """The budget in a TOML file, the one that ships for None.

    Raises:
        PlanError: the file cannot be read, is no TOML, or holds keys or values that a budget cannot have.
    """
    if path is None:
        return load(DEFAULT)
    tables = load_tables(path, "budget")
    try:
        return from_tables(tables, "default" if path == DEFAULT else str(path))
    except PlanError as error:
        raise PlanError(f"The budget {path}: {error}") from None


def from_tables(tables: Mapping[str, Any], name: str = "of the caller") -> Budget:
    """The budget of nested plain values; raises PlanError."""
    known = [*WAITS, "late", "machine"]
    for table, content in tables.items():
        if table not in known:
            kind = f"table [{table}]" if isinstance(content, dict) else f"key '{table}' outside of a table"
            raise PlanError(f"Unknown {kind}: {nearest(table, known)}")
    budget = Budget(
        name,
        {segment: percentiles(tables[segment], segment) for segment in WAITS if segment in tables},
        fill(LateLimits, tables.get("late", {}), "late"),
        fill(MachineLimits, tables.get("machine", {}), "machine"),
    )
    limited = any(budget.segments.values()) or any(map(math.isfinite, values(budget.late).values()))
    if not limited:
        raise PlanError("it sets no limit: give one such as p99 = 0.6e-3 in [feedback_one_way].")
    return budget


def percentiles(table: object, segment: str) -> dict[str, float]:
    """The limits of one segment, by percentile in rising order; raises PlanError."""
    if isinstance(table, Mapping) and isinstance(table.get("p99"), Mapping):
        raise PlanError(f'p99.9 in [{segment}] must be written in quotes: "p99.9" = 1e-3.')
    given = fill(SegmentLimits, table, segment).percentiles
    for name, value in given.items():
        if name not in PERCENTILES:
            raise PlanError(f"Unknown key '{name}' in [{segment}]: {nearest(name, PERCENTILES)}")
        if not (math.isfinite(value) and value >= 0.0):
            raise PlanError(f"{name} in [{segment}] is {value!r}, but must be at least 0 s and finite.")
    return {name: given[name] for name in PERCENTILES if name in given}
