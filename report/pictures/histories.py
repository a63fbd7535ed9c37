"""Time histories: ground, column, floors, damper."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from common.recording.reader import Run
from report.pictures.curves import curve
from report.pictures.figure import COLOURS, SMALL
from report.pictures.layout import legend_above, shrink
from report.text.formats import axis_scale

ROWS = (
    ("ground_acceleration", "m/s²", "ground"),
    ("column_displacement", "m", "column"),
    ("column_force", "N", "column"),
    ("absolute_acceleration", "m/s²", "floor"),
    ("damper_stroke", "m", "damper"),
    ("damper_force", "N", "damper"),
)
LEGEND_COLUMNS = 6


def draw(recording: Run, canvas: Any) -> bool:
    """One row per quantity over the whole test; False where there is none."""
    rows = [(curve(recording, name), unit, label) for name, unit, label in ROWS]
    present = [(found, unit, label) for found, unit, label in rows if found is not None]
    if not present:
        return False
    shrink(canvas, len(present), len(ROWS))
    axes = canvas.subplots(len(present), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (found, unit, label) in zip(axes, present, strict=True):
        factor, name = axis_scale(float(np.nanmax(np.abs(found.values))), unit)
        lines = axis.plot(found.t, factor * found.values, linewidth=0.6)
        axis.set_ylabel(f"{label}\n{name}")
        axis.margins(x=0.01)
        if len(lines) > 1:
            number_floors(axis, lines)
    axes[-1].set_xlabel("time, s")
    canvas.align_ylabels(axes)
    return True


def number_floors(axis: Any, lines: Sequence[Any]) -> None:
    """A colour and a number for each floor's line, the lowest in front, and their legend above the axis."""
    import matplotlib as mpl

    count = len(lines)
    many = mpl.colormaps["viridis"].resampled(count)
    for place, line in enumerate(lines):
        line.set(zorder=3.0 - place / count, label=str(place + 1))  # the upper floors move more
        if count > len(COLOURS):
            line.set(color=many(place))
    legend = legend_above(axis, min(count, LEGEND_COLUMNS), title="floor", handlelength=1.2)
    legend.set_alignment("left")
    legend.get_title().set_fontsize(SMALL)
