"""Round trip: the newest ones over time, and the histogram of all; neither in virtual time, where it is zero."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, Range1d
from bokeh.models.annotations import Span

from report.live.chart import ChartCurve, history, plot
from report.live.feed import EDGES, Feed, Timing
from report.live.stream import Streams
from report.pictures.figure import COLOURS

NONE = 0.5  # ticks at which bars begin: on a logarithmic scale half a tick stands for none
EVERY = 250  # ticks after which the histogram is drawn anew: twice a second at 2 ms
LABEL = "round trip, µs"


class Latency:
    """A plot over time and a histogram, the control interval marked in both."""

    def __init__(self, streams: Streams, window: float | None) -> None:
        curve = ChartCurve("round_trip", "round trip", COLOURS[0], width=1.0)
        trips = history(
            "longest round trips (dashed: interval)",
            LABEL,
            streams.latency,
            (curve,),
            window,
            scale="log",
            y_range=times(),
        )
        histogram = plot(
            "all round trips (dashed: interval)", LABEL, "ticks", ("log", "log"), x_range=times()
        )
        self.source = ColumnDataSource(bars(Timing()))
        histogram.quad(
            left="left", right="right", bottom=NONE, top="top", source=self.source, color=COLOURS[0]
        )
        histogram.y_range.start = NONE
        self._marks = [mark(trips, "width"), mark(histogram, "height")]
        self._shown: tuple[str, int] = ("", -EVERY)
        self.parts = {"trips": trips, "histogram": histogram}

    def forget(self) -> None:
        """Show the next test's from the begin."""
        self._shown = ("", -EVERY)

    def update(self, feed: Feed, role: str) -> None:
        """Show the histogram of a slave's exchange, and the interval once it is known."""
        timing = feed.timing(role)
        for figure in self.parts.values():
            if figure.visible == timing.instant:
                figure.visible = not timing.instant
        new = timing.ticks - self._shown[1]
        if role != self._shown[0] or new >= (1 if feed.ended else EVERY):
            self._shown = (role, timing.ticks)
            self.source.data["top"] = bars(timing)["top"]
        for span in self._marks:
            if feed.interval and not span.visible:
                span.update(location=feed.interval * 1e6, visible=True)


def times() -> Range1d:
    """The axis of a round trip, µs."""
    return Range1d(EDGES[0], EDGES[-1])


def mark(where: Any, dimension: Any) -> Span:
    """A line across a plot, which is shown when its place is known."""
    span = Span(dimension=dimension, line_color=COLOURS[1], line_dash="dashed", line_width=2.0, visible=False)
    where.add_layout(span)
    return span


def bars(timing: Timing) -> dict[str, Any]:
    """The histogram's columns, µs and ticks."""
    return {"left": EDGES[:-1], "right": EDGES[1:], "top": np.maximum(timing.counts, NONE).tolist()}
