"""`rths import`: a recording made of someone's own measurements, whole or of one part."""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from common import signals
from common.errors import InputError, PlanError
from common.plan import read as plans
from common.plan.plan import Plan
from common.plan.schema import fill, key, nearest
from common.plan.toml_file import load_tables
from common.roles import MASTER, name_of
from common.signals import FieldType, Signal
from common.terminal import cli, outputs
from report.text.progress import Progress

Known = dict[str, tuple[str, Signal]]  # by our name of a signal its topic and its row there


def lab_signals(plan: Plan) -> Known:
    """What can be given: our signals, those of a named slave as `NAME.signal`.

    Where both ends know a signal, the slave's is meant. Of a slave without a name whose laboratory is of the master's
    kind the signals are `slave.signal`.
    """
    from laboratories import kinds

    found: Known = {}
    kind = kinds.own(plan)
    own = (kind.channels.target.name, *kind.channels.drives, *kind.channels.names) if kind else ()
    for topic, rows in kinds.topics(plan).items():
        for row in rows if topic in (MASTER, *plan.roles) else ():
            if row.kind in (FieldType.NUMBER, FieldType.STOREYS) and row is not signals.TIME:
                name = prefix(topic) + row.name
                found[f"{topic}.{name}" if topic != MASTER and name in own else name] = topic, row
    return found


def prefix(topic: str) -> str:
    """What stands before a signal's name in the topic of a named slave."""
    return f"{name_of(topic)}." if name_of(topic) else ""


@dataclass(frozen=True)
class SignalSource:
    """Where one of our signals comes from: ours = scale · theirs + offset, or a known value."""

    column: str = key("name of a column in the data", default="")
    scale: float = key("factor", default=1.0)
    offset: float = key("offset", default=0.0)
    value: float | None = field(default=None, metadata=key("known value", default=0.0).metadata)


@dataclass(frozen=True)
class Mapping:
    """A map file: nominal models, time base, and our signals."""

    plan: Plan
    signals: dict[str, SignalSource]
    time: str
    rate: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `import`."""
    parser.add_argument("data", type=Path, metavar="DATA", help="measurements: .csv, .parquet, .mat or .npz")
    parser.add_argument(
        "--map", type=Path, required=True, metavar="MAP", help="TOML file that says what is what"
    )
    cli.output_argument(parser, "FILE", "the recording to write", required=True)
    cli.force_argument(parser)
    cli.json_argument(parser, "say what was written as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Import."""
    inputs = (args.data, args.map)
    outputs.checked(args.output, args.force, inputs)
    with Progress("importing"):
        from report.text import tabular

        mapping = load_map(args.map)
        columns = tabular.read(args.data)
        t, values = resampled(mapping, columns, args.data)
        with outputs.writing(args.output, args.force, inputs) as path:
            write(path, mapping, t, values, args.data.name)
    show(args, mapping, t.size, list(values))
    return 0


def show(args: argparse.Namespace, mapping: Mapping, ticks: int, present: list[str]) -> None:
    """Say what was written, and which signals are absent."""
    absent = [name for name in lab_signals(mapping.plan) if name not in present]
    say = outputs.aside(args.output).write
    if args.json:
        report = {"file": str(args.output), "ticks": ticks, "signals": present, "absent": absent}
        say(json.dumps(report) + "\n")
        return
    interval = mapping.plan.test.interval
    say(f"{args.output}: {ticks} ticks of {interval:g} s; signals: {', '.join(present)}\n")
    say(f"absent: {', '.join(absent) or 'none'}\n")


def load_map(path: Path) -> Mapping:
    """A map file; raises InputError naming what is wrong in it."""
    tables = load_tables(path, "map")
    known = ("plan", "time", "rate", "signals")
    for name in tables:
        if name not in known:
            raise InputError(f"Unknown key '{name}' in {path}: {nearest(name, known)}")
    if ("time" in tables) == ("rate" in tables) or not isinstance(tables.get("rate", 1.0), int | float):
        raise InputError(
            f'{path}: give either time = "name of the time column" or rate = samples per second.'
        )
    if not isinstance(tables.get("plan"), str) or not tables.get("signals"):
        raise InputError(f'{path}: give plan = "file.toml" and a table [signals].')
    plan = plans.load(path.parent / tables["plan"])
    known_signals = lab_signals(plan)
    sources = {name: source(path, name, entry, known_signals) for name, entry in tables["signals"].items()}
    for name in sources:
        _, row = known_signals[name]
        per = "storey" if plan.storeys > 1 and row.kind is FieldType.STOREYS else ""
        per = "slave" if len(plan.roles) > 1 and row.slaves else per
        if per:
            raise InputError(
                f"{path}: '{name}' has one value per {per} here and cannot be given as one column."
            )
    return Mapping(plan, sources, str(tables.get("time", "")), float(tables.get("rate", 0.0)))


def source(path: Path, name: str, entry: dict[str, Any], known_signals: Known) -> SignalSource:
    """One row of [signals]."""
    if name not in known_signals:
        raise InputError(f"Unknown signal '{name}' in {path}: {nearest(name, known_signals)}")
    try:
        values = dict(entry)
        known = values.pop("value", None)
        row = fill(SignalSource, values, f"signals.{name}")
    except (PlanError, TypeError, ValueError) as error:
        raise InputError(f"{path}: {error}") from None
    if known is not None and (isinstance(known, bool) or not isinstance(known, int | float)):
        raise InputError(f"{path}: value of '{name}' in [signals] must be a number, not {known!r}.")
    if (known is None) == (not row.column):
        raise InputError(f"{path}: '{name}' in [signals] must have either a column or a value.")
    return SignalSource(row.column, row.scale, row.offset, None if known is None else float(known))


def resampled(mapping: Mapping, columns: dict[str, Any], data: Path) -> tuple[Any, dict[str, Any]]:
    """Test time from 0 at the plan's interval, and our signals there, by linear interpolation."""
    import numpy as np

    theirs = time_base(mapping, columns, data)
    interval = mapping.plan.test.interval
    t = np.arange(int(np.floor((theirs[-1] - theirs[0]) / interval + 1e-9)) + 1) * interval
    values = {}
    for name, row in mapping.signals.items():
        if row.value is not None:
            values[name] = np.full(t.size, row.value)
            continue
        column = pick(columns, row.column, data)
        bad = np.flatnonzero(~np.isfinite(column))
        if bad.size:
            raise InputError(
                f"{data}: column '{row.column}' has no number in row {bad[0] + 1}: fill or cut the gap."
            )
        values[name] = np.interp(t, theirs - theirs[0], row.scale * column + row.offset)
    return t, values


def time_base(mapping: Mapping, columns: dict[str, Any], data: Path) -> Any:
    """Times of the rows, s; raises InputError where they do not increase."""
    import numpy as np

    if not mapping.time:
        return np.arange(len(next(iter(columns.values())))) / mapping.rate
    t = pick(columns, mapping.time, data)
    bad = np.flatnonzero(~(np.diff(t) > 0.0))
    if bad.size or t.size < 2:
        row = int(bad[0]) + 2 if bad.size else t.size
        raise InputError(f"{data}: the time in column '{mapping.time}' does not increase at row {row}.")
    return t


def pick(columns: dict[str, Any], name: str, data: Path) -> Any:
    """A column by name; raises InputError with the nearest name where there is none."""
    if name not in columns:
        raise InputError(f"{data} has no numeric column '{name}': {nearest(name, columns)}")
    return columns[name]


def write(path: Path, mapping: Mapping, t: Any, values: dict[str, Any], data: str) -> None:
    """The recording: the topics and fields that there are signals for, with the plan."""
    from common.recording.writer import Recording

    known = lab_signals(mapping.plan)
    given: dict[str, list[str]] = {}
    for name in (name for name in known if name in values):
        given.setdefault(known[name][0], []).append(name)
    topics: dict[str, tuple[Signal, ...]] = {
        topic: (signals.SEQ, signals.TIME, *(known[name][1] for name in names))
        for topic, names in given.items()
    }
    plan = plans.with_test(mapping.plan, duration=t.size * mapping.plan.test.interval)
    recording = Recording(path, plan.test.name, plan.storeys, topics, plan.roles)
    recording.metadata("plan", {"toml": plan.toml(), "digest": plan.digest()})
    recording.describe()
    recording.metadata("import", {"data": data})
    for topic, names in given.items():
        table = zip(*(values[name].tolist() for name in names), strict=True)
        for tick, row in enumerate(table):
            at = plan.tick_ns(tick)
            recording.add(topic, at, at, (tick, float(t[tick]), *row))
    recording.close({"ticks_expected": str(t.size), "outcome": "import", "cause": "imported"})
