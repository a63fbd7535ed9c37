"""`rths fragility`: the chance that a limit is passed against the motion's intensity, from the table of a sweep."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from common.terminal import cli, outputs

if TYPE_CHECKING:
    from report.fragility.curves import Curves


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `fragility`."""
    parser.add_argument("table", type=Path, metavar="TABLE", help="the table of rths sweep (.parquet)")
    parser.add_argument("--quantity", required=True, metavar="NAME", help="the column that has the limit")
    parser.add_argument(
        "--limit", required=True, metavar="X", help="the limit in SI units, or with its unit: '20 mm'"
    )
    parser.add_argument(
        "--intensity",
        default="pga",
        metavar="NAME",
        help="the column of the motion's intensity: pga, sa or scale (default: pga)",
    )
    parser.add_argument(
        "--by",
        default="",
        metavar="NAME",
        help="one curve for each value of this column, such as compensator",
    )
    parser.add_argument("--html", type=Path, metavar="OUT", help="write curves and tables as one HTML page")
    parser.add_argument(
        "--json", type=Path, metavar="OUT", help="write the figures as JSON; - for standard output"
    )
    cli.force_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Fit the curves; 1 where one of them cannot be fitted."""
    from report.fragility import curves, page

    files = [path for path in (args.html, args.json) if path and str(path) != "-"]
    for path in files:
        outputs.checked(path, args.force, [args.table])
    found = curves.gather(args.table, args.quantity, args.limit, args.intensity, args.by)
    if args.html:
        outputs.write_text(args.html, page.page(found), args.force)
    text = json.dumps(curves.plain(found), allow_nan=False) + "\n"
    if args.json and str(args.json) == "-":
        sys.stdout.write(text)
    else:
        if args.json:
            outputs.write_text(args.json, text, args.force)
        show(found, outputs.aside(args.html, args.json))
    return 0 if all(one.fit.fitted for one in found.curves) else 1


def show(found: Curves, stream: TextIO) -> None:
    """The curves as text."""
    from report.fragility import tables
    from report.text.terminal import table

    stream.write(f"{tables.asked(found)}\n\n")
    fits = tables.fits(found)
    table([fits.head, *fits.rows], stream)
    for sentence in tables.missing(found):
        stream.write(f"{sentence}\n")
    for one in tables.stripes(found):
        stream.write(f"\n{one.title}\n" if one.title else "\n")
        table([one.head, *one.rows], stream)
