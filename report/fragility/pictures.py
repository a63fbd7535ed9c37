"""Fragility curves as they stand inside their page."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from report.fragility.curves import Curves, FragilityCurve
from report.fragility.tables import asked, shown
from report.page import data_uri
from report.pictures import figure
from report.run.drawing import INCH, DrawnPicture
from simulation.sweep.fragility import chance

HIGH = 3.0  # inches
CAPTION = (
    "Lines: lognormal curves of greatest likelihood. Dots: shares of the tests at neighbouring intensities."
)


def drawing(found: Curves) -> DrawnPicture:
    """All curves with the shares behind them, narrow and wide."""
    (narrow, size), (wide, _) = (png(found, width) for width in (figure.SINGLE, figure.DOUBLE))
    return DrawnPicture("fragility", data_uri(narrow), size, f"The {asked(found)}", CAPTION, data_uri(wide))


def png(found: Curves, width: float) -> tuple[bytes, tuple[int, int]]:
    """The picture's file and its CSS pixels."""
    canvas = figure.figure(width, HIGH)
    axes = canvas.subplots()
    for place, one in enumerate(found.curves):
        draw(axes, one, figure.COLOURS[place % len(figure.COLOURS)])
    unit = f", {found.intensity_unit}" if found.intensity_unit else ""
    axes.set_xlabel(f"{found.intensity}{unit}")
    axes.set_ylabel("chance that the limit is passed")
    axes.set_ylim(-0.03, 1.03)
    if found.by:
        axes.legend(title=found.by)
    stream = io.BytesIO()
    canvas.savefig(stream, format="png", dpi=figure.DOTS, metadata=figure.STAMPS[".png"])
    across, high = (round(INCH * float(inches)) for inches in canvas.get_size_inches())
    return stream.getvalue(), (across, high)


def draw(axes: Any, one: FragilityCurve, colour: str) -> None:
    """One curve and its shares."""
    dots = shown(one)
    label = one.name or None
    axes.plot(
        [each.intensity for each in dots],
        [each.share for each in dots],
        "o",
        color=colour,
        markersize=3.5,
        label=None if one.fit.fitted else label,
    )
    if one.fit.fitted:
        along = np.linspace(0.0, one.stripes[-1].intensity, 301)[1:]
        axes.plot(along, chance(one.fit, along), color=colour, label=label)
