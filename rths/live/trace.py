"""What a view keeps of a topic: the newest points of some signals, thinned to as many as a plot can show."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from common.recording.reader import Values


class Trace:
    """The newest points of a topic, one for each group of `step` ticks, at most `room` of them.

    A group's point is its first tick's, or the largest value of each signal where `worst` is set. `total` counts all
    points there ever were, so that several readers find what is new to each.
    """

    def __init__(self, step: int, room: int, *, worst: bool = False) -> None:
        self.room = room
        self.total = 0
        self._step = step
        self._worst = worst
        self._points: dict[str, Values] = {}
        self._open: dict[str, Values] = {}  # the ticks of a group of which more may come

    def add(self, ticks: Values, columns: Mapping[str, Values]) -> None:
        """Take in the values of some ticks, one array per signal; the signals are the same every time."""
        if ticks.size:
            points = self._largest(ticks, columns) if self._worst else self._first(ticks, columns)
            self.total += next(iter(points.values())).size
            self._points = {
                name: np.concatenate([self._points.get(name, values[:0]), values])[-self.room :]
                for name, values in points.items()
            }

    def _first(self, ticks: Values, columns: Mapping[str, Values]) -> dict[str, Values]:
        chosen = ticks % self._step == 0
        return {name: column[chosen] for name, column in columns.items()}

    def _largest(self, ticks: Values, columns: Mapping[str, Values]) -> dict[str, Values]:
        every = {"": ticks, **columns}
        every = {name: np.concatenate([self._open.get(name, new[:0]), new]) for name, new in every.items()}
        groups = every[""] // self._step
        starts = np.flatnonzero(np.diff(groups, prepend=groups[0] - 1))
        self._open = {name: column[starts[-1] :] for name, column in every.items()}
        closed = slice(0, starts[-1])
        return {
            name: np.fmax.reduceat(every[name][closed], starts[:-1]) if starts.size > 1 else every[name][:0]
            for name in columns
        }

    def since(self, total: int) -> dict[str, Values]:
        """The points behind the first `total`, as far as they are kept."""
        new = min(self.total - total, self.room)
        return {name: values[values.size - min(new, values.size) :] for name, values in self._points.items()}
