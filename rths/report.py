"""`rths report`: a run as one HTML page."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from common import cli
from common.errors import InputError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `report`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a recording (MCAP), damaged or cut off too")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="OUT.html",
        help="the page (default: beside the recording, with .html)",
    )
    cli.json_argument(parser, "name the page, its sentences and its pictures as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Write the page."""
    from common.recording.reader import read
    from rths.progress import Progress
    from rths.run_report import drawing, page, verdict
    from rths.summary import summarize

    with Progress("reporting") as progress:
        recording = read(args.file)
        output = place(args.output or args.file.with_suffix(".html"))
        summary = summarize(recording)
        drawn, left_out = drawing.draw_all(recording, progress.tell)
        write(output, page.page(recording, summary, drawn, left_out))
    names = list(dict.fromkeys(picture.name for several in drawn.values() for picture in several))
    sentences = verdict.sentences(recording, summary)
    if args.json:
        result = {"page": str(output), "verdict": sentences, "pictures": names, "left_out": left_out}
        sys.stdout.write(json.dumps(result) + "\n")
    else:
        sys.stdout.write(
            "\n".join([*filter(None, [verdict.lost(summary)]), *sentences, f"page: {output}"]) + "\n"
        )
    return 0


def place(path: Path) -> Path:
    """Where the page goes; raises InputError where there is no place, or one that a recording takes."""
    cli.spared(path)
    if path.is_dir():
        raise InputError(f"Cannot write {path}: it is a folder; give the name of a file with -o.")
    if not path.parent.is_dir():
        raise InputError(
            f"There is no folder {path.parent} for the page: make it, or give another file with -o."
        )
    return path


def write(path: Path, text: str) -> None:
    """Write the page; raises InputError where that cannot be."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror}; give another file with -o.") from None
