"""`rths sweep`: many tests of one plan computed, as one table."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from common.errors import InputError
from common.terminal import cli, outputs
from report.text.progress import Progress

if TYPE_CHECKING:
    from simulation.sweep.definition import Sweep


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `sweep`."""
    parser.add_argument("sweep", type=Path, metavar="SWEEP", help="what is varied (TOML)")
    cli.output_argument(parser, "TABLE", "the table to write (.parquet), a row for each test", required=True)
    cli.workers_arguments(parser)
    cli.force_argument(parser)
    cli.json_argument(parser, "write the summary as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Compute the tests that are not there yet, and write the table."""
    outputs.checked(args.output, args.force, [args.sweep])
    if args.output.suffix != ".parquet":
        raise InputError(f"{args.output} is no name of a table: give a file that ends in .parquet.")
    with Progress("sweep") as progress:
        from simulation.sweep import definition, table
        from simulation.workers import pool
        from simulation.workers.parts import Way

        pool.check(args.jobs, args.dask)
        sweep = definition.load(args.sweep)
        made = table.table(
            args.output, sweep, Way(args.jobs, args.dask), force=args.force, tell=progress.tell
        )
    summary = summarize(sweep, made) | {"file": str(args.output)}
    stream = outputs.aside(args.output)
    if args.json:
        stream.write(json.dumps(summary, allow_nan=False) + "\n")
    else:
        show(sweep, summary, stream)
    return 0


def summarize(sweep: Sweep, made: Any) -> dict[str, Any]:
    """Counts and errors for each compensator."""
    import numpy as np

    from simulation.sweep.measures import DIVERGED, SHARE

    outcome, share = (np.array(made.column(name).to_pylist()) for name in ("outcome", SHARE))
    names = np.array(made.column("compensator").to_pylist())
    error = np.array(made.column("tracking_error")) if "tracking_error" in made.column_names else None
    found = []
    for one in sweep.compensators:
        of_it = names == one.name
        whole = of_it & (outcome != DIVERGED)
        said = {
            "compensator": one.name,
            "tests": int(of_it.sum()),
            "diverged": int((of_it & (outcome == DIVERGED)).sum()),
            "beyond_limit": int((of_it & (share > 1.0)).sum()),
        }
        if error is not None and whole.any():
            said["tracking_error"] = {
                "median": float(np.median(error[whole])),
                "largest": float(np.max(error[whole])),
            }
        found.append(said)
    return {"tests": sweep.rows, "plan": sweep.plan.digest(), "compensators": found}


def show(sweep: Sweep, summary: dict[str, Any], stream: TextIO) -> None:
    """The summary as text."""
    from report.text.formats import percent
    from report.text.terminal import table
    from simulation.sweep.definition import described

    stream.write(f"{summary['tests']:,} tests of '{sweep.plan.test.name}': {described(sweep)}\n\n")
    rows = [["compensator", "tests", "diverged", "beyond a limit", "tracking error", "largest"]]
    for one in summary["compensators"]:
        error = one.get("tracking_error", {})
        rows.append(
            [
                one["compensator"],
                *(f"{one[name]:,}" for name in ("tests", "diverged", "beyond_limit")),
                *(percent(error.get(name)) for name in ("median", "largest")),
            ]
        )
    table(rows, stream)
    stream.write(f"written to {summary['file']}\n")
