"""`rths budget`: the latency of a recording judged against a budget."""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

from common.terminal import cli
from report.text.progress import Progress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `budget`."""
    cli.recording_argument(parser)
    parser.add_argument(
        "--budget",
        type=Path,
        metavar="B.toml",
        help="limits on percentiles, late ticks and gaps (default: report/budget/default.toml, which explains them)",
    )
    cli.json_argument(parser, "write the report as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Judge a recording; 1 where it is over its budget, 0 where it is within or the machine allows no verdict."""
    with Progress("reading"):
        from report.budget import assess, text

        report = assess(args.file, args.budget)
    written = json.dumps(report.plain(), allow_nan=False) + "\n" if args.json else text(report)
    try:
        sys.stdout.write(written)
        sys.stdout.flush()
    except BrokenPipeError:  # the reader, such as `head`, has what it wants
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return report.exit_code
