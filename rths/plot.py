"""`rths plot`: pictures of a recording."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from common import cli
from common.errors import InputError
from common.roles import name_of, title

if TYPE_CHECKING:
    from common.recording.reader import Run

FORMATS = ("png", "svg", "pdf")
LEGEND_ROWS = 4  # as many stand beside one of six axes


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `plot`."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a recording (MCAP)")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER", help="where to (default: beside the recording)"
    )
    parser.add_argument(
        "--format", choices=FORMATS, default="png", help="format of the pictures (default: png)"
    )
    cli.json_argument(parser, "name the pictures as JSON on standard output")


def run(args: argparse.Namespace) -> int:
    """Draw whatever the recording has signals for."""
    from common.recording.reader import read

    recording = read(args.file)
    folder = args.output or args.file.with_suffix("")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"Cannot make the folder {folder}: {error.strerror}; give another with -o."
        ) from None
    paths = [
        str(path)
        for role in recording.roles
        for name, draw in PICTURES.items()
        if picture(recording, role, draw, path := folder / f"{labelled(name, role)}.{args.format}")
    ]
    if not paths:
        raise InputError(f"{args.file} has no signals for any picture: see rths inspect {args.file}.")
    sys.stdout.write(json.dumps({"pictures": paths}) if args.json else "\n".join(paths))
    sys.stdout.write("\n")
    return 0


def labelled(name: str, role: str) -> str:
    """The picture's file, with the slave's name where it has one."""
    return f"{name}-{name_of(role)}" if name_of(role) else name


def picture(recording: Run, role: str, draw: Callable[[Run, Any], bool], path: Path) -> bool:
    """Draw one picture of what concerns a slave into a file; False where the recording lacks its signals."""
    from rths.figure import figure

    canvas = figure()
    if not draw(recording.of(role), canvas):
        return False
    canvas.suptitle(caption(recording, role), fontsize=8, x=0.01, ha="left", wrap=True)
    try:
        canvas.savefig(path)
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror}; give another folder with -o.") from None
    return True


def caption(recording: Run, role: str) -> str:
    """What was tested, which slave is shown where it has a name; under it, under which motion."""
    motion = recording.metadata.get("ground_motion", {})
    test = f"{recording.test}, {title(role)}" if name_of(role) else recording.test
    lines = [test, f"{motion['record']}, × {motion['scale']}"] if motion else [test]
    return "\n".join(lines)


def histories(recording: Run, canvas: Any) -> bool:
    """Time histories: ground, drift, forces, damper."""
    rows = [
        ("ground_acceleration", 1.0, "ground\nm/s²"),
        ("column_displacement", 1e3, "column\nmm"),
        ("column_force", 1e-3, "column\nkN"),
        ("absolute_acceleration", 1.0, "floor\nm/s²"),
        ("damper_stroke", 1e3, "damper\nmm"),
        ("damper_force", 1.0, "damper\nN"),
    ]
    present = [(name, factor, label) for name, factor, label in rows if recording.signal(name) is not None]
    if not present:
        return False
    axes = canvas.subplots(len(present), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (name, factor, label) in zip(axes, present, strict=True):
        lines = axis.plot(time_of(recording, name), factor * values(recording, name), linewidth=0.7)
        axis.set_ylabel(label)
        if len(lines) > 1:
            number_floors(axis, lines)
    axes[-1].set_xlabel("time, s")
    return True


def number_floors(axis: Any, lines: Sequence[Any]) -> None:
    """A colour and a number for each floor's line, the lowest in front, and their legend beside the axis."""
    import matplotlib as mpl

    from rths.figure import COLOURS

    count = len(lines)
    many = mpl.colormaps["viridis"].resampled(count)
    for place, line in enumerate(lines):
        line.set(zorder=3.0 - place / count)  # the upper floors move more and would cover it
        if count > len(COLOURS):
            line.set(color=many(place))
    axis.legend(
        lines,
        range(1, count + 1),
        title="floor",
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        fontsize=7,
        title_fontsize=7,
        labelspacing=0.2,
        handlelength=1.2,
        columnspacing=0.8,
        ncols=-(-count // LEGEND_ROWS),
    )


def values(recording: Run, name: str) -> Any:
    """A signal that is known to be there."""
    return recording.signal(name)


def time_of(recording: Run, name: str) -> Any:
    """Test time of a signal's messages."""
    for topic in ("slave", "master"):
        if name in recording.columns.get(topic, {}) and recording.columns[topic][name] is recording.signal(
            name
        ):
            return recording.columns[topic]["t"]
    return recording.columns["master"]["t"]


def hysteresis(recording: Run, canvas: Any) -> bool:
    """Force against deformation of the column, and against stroke of the damper."""
    loops = [
        ("column_displacement", 1e3, "column deformation, mm", "column_force", 1e-3, "column force, kN"),
        ("damper_stroke", 1e3, "damper stroke, mm", "damper_force", 1.0, "damper force, N"),
    ]
    present = [
        row for row in loops if recording.signal(row[0]) is not None and recording.signal(row[3]) is not None
    ]
    if not present:
        return False
    axes = canvas.subplots(1, len(present), squeeze=False)[0]
    for axis, (x, x_factor, x_label, y, y_factor, y_label) in zip(axes, present, strict=True):
        axis.plot(x_factor * values(recording, x), y_factor * values(recording, y), linewidth=0.5)
        axis.set_xlabel(x_label)
        axis.set_ylabel(y_label)
    return True


def tracking(recording: Run, canvas: Any) -> bool:
    """Target and measurement of both transfer systems around the strongest motion, and their error."""
    import numpy as np

    pairs = [
        ("master", "column_target", "column_displacement", "column deformation, mm", 0),
        ("slave", "table_command", "table_displacement", "table displacement, mm", 1),
    ]
    present = [row for row in pairs if {row[1], row[2]} <= recording.columns.get(row[0], {}).keys()]
    if not present:
        return False
    axes = canvas.subplots(2, len(present), sharex="col", squeeze=False)
    for place, (topic, target, measured, label, shift) in enumerate(present):
        columns = recording.columns[topic]
        t = columns["t"][shift:]
        wanted, got = columns[target][: t.size] * 1e3, columns[measured][shift:] * 1e3
        middle = t[int(np.argmax(np.abs(wanted)))]
        window = (t >= middle - 1.5) & (t <= middle + 1.5)
        axes[0, place].plot(t[window], wanted[window], label="target")
        axes[0, place].plot(t[window], got[window], "--", label="measured")
        axes[0, place].set_ylabel(label)
        axes[0, place].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
        axes[1, place].plot(t[window], (got - wanted)[window])
        axes[1, place].set_ylabel("measured − target, mm")
        axes[1, place].set_xlabel("time, s")
    return True


def latency(recording: Run, canvas: Any) -> bool:
    """Where the time of a tick goes: distribution of every segment, and the round trip over the test."""
    import numpy as np

    from rths.figure import COLOURS
    from rths.summary import SEGMENTS

    columns = recording.columns.get("latency", {})
    measured = {name: columns[name][np.isfinite(columns[name])] * 1e6 for name in SEGMENTS if name in columns}
    measured = {name: column for name, column in measured.items() if column.size and column.max() > 0.0}
    if "round_trip" not in measured:  # virtual time, or nothing came back
        return False
    upper, lower = canvas.subplots(2, 1)
    for place, (name, column) in enumerate(measured.items()):
        ordered = np.sort(np.maximum(column, 1.0))
        above = 1.0 - np.arange(ordered.size) / ordered.size
        style = "-" if place < len(COLOURS) else "--"  # from there on colours come again
        upper.plot(ordered, above, style, label=name.replace("_", " "))
    upper.set(xscale="log", yscale="log", xlabel="time, µs", ylabel="share of ticks above")
    upper.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    seq = columns["seq"][np.isfinite(columns["round_trip"])]
    lower.plot(seq, measured["round_trip"], ".", markersize=1)
    lower.set(yscale="log", xlabel="tick", ylabel="round trip, µs")
    return True


PICTURES: dict[str, Callable[[Any, Any], bool]] = {
    "histories": histories,
    "hysteresis": hysteresis,
    "tracking": tracking,
    "latency": latency,
}
