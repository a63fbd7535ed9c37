"""The histories of a prediction with their band, as they stand inside its page."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from common.plan.plan import Plan
from common.roles import MASTER, name_of
from laboratories.kinds import kinds_of
from loop.closed_loop import Rollout
from models.registry import Array
from report.page import data_uri
from report.pictures import figure
from report.run.drawing import INCH, DrawnPicture
from report.text.formats import axis_scale
from simulation.prediction.bands import Prediction

ROW = 1.35  # inches, the height of one signal's axes
CAPTION = "The laboratories as found, and the band of 90 % of those drawn."


def histories(found: Prediction) -> DrawnPicture:
    """Floors and responses of every laboratory, narrow and wide."""
    drawn = [png(found, width) for width in (figure.SINGLE, figure.DOUBLE)]
    (narrow, size), (wide, _) = drawn
    alt = "Histories of the predicted response with their bands"
    return DrawnPicture("prediction", data_uri(narrow), size, alt, CAPTION, data_uri(wide))


def png(found: Prediction, width: float) -> tuple[bytes, tuple[int, int]]:
    """The picture's file and its CSS pixels."""
    shown = rows(found.plan)
    canvas = figure.figure(width, 0.45 + ROW * len(shown))
    axes = canvas.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    time = np.arange(found.middle.ticks, dtype=np.float64) * found.plan.test.interval
    for axis, (label, unit, role, name) in zip(axes, shown, strict=True):
        row(axis, time, [series(one, role, name) for one in (found.low, found.middle, found.high)], unit)
        axis.set_ylabel(f"{label}\n{axis_scale(peak(found, role, name), unit)[1]}")
        axis.margins(x=0.01)
    return as_png(canvas, axes)


def as_png(canvas: Any, axes: Any) -> tuple[bytes, tuple[int, int]]:
    """A figure whose `axes` stand above each other over the time: its file and its CSS pixels."""
    axes[-1].set_xlabel("time, s")
    canvas.align_ylabels(axes)
    stream = io.BytesIO()
    canvas.savefig(stream, format="png", dpi=figure.DOTS, metadata=figure.STAMPS[".png"])
    across, high = (round(INCH * float(inches)) for inches in canvas.get_size_inches())
    return stream.getvalue(), (across, high)


def row(axis: Any, time: Array, ends: list[Array], unit: str) -> None:
    """One signal: its band and the laboratories as found."""
    factor = axis_scale(float(max(np.max(np.abs(one)) for one in ends)), unit)[0]
    low, middle, high = (factor * one for one in ends)
    axis.fill_between(time, low, high, color=figure.COLOURS[5], alpha=0.6, linewidth=0)
    axis.plot(time, middle, color=figure.COLOURS[0], linewidth=0.6)


def series(rollout: Rollout, role: str, name: str) -> Array:
    """A signal of a rollout; of several storeys the topmost."""
    values = (rollout.master if role == MASTER else rollout.slaves[role])[name]
    return values if values.ndim == 1 else values[:, -1]


def peak(found: Prediction, role: str, name: str) -> float:
    """The largest magnitude of a signal's band."""
    return float(max(np.max(np.abs(series(one, role, name))) for one in (found.low, found.high)))


def rows(plan: Plan) -> list[tuple[str, str, str, str]]:
    """Label, unit, role and name of every row."""
    result = [("top floor" if plan.storeys > 1 else "floor", "m", MASTER, "displacement")]
    for role, kind in kinds_of(plan).items():
        units = {row.name: row.unit for row in kind.channels.measured}
        names = dict.fromkeys((*kind.responses, kind.channels.position, kind.channels.force))
        for name in names:
            where = f"{name_of(role)} " if name_of(role) else ""
            result.append((where + name.replace("_", " "), units[name], role, name))
    return result
