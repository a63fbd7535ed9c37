"""The synchronisation subspace: each transfer system's measured motion over its target.

A delay opens the straight line to a loop, an error of amplitude tilts it. Source: Wallace, Sieber, Neild, Wagg and
Krauskopf, Stability analysis of real-time dynamic substructuring using delay differential equation models, Earthq. Eng.
Struct. Dyn. 34 (2005).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from common.recording.run import Run
from report.pictures.curves import Pair, pairs, quality
from report.pictures.figure import COLOURS, REFERENCE
from report.pictures.layout import legend_above, note, panels
from report.text.formats import axis_scale

ROOM = 0.05  # of the range, free at both ends of an axis, so that no curve touches the frame


def draw(recording: Run, canvas: Any) -> bool:
    """A square of measured over target for each transfer system, with the line of 1:1; False where there is none."""
    present = pairs(recording)
    if not present:
        return False
    for axis, pair in zip(panels(canvas, len(present), 2), present, strict=True):
        subspace(axis, pair)
    return True


def subspace(axis: Any, pair: Pair) -> None:
    """The whole test, its strongest seconds in front, and what `inspect` says of them all."""
    factor, unit = axis_scale(float(np.nanmax(np.abs([pair.wanted, pair.got]))), "m")
    x, y, strong = factor * pair.wanted, factor * pair.got, pair.strongest()
    low, high = float(np.nanmin([x, y])), float(np.nanmax([x, y]))
    ends = (low - ROOM * (high - low), high + ROOM * (high - low))
    axis.plot(x, y, color=COLOURS[5], linewidth=0.8, label="whole test")
    axis.plot(x[strong], y[strong], color=COLOURS[1], linewidth=0.9, label="strongest 3 s")
    line = (0, (4, 2))
    axis.plot(ends, ends, linestyle=line, color=REFERENCE, linewidth=0.7, label="1:1")
    axis.set(
        xlim=ends,
        ylim=ends,
        xlabel=f"{pair.word} of {pair.label}, {unit}",
        ylabel=f"measured {pair.label}, {unit}",
    )
    axis.set_box_aspect(1)
    axis.locator_params(nbins=6)
    note(axis, 0.03, 0.97, quality(pair))
    legend_above(axis, 3)
