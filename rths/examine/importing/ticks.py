"""When a controller's ticks are by the clock of a data logger, and what the logger's rows show at them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.registry import Array

CHANGING = 0.5  # share of the ticks at which a channel that holds its value in between changes at least
ROUNDED = 0.03  # of an interval, by which times may be off: they are rounded when printed
ON_TICK = 0.01  # of an interval, within which a row is on its tick
SHARP = 1e-3  # of an interval, the same of rows that are hardly closer than ticks
OTHER = 0.01  # share of neighbours within one interval that may differ in a channel that holds
OFTEN = 0.2  # share of them from which on those whose rows are not on a tick decide
TOLD = 2e-6  # of a clock, from which on it is said by how much its rate may err
# Of an interval, by which rows are closer than ticks that share one too seldom to bound it well.
HARDLY = 0.15


class ControllerClock(NamedTuple):
    """When a controller's ticks are by the clock of a logger."""

    interval: float  # s, of the controller
    begin: float  # s, of its first tick, from the first row on
    fast: float  # by how much the logger's clock is fast
    unsure: float = 0.0  # by how much more or less it may be, of what bounds of the ticks allow

    @property
    def between(self) -> bool:
        """Whether its ticks lie between rows, or drift past them."""
        return self.begin != 0.0 or self.fast != 0.0

    @property
    def slack(self) -> float:
        """Of an interval, within which a row is on its tick; none where rows drift past the ticks."""
        return 0.0 if self.between else ON_TICK

    @property
    def told(self) -> str:
        """A sentence for the user."""
        side = "before" if self.begin < 0.0 else "after"
        place = f"{1e3 * abs(self.begin):.2g} ms {side} the first row" if self.begin else "at the first row"
        about = f"{1e6 * abs(self.fast):.2g}" + f" ± {1e6 * self.unsure:.0f}" * (self.unsure > TOLD)
        rate = f", and the data's clock is {'fast' if self.fast > 0.0 else 'slow'} by {about} ppm"
        return (
            f"clock: the controller's own numbers show that its first tick is {place}{rate if self.fast else ''}; all "
            "channels were put onto its ticks"
        )

    def ticks(self, t: Array) -> Array:
        """Times (ticks,) by the logger, s, of ticks at times `t` of the controller."""
        return self.begin + (1.0 + self.fast) * t

    def holds(self, times: Array, values: Array) -> bool:
        """Whether values (n,) at times (n,) of the logger, s, change from tick to tick and not between."""
        place = self.places(times)
        # rows hardly closer than ticks share one where the first is just behind it and the other just before the next
        slack = SHARP if hardly_faster(place, 1.0) else ROUNDED
        between = np.abs(place - np.round(place)) > slack
        together = np.floor(place[1:] + slack) == np.floor(place[:-1] + slack)
        sure = together & between[1:] & between[:-1]
        if np.count_nonzero(sure) > OFTEN * np.count_nonzero(together):
            together = sure  # where rows are on ticks by chance only, these may show either value
        differ = np.diff(values) != 0.0
        if not together.any() or np.count_nonzero(differ) < CHANGING * (place[-1] - place[0]):
            return False
        return bool(np.mean(differ[together]) < OTHER)

    def held(self, times: Array, values: Array, t: Array) -> tuple[Array, Array]:
        """The ticks (m,) at `t` that have a row, s by the controller, and what a channel that holds has from them on.

        The channel is (n,) at times (n,) of the logger, s. Of the rows of a tick the one nearest to the middle of its
        interval counts.
        """
        middle = self.ticks(t) + 0.5 * self.interval
        after = np.clip(np.searchsorted(times, middle), 1, times.size - 1)
        before = after - 1
        nearest = np.where(middle - times[before] < times[after] - middle, before, after)
        there = np.floor(self.places(times[nearest]) + self.slack) == np.rint(t / self.interval)
        return t[there], values[nearest[there]]

    def seen(self, times: Array, values: Array) -> tuple[Array, Array]:
        """The ticks (m,), s by the controller, whose values (m,) were in force at times (n,) of the logger, s.

        A single row that may be either side of a tick, as times are known to some µs only, is left out: its neighbours
        tell what it had.
        """
        places = self.places(times)
        beside = np.abs(places - np.rint(places))
        at_ticks = bool(np.all(beside < ROUNDED))
        if self.between and not at_ticks:
            sure = beside > ON_TICK
            single = np.append(True, sure[:-1]) & np.append(sure[1:], True) & ~sure
            places, values = places[~single], values[~single]
        ticks, rows = np.unique(
            np.rint(places) if at_ticks else np.floor(places + self.slack), return_index=True
        )
        return self.interval * ticks, values[rows]

    def latest(self, times: Array, values: Array, t: Array) -> Array:
        """What was recorded last, of values (n,) at times (n,) of the logger, s, before the tick after each at `t`.

        They are numbers that count. A tick without a row of its own, which a logger that is slow by little passes over
        now and then, has the number between those around it.
        """
        following = self.ticks(t + (1.0 - self.slack) * self.interval)
        rows = np.clip(np.searchsorted(times, following) - 1, 0, None)
        result, after = values[rows], values[np.clip(rows + 1, None, values.size - 1)]
        passed = np.append(False, np.diff(rows) == 0) & (after == result + 2)
        return np.where(passed, result + 1, result)

    def places(self, times: Array) -> Array:
        """Times (n,) of the logger, s, in ticks of the controller."""
        return (times - self.begin) / ((1.0 + self.fast) * self.interval)


def hardly_faster(times: Array, interval: float) -> bool:
    """Whether there is hardly more than one row in an interval, at times (n,) in its unit."""
    return float(np.median(np.diff(times))) > (1.0 - HARDLY) * interval
