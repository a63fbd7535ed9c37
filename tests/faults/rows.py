"""The fault matrix F01 to F56: what each row must show, and the results that make its table in the docs.

A test of a row says what happened with `passed`; where `RTHS_FAULT_ROWS` names a file, the row is appended to it, and
`python -m tests.faults.rows ROWS.jsonl docs/reference/faults.md` makes the table of all 56.
"""

from __future__ import annotations

import dataclasses
import json
import os
import sys
from pathlib import Path

import numpy as np

from common.plan.plan import Plan
from common.recording.run import Run
from common.roles import MASTER, kind_of

COUNT = 56
COMMANDS = {"master": "actuator_command", "slave": "table_command"}


@dataclasses.dataclass(frozen=True)
class Row:
    """One row, passed: times in s, motions in m; None where nothing moves or nothing is to be reached."""

    fault: str  # F01 …
    title: str
    how: str  # how it was injected, and whether in simulation or on real processes
    state: str  # reached
    seconds: float | None  # to it
    motion: float | None  # after the last valid command
    evidence: str  # what the recording shows


def passed(
    fault: str,
    title: str,
    how: str,
    state: str,
    seconds: float | None,
    motion: float | None,
    evidence: str,
) -> None:
    """Keep the result of a row, whose fields are those of `Row`."""
    place = os.environ.get("RTHS_FAULT_ROWS")
    if place:
        row = Row(fault, title, how, state, seconds, motion, evidence)
        with Path(place).open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(dataclasses.asdict(row)) + "\n")


def motion_after(run: Run, role: str, tick: int) -> float:
    """The largest change of a laboratory's displacement command after a tick, ramp included, m."""
    name = COMMANDS[kind_of(role)]
    columns, ramp = run.columns[role], run.ramps.get(role, {})
    last = columns[name][np.searchsorted(columns["seq"], tick, side="right") - 1]
    later = columns[name][columns["seq"] > tick]
    commands = np.concatenate([later, ramp.get(name, np.empty(0))])
    return float(np.max(np.abs(commands - last), initial=0.0))


def motion_bound(plan: Plan, role: str) -> float:
    """The most that a rig may move after the last valid command, m: through the watchdog's time, then to a halt."""
    limits, safety = plan.limits, plan.safety
    speed = limits.actuator_velocity if role == MASTER else limits.table_velocity
    return speed * safety.ramp_after * plan.test.interval + speed**2 / (2.0 * safety.acceleration)


def table(rows: list[Row]) -> str:
    """The results as a Markdown table; raises SystemExit where a row is missing."""
    found = {row.fault: row for row in rows}
    missing = [f"F{number:02d}" for number in range(1, COUNT + 1) if f"F{number:02d}" not in found]
    if missing:
        raise SystemExit(f"{len(found)} of {COUNT} rows passed; missing: {', '.join(missing)}.")
    lines = [
        "| # | fault | how injected | state reached | time to it | motion after the last valid command | recording |",
        "|---|---|---|---|---|---|---|",
    ]
    for _, row in sorted(found.items()):
        seconds = "–" if row.seconds is None else f"{row.seconds * 1e3:.0f} ms"
        motion = "–" if row.motion is None else f"{row.motion * 1e3:.2f} mm"
        lines.append(
            f"| {row.fault} | {row.title} | {row.how} | {row.state} | {seconds} | {motion} | {row.evidence} |"
        )
    return "\n".join(lines) + "\n"


def main(source: str, target: str) -> None:
    """Write the table between the marks of a document."""
    rows = [Row(**json.loads(line)) for line in Path(source).read_text(encoding="utf-8").splitlines()]
    document = Path(target)
    before, begin, rest = document.read_text(encoding="utf-8").partition("<!-- rows -->\n")
    _, end, after = rest.partition("<!-- end of rows -->\n")
    document.write_text(before + begin + table(rows) + end + after, encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
