"""`rths reproduce`: the seed paper's numbers and figures beside those computed here."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from common.terminal import cli, outputs
from report.text.progress import Progress

if TYPE_CHECKING:
    from validation.paper.rows import PaperRow


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `reproduce`."""
    cli.output_argument(
        parser,
        "FOLDER",
        "folder for recordings, figures and the page (default: runs/reproduce)",
        default=Path("runs/reproduce"),
    )
    cli.force_argument(parser)
    cli.json_argument(parser, "write the table as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Run every experiment; 1 where a row is outside its tolerance."""
    target = args.output / "index.html"
    with outputs.folder(args.output, args.force) as folder, Progress("reproducing") as progress:
        from validation.paper import experiments, figures, page
        from validation.paper.rows import rows
        from validation.proof import draw_all

        evidence = experiments.gather(folder, progress.tell)
        progress.tell("figures")
        table = rows(evidence)
        pictures = draw_all(figures.FIGURES, evidence, folder)
        target.write_text(page.page(table, pictures), encoding="utf-8")
    if args.json:
        sys.stdout.write(json.dumps({"rows": [asdict(row) for row in table], "page": str(target)}))
        sys.stdout.write("\n")
    else:
        show(table)
        sys.stdout.write(f"page: {target}\n")
    return 0 if all(row.passed for row in table) else 1


def show(table: list[PaperRow]) -> None:
    """The table as text, one block per row."""
    for row in table:
        verdict = "pass" if row.passed else "FAIL"
        sys.stdout.write(
            f"{verdict}  {row.name}: paper {row.paper} | computed {row.computed} | must be {row.wanted}\n"
        )
        if row.note:
            sys.stdout.write(f"      {row.note}\n")
    passed = sum(row.passed for row in table)
    sys.stdout.write(f"{passed} of {len(table)} rows within their tolerance\n")
