"""Time histories: ground, column, floors, damper."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from common.recording.run import Run
from common.roles import MASTER
from report.pictures.curves import curve, labs_of
from report.pictures.figure import COLOURS, SMALL
from report.pictures.layout import legend_above, shrink
from report.text.formats import axis_scale

USUAL = 6  # rows of the default test
LEGEND_COLUMNS = 6


def draw(recording: Run, canvas: Any) -> bool:
    """One row per quantity over the whole test; False where there is none."""
    found = [(curve(recording, topic, name), unit, label) for topic, name, unit, label in rows(recording)]
    present = [(item, unit, label) for item, unit, label in found if item is not None]
    if not present:
        return False
    shrink(canvas, len(present), USUAL)
    axes = canvas.subplots(len(present), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (item, unit, label) in zip(axes, present, strict=True):
        factor, name = axis_scale(float(np.nanmax(np.abs(item.values))), unit)
        lines = axis.plot(item.t, factor * item.values, linewidth=0.6)
        axis.set_ylabel(f"{label}\n{name}")
        axis.margins(x=0.01)
        if len(lines) > 1:
            number_floors(axis, lines)
    axes[-1].set_xlabel("time, s")
    canvas.align_ylabels(axes)
    return True


def rows(recording: Run) -> list[tuple[str, str, str, str]]:
    """Topic, signal, unit and label of every row: the ground, laboratory A, the floors, laboratory B."""
    own: dict[bool, list[tuple[str, str, str, str]]] = {True: [], False: []}
    for lab in labs_of(recording):
        units = {signal.name: signal.unit for signal in lab.channels.measured}
        names = [(name, loop.name) for loop in lab.pictured.loops for name in (loop.motion, loop.force)]
        names += [(name, lab.pictured.name) for name in lab.pictured.also]
        own[lab.topic == MASTER] += [
            (lab.topic, name, units[name], label + lab.letter) for name, label in names
        ]
    ground = (MASTER, "ground_acceleration", "m/s²", "ground")
    return [ground, *own[True], (MASTER, "absolute_acceleration", "m/s²", "floor"), *own[False]]


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
