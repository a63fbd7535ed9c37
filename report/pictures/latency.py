"""The time of a tick: the distribution of every segment, and the round trip over the test."""

from __future__ import annotations

from typing import Any

import numpy as np

from common.recording.run import Run
from report.facts.circumstances import VIRTUAL, clock_of
from report.pictures.curves import Values, interval
from report.pictures.figure import COLOURS
from report.pictures.layout import bound, decades, legend_above

MICRO = 1e6
BINS = 150  # stretches of the test: two points for each millimetre of a column's width
LEAST = 1.0  # µs at which shorter times are drawn, because the axis is logarithmic
MARKS = (
    ("p50", 50.0, "o", COLOURS[0]),
    ("p99", 99.0, "|", COLOURS[1]),
    ("p99.9", 99.9, "d", COLOURS[3]),
    ("max", 100.0, "x", "black"),
)


def draw(recording: Run, canvas: Any) -> bool:
    """Percentiles by segment above, the round trip below; False where nothing was measured, as in virtual time."""
    measured = segments(recording)
    if "round_trip" not in measured or clock_of(recording) == VIRTUAL:
        return False
    period = interval(recording.columns.get("master", {}).get("t", np.array([])))
    halves = canvas.subfigures(2, 1, height_ratios=(3, 2))  # each with a left margin of its own
    spread(halves[0].subplots(), measured, period)
    over_time(halves[1].subplots(), recording.columns["latency"], period)
    return True


def segments(recording: Run) -> dict[str, Values]:
    """What was measured of every segment, µs, in the order of a tick."""
    from report.facts.summary import SEGMENTS

    columns = recording.columns.get("latency", {})
    found = {name: MICRO * columns[name][np.isfinite(columns[name])] for name in SEGMENTS if name in columns}
    return {name: values for name, values in found.items() if values.size and values.max() > 0.0}


def spread(axis: Any, measured: dict[str, Values], period: float) -> None:
    """A row for each segment, from its median to its largest."""
    rows = np.arange(len(measured))
    levels = {
        label: np.maximum([np.percentile(values, share) for values in measured.values()], LEAST)
        for label, share, _, _ in MARKS
    }
    axis.hlines(rows, levels["p50"], levels["max"], color=COLOURS[5], linewidth=1.5)
    for label, _, marker, colour in MARKS:
        face = {"markerfacecolor": "white"} if marker == "d" else {}
        axis.plot(levels[label], rows, marker, color=colour, markersize=4.5, label=label, **face)
    if np.isfinite(period):
        bound(axis, f"interval {1e3 * period:g} ms", x=MICRO * period)
    axis.set_yticks(rows, [name.replace("_", " ") for name in measured])
    axis.set(xscale="log", xlabel="time, µs", ylabel="part of a tick")
    axis.invert_yaxis()
    axis.grid(visible=False, axis="y")
    decades(axis.xaxis)
    legend_above(axis, 2)


def over_time(axis: Any, columns: dict[str, Values], period: float) -> None:
    """The usual and the longest round trip of successive stretches, and the ticks that were late."""
    known = np.isfinite(columns["round_trip"])
    trips = np.maximum(MICRO * columns["round_trip"][known], LEAST)
    unit, label = (period, "time, s") if np.isfinite(period) else (1.0, "time, ticks")
    at = unit * columns["seq"][known]
    parts = np.array_split(np.arange(at.size), min(BINS, at.size))
    middle = [float(np.mean(at[part])) for part in parts]
    axis.plot(middle, [np.max(trips[p]) for p in parts], color=COLOURS[1], linewidth=0.8, label="longest")
    axis.plot(middle, [np.median(trips[p]) for p in parts], linestyle=(0, (4, 2)), label="median")
    if np.isfinite(period):
        bound(axis, f"interval {1e3 * period:g} ms", y=MICRO * period)
    axis.set(yscale="log", xlabel=label, ylabel="round trip, µs")
    mark_late(axis, columns, unit)
    decades(axis.yaxis)
    legend_above(axis, 2)


def mark_late(axis: Any, columns: dict[str, Values], unit: float) -> None:
    """A stroke at the bottom for each tick whose deadline was missed."""
    late = columns["seq"][columns.get("deadline_missed", np.zeros(columns["seq"].size)).astype(bool)]
    if late.size:
        axis.plot(
            unit * late,
            np.full(late.size, 0.03),
            "|",
            color="black",
            markersize=4,
            transform=axis.get_xaxis_transform(),
            label="late",
        )
