"""`rths diagnose`: the sim-to-real gap of a recording: where it lies, which effect causes it, how far it closes."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from common.errors import InputError
from common.terminal import cli, outputs
from common.terminal.printable import all_shown
from common.terminal.telling import Tell, untold
from report.text.progress import Progress

if TYPE_CHECKING:
    from diagnosis.report.records import Report


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `diagnose`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a recording (MCAP), whole or of one part")
    parser.add_argument(
        "--plan", metavar="PLAN", help="what the laboratories should be (default: the plan in FILE)"
    )
    parser.add_argument(
        "--ideal",
        action="store_true",
        help="hold the test against the pure simulation: transfer systems that follow their targets at once",
    )
    parser.add_argument(
        "--json", type=Path, metavar="OUT", help="write the report as JSON; - for standard output"
    )
    parser.add_argument("--html", type=Path, metavar="OUT", help="write the report as one HTML page")
    cli.force_argument(parser)
    parser.add_argument(
        "--validate",
        type=Path,
        nargs="+",
        default=[],
        metavar="OTHER",
        help="further recordings of the same laboratories, on which the shrinkage is judged",
    )


def run(args: argparse.Namespace) -> int:
    """Diagnose and report; 0 whatever the verdict is."""
    check(args)
    with Progress("diagnosing") as progress:
        report = diagnose_file(
            args.file, plan=args.plan, validate=args.validate, against_ideal=args.ideal, tell=progress.tell
        )
        if args.html:
            from report.gap import page

            progress.tell("page")
            outputs.write_text(args.html, page.page(report.plain()), args.force)
    if args.json:
        text = json.dumps(report.plain(), allow_nan=False) + "\n"
        if str(args.json) == "-":
            sys.stdout.write(text)
            return 0
        outputs.write_text(args.json, text, args.force)
    from report.gap import terminal

    outputs.aside(args.html, args.json).write(terminal.summary(all_shown(report.plain())) + "\n")
    return 0


def check(args: argparse.Namespace) -> None:
    """Raise InputError where the report cannot be written, before any work is done."""
    files = [path for path in (args.html, args.json) if path and str(path) != "-"]
    inputs = [args.file, *args.validate, *([cli.plan_path(args.plan)] if args.plan else [])]
    for path in files:
        outputs.checked(path, args.force, inputs)
    if len({outputs.target(path) for path in files}) < len(files):
        raise InputError(f"--html and --json both name {args.html}: give each a file of its own.")


def diagnose_file(
    path: Path,
    *,
    plan: str | None = None,
    validate: Sequence[Path] = (),
    against_ideal: bool = False,
    tell: Tell = untold,
) -> Report:
    """The report on a recording.

    Raises:
        InputError: a file cannot be read, or holds nothing to diagnose.
    """
    from common.plan import plan as plans
    from common.recording.reader import read
    from diagnosis.diagnose import diagnose
    from diagnosis.recorded import record

    chosen = plans.load(cli.plan_path(plan)) if plan else None
    own = record.build(read(path), chosen, against_ideal=against_ideal)
    others = [record.build(read(other), chosen, against_ideal=against_ideal) for other in validate]
    report = diagnose(own, others, tell)
    from report.gap import wording

    return dataclasses.replace(report, verdict=wording.verdict(report.plain()))
