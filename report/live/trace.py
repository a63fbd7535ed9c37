"""What a view keeps of a topic: the newest points of some signals, thinned to as many as a plot can show."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np

from common.recording.run import Values

Group = Mapping[str, Values]  # ticks that are thinned together, by signal
TIME = "t"


def largest(group: Group) -> Group:
    """The largest value of each signal, NaN where it has none."""
    return {name: np.fmax.reduce(column, keepdims=True) for name, column in group.items()}


def extremes(group: Group) -> Group:
    """The ticks at which a signal is smallest or largest, in order: at most two for each signal beside the time."""
    chosen = np.zeros(group[TIME].size, dtype=np.bool_)
    for name, column in group.items():
        if name != TIME and not np.isnan(column).all():
            chosen[[np.nanargmin(column), np.nanargmax(column)]] = True
    return {name: column[chosen] for name, column in group.items()}


class Trace:
    """The newest points of a topic, at most `room` of them: what `thin` leaves of each group of `step` ticks.

    Without `thin` that is the first tick of the group, which is there at once. `total` counts all points there ever
    were, so that several readers find what is new to each.
    """

    def __init__(self, step: int, room: int, thin: Callable[[Group], Group] | None = None) -> None:
        self.room = room
        self.total = 0
        self._step = step
        self._thin = thin
        self._points: dict[str, Values] = {}
        self._open: dict[str, Values] = {}  # the ticks of a group of which more may come

    def add(self, ticks: Values, columns: Group) -> None:
        """Take in the values of some ticks, one array per signal; the signals are the same every time."""
        if not ticks.size:
            return
        if self._thin is None:
            chosen = ticks % self._step == 0
            self._keep({name: column[chosen] for name, column in columns.items()})
            return
        every = {"": ticks, **columns}
        every = {name: np.concatenate([self._open.get(name, new[:0]), new]) for name, new in every.items()}
        begins = np.flatnonzero(np.diff(every[""] // self._step, prepend=-1))
        self._open = {name: column[begins[-1] :] for name, column in every.items()}
        groups = ({name: every[name][begin:end] for name in columns} for begin, end in pairwise(begins))
        thinned = [self._thin(group) for group in groups]
        if thinned:
            self._keep({name: np.concatenate([points[name] for points in thinned]) for name in columns})

    @property
    def names(self) -> frozenset[str]:
        """The signals, none before the first points."""
        return frozenset(self._points)

    def close(self) -> None:
        """The newest group is complete: no more ticks of it will come."""
        group, self._open = self._open, {}
        if group and self._thin is not None:
            del group[""]
            self._keep(self._thin(group))

    def _keep(self, points: Group) -> None:
        self.total += next(iter(points.values())).size
        self._points = {
            name: np.concatenate([self._points.get(name, values[:0]), values])[-self.room :]
            for name, values in points.items()
        }

    def since(self, total: int) -> dict[str, Values]:
        """The points behind the first `total`, as far as they are kept."""
        new = min(self.total - total, self.room)
        return {name: values[values.size - min(new, values.size) :] for name, values in self._points.items()}
