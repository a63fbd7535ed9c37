"""A test over its prediction: the histories that were measured, the prediction with its band, on one page."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from common.recording.holds import before_hold
from common.recording.run import Run, Values
from report.facts.laboratories import whole_plan
from report.page import data_uri, frame, render
from report.pictures import figure
from report.prediction import sentences
from report.prediction.pictures import ROW, as_png, rows
from report.run.drawing import DrawnPicture
from report.text.formats import axis_scale, quantity
from report.text.terminal import TitledTable
from simulation.prediction import file
from simulation.prediction.held import Held

CAPTION = "Measured (orange) over the laboratories as found (blue) and the band of 90 % (light blue)."


class Overlay(NamedTuple):
    """One signal, each (ticks,) at the ticks in common; of several storeys the topmost."""

    label: str
    unit: str
    t: Values  # s
    measured: Values
    low: Values
    middle: Values
    high: Values


def page(found: Held, measured: Run, predicted: Run) -> str:
    """The page's text."""
    body = render(
        "overlay.html",
        test=measured.test,
        facts=[
            ("measured", measured.path.name),
            ("predicted", predicted.path.name),
            ("compared", f"{found.ticks} ticks"),
        ],
        sentences=sentences.every(found),
        picture=histories(overlays(before_hold(measured)[0], predicted)),
        signals=signals(found),
    )
    return frame(f"Measured and predicted: {measured.test}", body)


def overlays(measured: Run, predicted: Run) -> list[Overlay]:
    """Floors and responses of every laboratory that both hold."""
    plan = whole_plan(predicted)
    found = []
    for label, unit, role, name in rows(plan) if plan else []:
        ends = [predicted.columns.get(topic, {}).get(name) for topic in topics_of(role)]
        values = measured.columns.get(role, {}).get(name)
        if values is None or any(end is None for end in ends):
            continue
        _, mine, theirs = np.intersect1d(
            measured.sequences[role], predicted.sequences[role], return_indices=True
        )
        columns = [one_of(values)[mine], *(one_of(end)[theirs] for end in ends if end is not None)]
        found.append(Overlay(label, unit, measured.columns[role]["t"][mine], *columns))
    return found


def topics_of(role: str) -> tuple[str, str, str]:
    """The topics of a prediction's lower end, of its middle and of its upper end."""
    return file.band_topic(file.LOWER, role), role, file.band_topic(file.UPPER, role)


def one_of(values: Values) -> Values:
    """A column of a single number; of several storeys the topmost."""
    return values if values.ndim == 1 else values[:, -1]


def histories(shown: list[Overlay]) -> DrawnPicture:
    """The histories over each other, narrow and wide."""
    drawn = [png(shown, width) for width in (figure.SINGLE, figure.DOUBLE)]
    (narrow, size), (wide, _) = drawn
    alt = "Histories of the measured response over the predicted one with its bands"
    return DrawnPicture("overlay", data_uri(narrow), size, alt, CAPTION, data_uri(wide))


def png(shown: list[Overlay], width: float) -> tuple[bytes, tuple[int, int]]:
    """The picture's file and its CSS pixels."""
    canvas = figure.figure(width, 0.45 + ROW * max(len(shown), 1))
    axes = canvas.subplots(max(len(shown), 1), 1, sharex=True, squeeze=False)[:, 0]
    for axis, one in zip(axes, shown, strict=False):
        row(axis, one)
    return as_png(canvas, axes)


def row(axis: Any, one: Overlay) -> None:
    """One signal: band, prediction and measurement."""
    largest = max(float(np.max(np.abs(values))) for values in one[3:])
    factor, unit = axis_scale(largest, one.unit)
    axis.fill_between(
        one.t, factor * one.low, factor * one.high, color=figure.COLOURS[5], alpha=0.6, linewidth=0
    )
    axis.plot(one.t, factor * one.middle, color=figure.COLOURS[0], linewidth=0.6)
    axis.plot(one.t, factor * one.measured, color=figure.COLOURS[1], linewidth=0.5)
    axis.set_ylabel(f"{one.label}\n{unit}")
    axis.margins(x=0.01)


def signals(found: Held) -> TitledTable:
    """How each signal lay in its band."""
    table = [
        [
            name,
            f"{100 * one.inside:.0f} %",
            f"{one.departures[0].start:.2f} s" if one.departures else "–",
            f"{one.farthest:.1f} half widths at {one.farthest_at:.2f} s" if one.farthest else "–",
            quantity(one.peak, one.unit),
        ]
        for name, one in found.signals.items()
    ]
    return TitledTable("", ["signal", "inside", "first left", "farthest outside", "peak measured"], table)
