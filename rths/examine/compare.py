"""`rths compare`: two recordings or simulations signal by signal, or several recordings side by side."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from common.errors import InputError
from common.terminal import cli, outputs
from common.terminal.printable import shown
from report.text.progress import Progress

if TYPE_CHECKING:
    from report.text.terminal import TitledTable
    from simulation.prediction.held import Held
    from simulation.source import ComparedRun

TABLES = (".csv", ".parquet")  # formats that hold the texts of a column
BESIDE = ".mcap"  # format of a test and its prediction in one file


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `compare`."""
    parser.add_argument("a", metavar="A", help="a recording, or a plan, which is then simulated")
    parser.add_argument("b", metavar="B", nargs="?", help="the other recording or plan")
    parser.add_argument(
        "more",
        metavar="MORE",
        nargs="*",
        help="further recordings: then peaks, tracking and plans of all are listed",
    )
    parser.add_argument(
        "--signals",
        type=cli.words,
        default=[],
        metavar="NAME,NAME",
        help="the signals that are listed and drawn of several recordings, each with a unit if you like: "
        "drift:mm,column_force (default: drifts, positions and forces)",
    )
    parser.add_argument(
        "--html",
        type=Path,
        metavar="OUT",
        help="write a page on the recordings, with their histories; with --predicted over the band",
    )
    cli.output_argument(
        parser,
        "OUT",
        "write the signals of all recordings over the time since the start: .csv or .parquet; with --predicted the "
        "test and its prediction in one .mcap",
    )
    cli.force_argument(parser)
    parser.add_argument(
        "--predicted",
        type=Path,
        metavar="FILE",
        help="instead of B: the prediction of A that rths predict -o wrote; exit 1 if it did not hold",
    )
    parser.add_argument(
        "--tolerance", type=float, metavar="X", help="exit with 1 where an NRMSE exceeds this"
    )
    cli.json_argument(parser, "write the comparison as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Compare; 1 where a signal differs by more than the tolerance."""
    if args.tolerance is not None and not args.tolerance >= 0.0:
        raise InputError(f"--tolerance is {args.tolerance}, but must be at least 0.")
    if (args.b is None) == (args.predicted is None):
        raise InputError("Give A something to be compared with: B, or --predicted FILE, not both.")
    if args.predicted:
        return against_prediction(args)
    if args.more or args.html or args.output or args.signals:
        return side_by_side(args)
    with Progress("comparing") as progress:
        from simulation.source import columns

        a, b = columns(args.a, progress.tell), columns(args.b, progress.tell)
        result = compare(a, b)
    result |= {"motion_a": a.motion, "motion_b": b.motion}
    if not result["signals"]:
        raise InputError(f"{args.a} and {args.b} have no tick and signal in common.")
    beyond = [
        name
        for name, facts in result["signals"].items()
        if args.tolerance is not None and not facts["nrmse"] <= args.tolerance
    ]
    result["beyond_tolerance"] = beyond
    if args.json:
        sys.stdout.write(json.dumps(result) + "\n")
    else:
        show(args, result)
    return 1 if beyond else 0


def side_by_side(args: argparse.Namespace) -> int:
    """List several recordings beside each other, and write their page and their table."""
    if args.tolerance is not None:
        raise InputError(
            "--tolerance is of two recordings signal by signal: leave out further ones and outputs."
        )
    paths = [Path(name) for name in (args.a, args.b, *args.more)]
    check_outputs(args, paths)
    with Progress("comparing") as progress:
        from report.several import page, runs, tables

        found = runs.several(paths, progress.tell)
        signals = runs.chosen(found, args.signals)
        if not signals:
            raise InputError(
                "The recordings have no drift, position or force: choose with --signals what is compared."
            )
        if args.html:
            progress.tell("page", 0, 0)
            outputs.write_text(args.html, page.page(found, signals), args.force)
        if args.output:
            write_table(args, *tables.long(found, signals))
    stream = outputs.aside(args.output, args.html)
    if args.json:
        stream.write(json.dumps(tables.plain(found, signals)) + "\n")
        return 0
    write_tables(tables.all_of(found, signals), stream)
    return 0


def check_outputs(args: argparse.Namespace, inputs: Sequence[Path]) -> None:
    """Raise InputError where an output cannot be written, before any work is done."""
    if args.output and args.output.suffix.lower() not in TABLES:
        raise InputError(f"Cannot write {args.output}: give a file that ends in {' or '.join(TABLES)}.")
    if args.html and args.html == args.output:
        raise InputError("--html and -o name one file: give each a file of its own.")
    for path in filter(None, (args.html, args.output)):
        outputs.checked(path, args.force, inputs)


def write_table(args: argparse.Namespace, columns: Any, units: dict[str, str]) -> None:
    """The histories as a table of numbers."""
    from report.text import tabular

    with outputs.writing(args.output, args.force) as path:
        tabular.write(path, columns, units)


def write_tables(listed: Sequence[TitledTable], stream: TextIO) -> None:
    """Tables as text."""
    from report.text.terminal import table

    for one in listed:
        stream.write(f"{shown(one.title)}\n\n")
        table([list(one.head), *map(list, one.rows)], stream)
        stream.write("\n")


def against_prediction(args: argparse.Namespace) -> int:
    """Report which signals of a recording left the predicted band; 1 if the prediction did not hold."""
    if args.signals:
        raise InputError("--signals is of several recordings: leave it out with --predicted.")
    if args.output and args.output.suffix.lower() != BESIDE:
        raise InputError(f"With --predicted -o takes a recording: give a file that ends in {BESIDE}.")
    for path in filter(None, (args.html, args.output)):
        outputs.checked(path, args.force, [Path(args.a), args.predicted])
    if args.tolerance is not None:
        raise InputError("--tolerance is of two recordings: leave it out with --predicted, which has a band.")
    from common.recording.reader import read
    from simulation.prediction import held

    measured, predicted = read(Path(args.a)), read(args.predicted)
    found = held.held(measured, predicted)
    if args.html:
        from report.prediction import overlay

        outputs.write_text(args.html, overlay.page(found, measured, predicted), args.force)
    if args.output:
        from simulation.prediction import beside

        with outputs.writing(args.output, args.force) as path:
            beside.write(path, measured, predicted)
    stream = outputs.aside(args.output, args.html)
    if args.json:
        from report.prediction import sentences

        stream.write(json.dumps(held.plain(found) | {"sentences": sentences.every(found)}) + "\n")
    else:
        show_held(found, stream)
    return 0 if found.held else 1


def show_held(found: Held, stream: TextIO) -> None:
    """How a recording lay in a prediction, as text."""
    from report.prediction import sentences
    from report.text.terminal import table

    rows = [["signal", "inside", "first left", "times left", "farthest", "at"]]
    for name, one in found.signals.items():
        first = f"{one.departures[0].start:.2f} s" if one.departures else "–"
        far = [f"{one.farthest:.1f} half widths", f"{one.farthest_at:.2f} s"] if one.farthest else ["–", "–"]
        rows.append([name, f"{100 * one.inside:.0f} %", first, str(len(one.departures)), *far])
    stream.write(f"{found.ticks} ticks in common; the band is of 90 % of the time\n\n")
    table(rows, stream)
    stream.write("\n" + "".join(f"{shown(text)}\n" for text in sentences.every(found)))


def compare(a: ComparedRun, b: ComparedRun) -> dict[str, Any]:
    """Differences of every signal that both have, on the ticks that both have.

    NRMSE is rms(a − b)/rms(a); `equal` says that all values agree to the last bit.
    """
    import numpy as np

    from simulation.source import OF_THE_TICK

    ticks, in_a, in_b = np.intersect1d(a.ticks, b.ticks, return_indices=True)
    result = {}
    for name in a.signals:
        if name in OF_THE_TICK or name not in b.signals or not ticks.size:
            continue
        x, y = a.signals[name][in_a].astype(float), b.signals[name][in_b].astype(float)
        if x.shape == y.shape:
            result[name] = difference(x, y)
    return {"ticks": int(ticks.size), "signals": result}


def difference(x: Any, y: Any) -> dict[str, Any]:
    """NRMSE, largest difference and equality of two columns."""
    import numpy as np

    error, size = float(np.sqrt(np.mean((x - y) ** 2))), float(np.sqrt(np.mean(x**2)))
    nrmse = error / size if size else (0.0 if error == 0.0 else float("inf"))
    return {
        "nrmse": nrmse,
        "largest": float(np.max(np.abs(x - y))),
        "peak_a": float(np.max(np.abs(x))),
        "peak_b": float(np.max(np.abs(y))),
        "equal": bool(np.array_equal(x, y)),
    }


def show(args: argparse.Namespace, result: dict[str, Any]) -> None:
    """The comparison as text."""
    from report.text.terminal import table

    rows = [["signal", "NRMSE", "largest", "peak A", "peak B", ""]]
    for name, facts in result["signals"].items():
        numbers = [f"{facts[key]:.4g}" for key in ("nrmse", "largest", "peak_a", "peak_b")]
        rows.append([name, *numbers, "equal" if facts["equal"] else ""])
    for name, source in (("A", args.a), ("B", args.b)):
        sys.stdout.write(shown(f"{name} {source}: {result[f'motion_{name.lower()}']}") + "\n")
    sys.stdout.write(f"{result['ticks']} ticks in common\n\n")
    table(rows)
    for name in result["beyond_tolerance"]:
        sys.stdout.write(f"{shown(name)} differs by more than the tolerance {args.tolerance:g}\n")
