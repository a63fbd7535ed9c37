"""`rths import`: a recording made from measurements of another data logger, of a whole test or of one part."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from common import signals
from common.errors import InputError
from common.plan.read import with_test
from common.roles import LATENCY, MASTER, kind_of
from common.signals import Signal
from common.terminal import cli, outputs
from report.text.progress import Progress
from report.text.text_form import TextForm

if TYPE_CHECKING:
    from common.plan.plan import Plan
    from models.registry import Array
    from recorder.files import MotionRows
    from rths.examine.importing.import_map import ImportMap, Known
    from rths.examine.importing.onto_ticks import OnTicks

UNJUDGED = "the link cannot be judged, because the data hold no numbers and no time stamps of messages"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `import`."""
    parser.add_argument(
        "data",
        type=Path,
        metavar="DATA",
        help="measurements: text (.csv, .txt, .tsv, .dat, .asc, .lvm), .parquet, .mat or .npz",
    )
    parser.add_argument(
        "--map",
        type=Path,
        required=True,
        metavar="MAP",
        help="TOML file that says which column is which signal",
    )
    cli.output_argument(parser, "FILE", "the recording to write", required=True)
    parser.add_argument(
        "--as-is", action="store_true", help="import data even where a unit or a sign looks wrong"
    )
    cli.force_argument(parser)
    cli.json_argument(parser, "say what was written as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Import."""
    inputs = (args.data, args.map)
    outputs.checked(args.output, args.force, inputs)
    with Progress("importing"):
        from report.text import tabular
        from rths.examine.importing.beginning import begun
        from rths.examine.importing.import_map import load_map
        from rths.examine.importing.onto_ticks import on_ticks
        from rths.examine.importing.rest import readings_at_rest
        from rths.examine.importing.time_base import put_together, without_repeats

        stated = load_map(args.map)
        table = put_together(stated, tabular.read_table(args.data, stated.form), args.data)
        table, repeated = without_repeats(stated, table, args.data)
        mapping, begins = begun(stated, table, args.data)
        found = on_ticks(mapping, table, args.data, as_is=args.as_is)
        ground, unread = ground_of(mapping, found)
        rest = readings_at_rest(mapping, table, args.data, found)
        with outputs.writing(args.output, args.force, inputs) as path:
            write(path, mapping, found, args.data.name, ground, rest, as_is=args.as_is)
            doubts = [] if args.as_is else check_slips(path, args.data)
    told = ImportRemarks(table.form, unread, begins, rest, doubts, repeated)
    show(args, mapping, found, told)
    return 0


def ground_of(mapping: ImportMap, found: OnTicks) -> tuple[MotionRows | None, str]:
    """The plan's ground motion where a building was recorded, and the sentence that says why it cannot be read."""
    from loop.substructure import recorded_ground

    if not {row.name for row in signals.BUILDING} & found.values.keys():
        return None, ""
    try:
        return recorded_ground(plan_of(mapping, found)), ""
    except InputError as error:
        return None, str(error)


def plan_of(mapping: ImportMap, found: OnTicks) -> Plan:
    """The plan of the map, of a test as long as the data."""
    return with_test(mapping.plan, duration=found.t.size * mapping.plan.test.interval)


class ImportRemarks(NamedTuple):
    """What is told of an import beside its signals."""

    form: TextForm | None  # of a text file
    unread: str  # why the plan's ground motion could not be read, empty where it was
    begins: float | None  # s of the data, at which the test was found to begin
    rest: Mapping[str, Array]  # readings (ticks,) from before the test
    doubts: Sequence[str]  # sentences on readings of a doubtful size
    repeated: int  # rows that a logger wrote twice


def show(args: argparse.Namespace, mapping: ImportMap, found: OnTicks, told: ImportRemarks) -> None:
    """Say what was written and read, which signals are absent or interpolated, and what can be judged."""
    from rths.examine.importing.import_map import lab_signals

    known, present = lab_signals(mapping.plan), list(found.values)
    judged = exchange(mapping)
    absent = [name for name in known if name not in present]
    say = outputs.aside(args.output).write
    if args.json:
        report = {"file": str(args.output), "ticks": found.t.size, "signals": present, "absent": absent}
        report |= {
            "interpolated": found.interpolated,
            "clock": found.clock and {"begin": found.clock.begin, "fast": found.clock.fast},
            "link": "judged" if judged else UNJUDGED,
            "units": found.units,
            "gaps": found.gaps,
            "ends": found.ends,
            "left_out": found.left_out,
            "start": told.begins,
            "at_rest": [*told.rest],
            "ground_unread": told.unread,
            "text": told.form and told.form._asdict(),
            "doubts": [*told.doubts],
            "repeated": told.repeated,
        }
        say(json.dumps(report) + "\n")
        return
    rows = "rows without times" if mapping.static else f"ticks of {mapping.plan.test.interval:g} s"
    say(f"{args.output}: {found.t.size} {rows}; signals: {', '.join(present)}\n")
    say(f"absent: {', '.join(absent) or 'none'}\n")
    if (form := told.form) and form != TextForm():
        between = {"\t": "tabs", " ": "spaces"}.get(form.separator, f"'{form.separator}'")
        thousands = f", thousands parted by '{form.thousands}'" * bool(form.thousands)
        say(
            f"text: {between} between columns, decimal sign '{form.decimal}'{thousands}, {form.skip_rows} rows above "
            "the names\n"
        )
    if found.units:
        units = (f"{name} in {unit}" for name, unit in found.units.items())
        say(f"units, from the row below the names or from brackets in them: {', '.join(units)}\n")
    if found.interpolated:
        say(f"interpolated onto the ticks, and marked so: {', '.join(found.interpolated)}\n")
    for line in said_of_time(found, told):
        say(f"{line}\n")
    for doubt in told.doubts:
        say(f"check: {doubt}\n")
    if told.unread:
        say(f"ground: the whole test cannot be simulated from this recording: {told.unread}\n")
    if mapping.plan.roles and not (judged or mapping.static):
        say(f"link: {UNJUDGED}\n")


def said_of_time(found: OnTicks, told: ImportRemarks) -> Iterator[str]:
    """What was found about the data's time: when the test begins, what lies before, its clock, and rows that lack."""
    if told.begins is not None:
        yield f"start: the plan's ground motion begins at {told.begins:.6g} s of the data"
    if told.rest:
        yield f"at rest: {', '.join(told.rest)} before the test are kept, as they tell the noise of their sensors"
    if found.clock and found.clock.between:
        yield found.clock.told
    if any(found.ends):
        before, behind = found.ends
        yield f"left out, as not all columns have begun or go on there: {before} rows at the begin, {behind} at the end"
    if told.repeated:
        yield f"left out, as they repeat the row before them in every column: {told.repeated} rows"
    if found.left_out:
        yield f"left out, as a column has no number there: {found.left_out} rows"
    if found.gaps:
        begin, end = max(found.gaps, key=lambda gap: gap[1] - gap[0])
        more = f", and in {len(found.gaps) - 1} shorter gaps" if found.gaps[1:] else ""
        yield f"no rows from {begin:.6g} to {end:.6g} s{more}: straight lines stand there, which a diagnosis leaves out"


def exchange(mapping: ImportMap) -> bool:
    """Whether numbers or stamps of messages are among the signals."""
    from rths.examine.importing.import_map import STAMPS, lab_signals

    known = lab_signals(mapping.plan)
    rows = [known[name][1] for name in mapping.signals]
    return any(row.kind is signals.FieldType.INDEX or row.name in STAMPS for row in rows)


def write(
    path: Path,
    mapping: ImportMap,
    found: OnTicks,
    data: str,
    ground: MotionRows | None = None,
    rest: Mapping[str, Array] = MappingProxyType({}),
    *,
    as_is: bool = False,
) -> None:
    """Write the recording: topics and fields for the signals at hand, the plan, and what is stated of the channels.

    With its `ground` motion it can be judged without the file of that motion. `rest` are readings (ticks,) from before
    the test.
    """
    import numpy as np

    from common.recording.imported import IMPORT, REST, ImportedData
    from common.recording.writer import Recording
    from rths.examine.importing.import_map import lab_signals

    known = lab_signals(mapping.plan)
    given: dict[str, list[str]] = {}
    for name in (name for name in known if name in found.values):
        given.setdefault(known[name][0], []).append(name)
    plan = plan_of(mapping, found)
    columns = {topic: columns_of(topic, names, found, known) for topic, names in given.items()}
    stated = {
        topic: {known[name][1].name: found.stated[name] for name in names} for topic, names in given.items()
    }
    topics = {topic: tuple(rows) for topic, rows in columns.items()}
    recording = Recording(path, plan.test.name, plan.storeys, topics, plan.roles)
    recording.metadata("plan", {"toml": plan.toml(), "digest": plan.digest()})
    recording.describe()
    gaps = tuple((begin - found.begin, end - found.begin) for begin, end in found.gaps)
    kept = tuple((known[name][0], known[name][1].name) for name in rest)
    recording.metadata(IMPORT, ImportedData(data, mapping.static, stated, as_is, gaps, kept).metadata())
    if rest:
        readings = np.stack([*rest.values()]).astype("<f8")
        recording.attach(REST, readings.tobytes(), "application/octet-stream")
    if ground:
        recording.ground(ground[0].describe(), plan.ground_motion.scale, ground[1])
    for topic, rows in columns.items():
        for tick, values in enumerate(zip(*rows.values(), strict=True)):
            at = plan.tick_ns(tick)
            recording.add(topic, at, at, values)
    recording.close({"ticks_expected": str(found.t.size), "outcome": "import", "cause": "imported"})


def columns_of(topic: str, names: list[str], found: OnTicks, known: Known) -> dict[Signal, list[Any]]:
    """The fields of a topic with their values; time stamps belong together, so that missing ones hold NaN."""
    from rths.examine.importing.import_map import STAMPS

    columns: dict[Signal, list[Any]] = {signals.SEQ: list(range(found.t.size))}
    if kind_of(topic) == LATENCY:
        unknown = [math.nan] * found.t.size
        columns |= {row: unknown for row in signals.LATENCY if row.name in STAMPS}
    else:
        columns[signals.TIME] = found.t.tolist()
    for name in names:
        row = known[name][1]
        values = found.values[name]
        columns[row] = (values.astype(int) if row.kind is signals.FieldType.INDEX else values).tolist()
    return columns


def check_slips(path: Path, data: Path) -> list[str]:
    """Sentences on readings of a doubtful size in a recording that was just written.

    Raises:
        InputError: a unit or a sign looks wrong.
    """
    from common.recording.reader import read
    from diagnosis.recorded import record
    from diagnosis.recorded.slips import doubtful, refuse_slips

    run, doubts = read(path), list[str]()
    for role in run.roles or (MASTER,):
        try:
            built = record.build(run, role=role)
        except InputError:  # too few signals for any comparison
            continue
        refuse_slips(built, data)
        doubts += doubtful(built)
    return doubts
