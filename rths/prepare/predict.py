"""`rths predict`: the next test predicted from a diagnosis, with a band that should hold for 90 % of the time."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from common.errors import InputError
from common.plan.laboratory_tables import Control
from common.plan.plan import Plan
from common.terminal import cli, outputs
from report.text.progress import Progress

if TYPE_CHECKING:
    from simulation.prediction.bands import Prediction

DRAWS = 64


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `predict`."""
    cli.plan_arguments(parser)
    parser.add_argument(
        "--found", type=Path, required=True, metavar="FOUND", help="what rths diagnose --found wrote"
    )
    parser.add_argument("--no-amd", action="store_true", help="without the damper")
    parser.add_argument(
        "--draws", type=int, default=DRAWS, metavar="N", help=f"laboratories to draw (default: {DRAWS})"
    )
    cli.output_argument(
        parser,
        "FILE",
        "write the test as predicted and its band as a recording, for viewers and rths compare --predicted",
    )
    parser.add_argument("--html", type=Path, metavar="OUT", help="write the prediction as one HTML page")
    parser.add_argument(
        "--json", type=Path, metavar="OUT", help="write the figures as JSON; - for standard output"
    )
    cli.force_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Predict the test; 1 where it passes a limit of the plan in half of the laboratories drawn, or more."""
    plan = cli.load_plan(args)
    if args.no_amd:
        plan = plan.everywhere(control=Control(amd=False, gain=plan.control.gain))
    check(args)
    with Progress("predicting") as progress:
        from simulation.prediction import bands, draws, file

        found = bands.predict(draws.load(args.found, plan), plan, args.draws, progress.tell)
        found = replace(found, plan=plan)
        if args.output:
            progress.tell("writing", 0, 0)
            with outputs.writing(args.output, args.force) as path:
                file.write(path, found, args.found.name)
        if args.html:
            from report.prediction import page

            progress.tell("page", 0, 0)
            outputs.write_text(args.html, page.page(found, args.found.name), args.force)
    text = json.dumps(bands.plain(found), allow_nan=False) + "\n"
    code = 1 if any(2 * one.passed >= found.draws for one in found.limits.values()) else 0
    if args.json and str(args.json) == "-":
        sys.stdout.write(text)
        return code
    if args.json:
        outputs.write_text(args.json, text, args.force)
    show(plan, found, outputs.aside(args.output, args.html, args.json))
    return code


def check(args: argparse.Namespace) -> None:
    """Raise InputError where an output cannot be written, before any work is done."""
    files = [path for path in (args.output, args.html, args.json) if path and str(path) != "-"]
    for path in files:
        outputs.checked(path, args.force, [cli.plan_path(args.plan), args.found])
    if len({outputs.target(path) for path in files}) < len(files):
        raise InputError("-o, --html and --json name one file twice: give each a file of its own.")


def show(plan: Plan, found: Prediction, stream: TextIO) -> None:
    """The summary as text."""
    from report.prediction import tables
    from report.text.terminal import table

    stream.write(
        f"prediction of '{plan.test.name}', {plan.ticks} ticks of {plan.test.interval:g} s, from {found.draws} "
        f"laboratories drawn\nground motion: {found.motion.describe()}, scaled by {plan.ground_motion.scale:g}\n\n"
    )
    for one in (tables.peaks(found), tables.limits(found)):
        table([one.head, *one.rows], stream)
        stream.write("\n")
    for sentence in (*tables.verdict(found), *found.sentences):
        stream.write(f"{sentence}\n")
