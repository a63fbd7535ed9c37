"""Plots of streams: curves over time, or of one signal over another."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from bokeh.models import DataRange1d
from bokeh.models.annotations import Legend, LegendItem
from bokeh.models.formatters import BasicTickFormatter
from bokeh.plotting import figure

from report.live.stream import Stream

# Powers of ten without an exponent on an axis: forces of a user's device are in N, up to 10 MN.
PLAIN_POWER = 7
HEIGHT = 230  # px of a plot: three rows of plots fit a screen
TOOLS = "pan,box_zoom,reset,save"
Scale = Literal["linear", "log"]


class ChartCurve(NamedTuple):
    """A signal in a plot: what the legend calls it, its colour, and how its line is drawn."""

    signal: str
    label: str
    colour: str
    dash: str = "solid"
    width: float = 1.5


def plot(title: str, across: str, up: str, scales: tuple[Scale, Scale], **options: Any) -> Any:
    """An empty plot as wide as its place, without tools that would catch the scrolling of a page."""
    found = figure(
        title=title,
        height=HEIGHT,
        sizing_mode="stretch_width",
        x_axis_label=across,
        y_axis_label=up,
        x_axis_type=scales[0],
        y_axis_type=scales[1],
        min_border_left=60,
        tools=TOOLS,
        active_drag=None,
        **options,
    )
    if scales[1] == "linear":
        found.yaxis[0].formatter = BasicTickFormatter(power_limit_high=PLAIN_POWER)
    found.toolbar.autohide = True
    found.toolbar.logo = None
    return found


def history(
    title: str,
    up: str,
    stream: Stream,
    curves: tuple[ChartCurve, ...],
    window: float | None,
    *,
    scale: Scale = "linear",
    **options: Any,
) -> Any:
    """Curves over the last `window` s, or all; `up` is the label of their axis, with the unit."""
    latest: dict[str, Any] = {} if window is None else {"follow": "end", "follow_interval": window}
    across = DataRange1d(range_padding=0.0, **latest)
    found = plot(title, "time, s", up, ("linear", scale), x_range=across, **options)
    draw(found, stream, "t", curves)
    return found


def draw(where: Any, stream: Stream, over: str, curves: tuple[ChartCurve, ...]) -> None:
    """Draw the curves of a stream over one of its signals, with a legend above where there are several."""
    items = [
        LegendItem(
            label=curve.label,
            renderers=[
                where.line(
                    over,
                    curve.signal,
                    source=stream.source,
                    color=curve.colour,
                    line_dash=curve.dash,
                    line_width=curve.width,
                )
            ],
        )
        for curve in curves
    ]
    if len(curves) > 1:
        where.add_layout(Legend(items=items, orientation="horizontal", click_policy="hide"), "above")
