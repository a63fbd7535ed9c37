"""`rths report`: a run as one HTML page."""

from __future__ import annotations

import argparse
import json

from common.terminal import cli, outputs
from common.terminal.printable import shown


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `report`."""
    cli.recording_argument(parser, ", which may be damaged or cut off")
    cli.output_argument(parser, "OUT.html", "the page (default: FILE with the ending .html)")
    cli.force_argument(parser)
    cli.json_argument(parser, "name the page, its sentences and its pictures as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Write the page."""
    from common.recording.reader import read
    from report.facts.summary import summarize
    from report.run import drawing, page, verdict
    from report.text.progress import Progress

    output = args.output or args.file.with_suffix(".html")
    with Progress("reporting") as progress:
        recording = read(args.file)
        outputs.checked(output, args.force, [args.file])
        summary = summarize(recording)
        drawn, left_out = drawing.draw_all(recording, progress.tell)
        outputs.write_text(output, page.page(recording, summary, drawn, left_out), args.force)
    names = list(dict.fromkeys(picture.name for several in drawn.values() for picture in several))
    sentences = verdict.sentences(recording, summary)
    say = outputs.aside(output).write
    if args.json:
        result = {"page": str(output), "verdict": sentences, "pictures": names, "left_out": left_out}
        say(json.dumps(result) + "\n")
    else:
        lines = [*filter(None, [verdict.lost(summary)]), *sentences, f"page: {output}"]
        say("".join(f"{shown(line)}\n" for line in lines))
    return 0
