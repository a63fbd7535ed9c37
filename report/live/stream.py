"""The points of a trace on their way to a browser: what is new of each signal, in the unit in which it is shown."""

from __future__ import annotations

from typing import Any

from bokeh.models import ColumnDataSource

from common.roles import LATENCY, MASTER, SLAVE, latency_topic
from report.live.feed import SIGNALS, Feed
from report.live.trace import Trace

FACTORS = {  # from SI to the unit of the axes; 1 where there is none
    "column_target": 1e3,  # mm
    "column_displacement": 1e3,
    "column_force": 1e-3,  # kN
    "table_target": 1e3,  # mm
    "table_displacement": 1e3,
    "damper_stroke": 1e3,
    "round_trip": 1e6,  # µs
}


class Stream:
    """One trace as a source for all plots of its signals."""

    def __init__(self, kind: str) -> None:
        self._nothing: dict[str, Any] = {
            name: [0.0] for name in SIGNALS[kind]
        }  # a point, for axes to be drawn
        self.source = ColumnDataSource(self._nothing)
        self._trace: Trace | None = None
        self._total = 0

    def follow(self, trace: Trace) -> None:
        """Send what is new, or all of it where it is another trace than before."""
        anew = trace is not self._trace
        new = trace.since(0 if anew else self._total)
        count = next((values.size for values in new.values()), 0)
        points: dict[str, Any] = {name: FACTORS.get(name, 1.0) * values for name, values in new.items()}
        if anew:
            self.source.data = points if count else self._nothing
        elif count:
            few = {
                name: values.tolist() for name, values in points.items()
            }  # each array is a message of its own
            self.source.stream(few, rollover=trace.room)
        self._trace, self._total = trace if count or not anew else None, trace.total


class Streams:
    """The traces of a test as one page shows them; those of one slave at a time."""

    def __init__(self) -> None:
        self.master, self.slave, self.latency = Stream(MASTER), Stream(SLAVE), Stream(LATENCY)

    def follow(self, feed: Feed, role: str) -> None:
        """Send what is new; `role` is that of the slave."""
        self.master.follow(feed.trace(MASTER))
        self.slave.follow(feed.trace(role))
        self.latency.follow(feed.trace(latency_topic(role)))
