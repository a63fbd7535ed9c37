"""`rths export`: a recording as CSV, Parquet or MAT, or a plan's emulated laboratory as an FMU."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from common.errors import InputError
from common.roles import MASTER
from common.terminal import cli, outputs

if TYPE_CHECKING:
    from common.recording.run import Run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `export`."""
    cli.recording_argument(parser, "; for an FMU the plan of the test")
    cli.output_argument(parser, "OUT", "the file to write: .csv, .parquet, .mat or .fmu", required=True)
    parser.add_argument(
        "--events",
        action="store_true",
        help="export the events too, as a second table OUT-events.csv (a .mat always holds them, as `events`)",
    )
    parser.add_argument(
        "--lab",
        metavar="ROLE",
        help="the laboratory that becomes an FMU: master, slave, or a slave's name (default: master)",
    )
    cli.reality_argument(parser)
    cli.force_argument(parser)
    cli.json_argument(parser, "say what was written as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Export."""
    if args.output.suffix.lower() == ".fmu":
        return laboratory(args)
    if args.lab is not None or args.reality is not None:
        raise InputError(
            f"--lab and --reality are for an FMU, not for {args.output}: give a name that ends in .fmu."
        )
    from common.recording.reader import read
    from report.text import tabular
    from report.text.progress import Progress

    tabular.format_of(args.output)
    apart = args.output.with_stem(f"{args.output.stem}-events") if beside(args) else None
    for path in filter(None, (args.output, apart)):
        outputs.checked(path, args.force, [args.file])
    with Progress("exporting"):
        recording = read(args.file)
        columns, units, happened = flat(recording), flat_units(recording), events(recording)
        with outputs.writing(args.output, args.force) as path:
            tabular.write(path, columns, units, events=structs(happened))
        if apart:
            with outputs.writing(apart, args.force) as path:
                tabular.write(path, happened, {"t": "s"})
    ticks, count = len(columns["seq"]), len(happened["t"])
    if args.json:
        written: dict[str, Any] = {
            "file": str(args.output),
            "ticks": ticks,
            "columns": list(columns),
            "units": units,
        }
        written |= {"events": str(apart)} if apart else {}
        sys.stdout.write(json.dumps(written) + "\n")
    else:
        sys.stdout.write(f"{args.output}: {ticks} ticks, {len(columns)} columns, SI units\n")
        sys.stdout.write(f"{apart}: {count} events\n" if apart else "")
    return 0


def laboratory(args: argparse.Namespace) -> int:
    """Export a laboratory as an FMU."""
    if args.events:
        raise InputError("An FMU holds no events: leave out --events.")
    from rths.fmi.export import export

    with outputs.writing(args.output, args.force) as path:
        kind = export(args.file, path, args.lab or MASTER, args.reality)
    names = {"inputs": list(kind.channels.drives), "outputs": list(kind.channels.names)}
    if args.json:
        sys.stdout.write(json.dumps({"file": str(args.output), **names}) + "\n")
    else:
        words = "; ".join(f"{name} {', '.join(rows)}" for name, rows in names.items())
        sys.stdout.write(f"{args.output}: FMI 3.0, co-simulation, {kind.says}; {words}\n")
    return 0


def beside(args: argparse.Namespace) -> bool:
    """Whether the events go into a file of their own."""
    return bool(args.events) and args.output.suffix.lower() != ".mat"


def events(recording: Run) -> dict[str, Any]:
    """The events, one column per field; the values of an event are JSON text."""
    import numpy as np

    named = {name: [event[name] for event in recording.events] for name in ("lab", "level", "code", "text")}
    values = [json.dumps(event["values"], sort_keys=True) for event in recording.events]
    texts = {name: np.array(column, dtype=np.str_) for name, column in (named | {"values": values}).items()}
    return {"t": np.array([event["t"] for event in recording.events], dtype=np.float64)} | texts


def structs(columns: dict[str, Any]) -> Any:
    """Columns as an array of structs, as which MATLAB holds a table with text."""
    import numpy as np

    rows = zip(*columns.values(), strict=True)
    return np.array([tuple(row) for row in rows], dtype=[(name, object) for name in columns])


def flat(recording: Run) -> dict[str, Any]:
    """One column per signal, named `<topic>_<signal>`, with `_<number>` of storey or slave where there are several.

    One row per tick; the topic of a named slave is `slave_<name>`. Where a topic lacks a tick, its columns hold NaN, or
    0 in columns of whole numbers.
    """
    import numpy as np

    if not recording.sequences:
        raise InputError(f"{recording.path} holds no ticks to export.")
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
            columns |= spread(column_name(topic, name), whole)
    return columns


def flat_units(recording: Run) -> dict[str, str]:
    """The units of those columns that have one, by the columns' names."""
    return {
        part: unit
        for topic, named in recording.units.items()
        for name, unit in named.items()
        if unit and name in recording.columns.get(topic, {})
        for part in spread(column_name(topic, name), recording.columns[topic][name])
    }


def column_name(topic: str, name: str) -> str:
    """The name of a topic's signal in a table."""
    return f"{topic.replace('.', '_')}_{name}"


def spread(name: str, column: Any) -> dict[str, Any]:
    """A column by itself, or one per storey or slave."""
    if column.ndim == 1:
        return {name: column}
    return {f"{name}_{place + 1}": column[:, place].copy() for place in range(column.shape[1])}
