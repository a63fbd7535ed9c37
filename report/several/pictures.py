"""The histories of several recordings over the time since each one's start, as they stand inside their page."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from report.page import data_uri
from report.pictures import figure
from report.run.drawing import INCH, DrawnPicture
from report.several.runs import ChosenSignal, OneRun
from report.text.formats import axis_scale

ROW = 1.35  # inches, the height of one signal's axes
NAMED = 12  # recordings that a legend can name; more are coloured in their order
PER_ROW = {figure.SINGLE: 2, figure.DOUBLE: 4}  # names in a row of the legend, by the figure's width


def histories(runs: Sequence[OneRun], signals: Sequence[ChosenSignal]) -> DrawnPicture:
    """One row for each signal, narrow and wide."""
    (narrow, size), (wide, _) = (png(runs, signals, width) for width in PER_ROW)
    caption = "Histories over the time since the start of each recording."
    if len(runs) > NAMED:
        caption += f" From dark to light: {runs[0].label} to {runs[-1].label} in the order of the tables."
    return DrawnPicture(
        "histories", data_uri(narrow), size, "Histories of all recordings", caption, data_uri(wide)
    )


def png(
    runs: Sequence[OneRun], signals: Sequence[ChosenSignal], width: float
) -> tuple[bytes, tuple[int, int]]:
    """The picture's file and its CSS pixels."""
    names = len(runs) if len(runs) <= NAMED else 0
    legend = 0.16 * -(-names // PER_ROW[width])
    canvas = figure.figure(width, 0.45 + legend + ROW * len(signals))
    axes = canvas.subplots(len(signals), 1, sharex=True, squeeze=False)[:, 0]
    shades = colours(len(runs))
    for axis, signal in zip(axes, signals, strict=True):
        row(axis, runs, signal, shades)
    axes[-1].set_xlabel("time since the start, s")
    canvas.align_ylabels(axes)
    if names:
        lines = [axes[0].plot([], [], color=shade)[0] for shade in shades]
        canvas.legend(lines, [run.label for run in runs], loc="outside upper left", ncols=PER_ROW[width])
    stream = io.BytesIO()
    canvas.savefig(stream, format="png", dpi=figure.DOTS, metadata=figure.STAMPS[".png"])
    across, high = (round(INCH * float(inches)) for inches in canvas.get_size_inches())
    return stream.getvalue(), (across, high)


def colours(count: int) -> list[Any]:
    """A colour for each recording: distinct ones, or a scale of them where there are too many."""
    if count <= len(figure.COLOURS):
        return list(figure.COLOURS[:count])
    from matplotlib import colormaps

    return [colormaps["viridis"](share) for share in np.linspace(0.0, 0.92, count)]


def row(axis: Any, runs: Sequence[OneRun], signal: ChosenSignal, shades: Sequence[Any]) -> None:
    """One signal of all recordings that contain it."""
    here = [(run, shade) for run, shade in zip(runs, shades, strict=True) if signal.name in run.signals]
    size = max(float(np.nanmax(np.abs(run.signals[signal.name]), initial=0.0)) for run, _ in here)
    factor, unit = axis_scale(size, here[0][0].units[signal.name])
    if signal.unit:
        factor, unit = 1.0 / signal.factor, signal.unit
    for run, shade in here:
        axis.plot(run.time[signal.name], factor * run.signals[signal.name], color=shade, linewidth=0.6)
    axis.set_ylabel(f"{signal.name.replace('_', ' ')}\n{unit}")
    axis.margins(x=0.01)
