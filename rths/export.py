"""`rths export`: a recording as CSV, Parquet or MAT."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from common import cli

if TYPE_CHECKING:
    from common.recording.reader import Run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `export`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a recording (MCAP)")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        required=True,
        metavar="OUT",
        help="the file to write: .csv, .parquet or .mat",
    )
    cli.json_argument(parser, "say what was written as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Export."""
    from common.recording.reader import read
    from rths import tabular

    columns = flat(read(args.file))
    tabular.write(args.output, columns)
    ticks = len(next(iter(columns.values())))
    if args.json:
        sys.stdout.write(
            json.dumps({"file": str(args.output), "ticks": ticks, "columns": list(columns)}) + "\n"
        )
    else:
        sys.stdout.write(f"{args.output}: {ticks} ticks, {len(columns)} columns, SI units\n")
    return 0


def flat(recording: Run) -> dict[str, Any]:
    """One column per signal, named `<topic>_<signal>`, with `_<number>` of storey or slave where there are several.

    One row per tick; the topic of a named slave is `slave_<name>`. A tick that a topic does not have is NaN there,
    or 0 in a column of whole numbers.
    """
    import numpy as np

    ticks = np.unique(np.concatenate(list(recording.sequences.values())))
    columns: dict[str, Any] = {"seq": ticks}
    for topic, values in recording.columns.items():
        places = np.searchsorted(ticks, recording.sequences[topic])
        for name, column in values.items():
            if name == "seq":
                continue
            whole = np.full(
                (ticks.size, *column.shape[1:]), np.nan if column.dtype.kind == "f" else 0, column.dtype
            )
            whole[places] = column
            columns |= spread(f"{topic.replace('.', '_')}_{name}", whole)
    return columns


def spread(name: str, column: Any) -> dict[str, Any]:
    """A column by itself, or one per storey or slave."""
    if column.ndim == 1:
        return {name: column}
    return {f"{name}_{place + 1}": column[:, place].copy() for place in range(column.shape[1])}
