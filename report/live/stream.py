"""The points of a trace on their way to a browser: what is new of each signal, in the unit in which it is shown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from bokeh.models import ColumnDataSource

from common.roles import LATENCY, MASTER, SLAVE, latency_topic
from report.facts.laboratories import LaboratoryFacts
from report.live.feed import Feed
from report.live.trace import Trace

MICROSECONDS = {"round_trip": 1e6}


def factors(labs: Iterable[LaboratoryFacts]) -> dict[str, float]:
    """From SI to the unit of the axes by signal: mm, kN where a kind of laboratory wants it; 1 where there is none."""
    found = dict(MICROSECONDS)
    for lab in labs:
        rows = (lab.channels.target, *lab.channels.measured)
        found |= {row.name: 1e3 for row in rows if row.unit == "m"}
        found |= {loop.force: 1e-3 for loop in lab.pictured.loops if loop.unit == "kN"}
    return found


class Stream:
    """One trace as a source for all plots of its signals, each times its factor."""

    def __init__(self, names: Iterable[str], scales: Mapping[str, float]) -> None:
        self._nothing: dict[str, Any] = {name: [0.0] for name in names}  # a point, for axes to be drawn
        self.source = ColumnDataSource(self._nothing)
        self._scales = scales
        self._trace: Trace | None = None
        self._total = 0

    def fits(self, trace: Trace) -> bool:
        """Whether the plots are of the signals of a trace, which those made before the recording began may not be."""
        return trace.names in (frozenset(), frozenset(self._nothing))

    def follow(self, trace: Trace) -> None:
        """Send what is new, or all of it where it is another trace than before."""
        if not self.fits(trace):
            return
        anew = trace is not self._trace
        new = trace.since(0 if anew else self._total)
        count = next((values.size for values in new.values()), 0)
        points: dict[str, Any] = {name: self._scales.get(name, 1.0) * values for name, values in new.items()}
        if anew:
            self.source.data = points if count else self._nothing
        elif count:
            # Lists, since bokeh sends each array as a message of its own.
            few = {name: values.tolist() for name, values in points.items()}
            self.source.stream(few, rollover=trace.room)
        self._trace, self._total = trace if count or not anew else None, trace.total


class Streams:
    """The traces of a test as one page shows them; those of one slave at a time."""

    def __init__(self, feed: Feed) -> None:
        scales = factors(feed.laboratories)
        self.master, self.slave, self.latency = (
            Stream(feed.names(kind), scales) for kind in (MASTER, SLAVE, LATENCY)
        )

    def follow(self, feed: Feed, role: str) -> None:
        """Send what is new; `role` is that of the slave, empty for a test without one."""
        self.master.follow(feed.trace(MASTER))
        if role:
            self.slave.follow(feed.trace(role))
            self.latency.follow(feed.trace(latency_topic(role)))
