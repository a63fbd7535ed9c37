"""`rths report`: a run as one HTML page, and as PDF."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from common.errors import InputError
from common.terminal import cli, outputs
from common.terminal.printable import shown


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `report`."""
    cli.recording_argument(parser, ", which may be damaged or cut off")
    cli.output_argument(parser, "OUT.html", "the page (default: FILE with the ending .html)")
    parser.add_argument(
        "--pdf", type=Path, metavar="OUT.pdf", help="also print the page into a PDF, by Chromium or Chrome"
    )
    cli.force_argument(parser)
    cli.json_argument(parser, "name the page, its sentences and its pictures as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Write the page."""
    from common.recording.reader import read
    from report.facts.summary import summarize
    from report.page import pdf
    from report.run import drawing, page, verdict
    from report.text.progress import Progress

    output = args.output or args.file.with_suffix(".html")
    with Progress("reporting") as progress:
        recording = read(args.file)
        outputs.checked(output, args.force, [args.file])
        if args.pdf:
            outputs.checked(args.pdf, args.force, [args.file])
            if outputs.target(args.pdf) == outputs.target(output):
                raise InputError("-o and --pdf name one file: give each a file of its own.")
            pdf.browser()
        summary = summarize(recording)
        drawn, left_out = drawing.draw_all(recording, progress.tell)
        text = page.page(recording, summary, drawn, left_out)
        outputs.write_text(output, text, args.force)
        if args.pdf:
            progress.tell("PDF", 0, 0)
            with outputs.writing(args.pdf, args.force) as place:
                pdf.write(text, place)
    names = list(dict.fromkeys(picture.name for several in drawn.values() for picture in several))
    sentences = verdict.sentences(recording, summary)
    say = outputs.aside(output).write
    if args.json:
        result = {
            "page": str(output),
            "pdf": str(args.pdf) if args.pdf else None,
            "verdict": sentences,
            "pictures": names,
            "left_out": left_out,
        }
        say(json.dumps(result) + "\n")
    else:
        lines = [
            *filter(None, [verdict.lost(summary)]),
            *sentences,
            f"page: {output}",
            *([f"PDF: {args.pdf}"] if args.pdf else []),
        ]
        say("".join(f"{shown(line)}\n" for line in lines))
    return 0
