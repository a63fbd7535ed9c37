"""The ticks of a controller by the clock of a data logger, from what the controller holds from tick to tick.

Where the logger recorded the ground acceleration as a number, the plan's own says at which tick each row was taken: no
sooner than that tick, and before the next one. Without it a logger that is faster than the controller still records
each value once or several times. Where a value is new, a tick lies between its row and the one before, and no tick lies
between rows of one value. Such bounds say when the ticks are by the logger's clock: the closer, the more the two clocks
are out of step.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from diagnosis.signals.clock import QUARTZ
from models.registry import Array
from rths.examine.importing.sharper import sharpened
from rths.examine.importing.ticks import ON_TICK, OTHER, ROUNDED, ControllerClock, hardly_faster

LEAST_RUNS = 40  # of rows of one value, from which on they may be those of a controller
AGREEING = 0.5  # share of the blocks of a recording whose bounds do not contradict each other, at least
BLOCK = 100  # ticks, in which a clock gains little
# Share of the bounds in a block that may be missed: times are rounded when printed, and a controller is late at times.
MISSED = 0.05
TOWARDS = 0.1  # of an interval
BOUNDED = 0.8  # of an interval: bounds that are farther apart say hardly anything of a tick
STEADY = 0.2  # share of the usual width of bounds that all of them have in common, of a clock that is in step
FASTEST, STEP = 1e-3, 5e-7  # of clocks: what any errs by at most, and between rates that are tried
# Of the ground: ticks around a row at which it may have been taken, distance to one over that to all others below which
# it was, and share of the motion's rms by which these must differ.
AROUND, SAME, APART = 2, 0.02, 1e-3
NEARBY, TRIED = (5e-2, 1e-3, 2e-5), 101  # of an interval, closer and closer, and beginnings within it
ENOUGH = 20_000  # rows, by which a beginning is found
ONE_LESS = 2  # the bound but one of a block counts: a time may be printed badly


def clock_of(
    times: Array, channels: Iterable[Array], interval: float, known: ControllerClock | None = None
) -> ControllerClock | None:
    """The clock that the channels (n,) at times (n,) of a logger, s, tell; None where none of them holds its values.

    A clock that may be in step is taken to be so: bounds then say no more than between which rows the ticks are. The
    channels do not say which tick is the first one; a clock that is `known` roughly does.
    """
    ratio = float(np.median(np.diff(times))) / interval if times.size > 1 else 1.0
    if ratio > 1.0 - ON_TICK:
        return None
    for values in sorted(channels, key=lambda one: -np.count_nonzero(np.diff(one))):
        found = clock_by_changes(times, values, interval, known)
        if found is not None and found.holds(times, values):
            return found
    return None


def clock_by_rows(
    times: Array, interval: float, values: Array | None = None, ground: Array | None = None
) -> ControllerClock | None:
    """The clock of a controller that wrote rows of its own at times (n,), s; None where these are not its ticks.

    Where ground acceleration (n,) was recorded in these rows, that of the plan, `ground` (ticks,), says which of the
    first ticks is in the first row.
    """
    if times.size < LEAST_RUNS:
        return None
    ticks = np.concatenate([[0], np.cumsum(np.rint(np.diff(times) / interval).astype(int))])
    apart, begin = np.polyfit(ticks, times, 1)
    fast = float(apart) / interval - 1.0
    missed = np.max(np.abs(times - begin - apart * ticks))
    if abs(fast) > FASTEST or missed > ROUNDED * interval:
        return None
    first = 0
    if values is not None and ground is not None:
        least = ticks + np.arange(AROUND + 1)[:, None]
        away = np.abs(ground[np.clip(least, 0, ground.size - 1)] - values).sum(axis=1)
        first = int(np.argmin(away))
    return ControllerClock(interval, float(begin - first * apart), fast)


def clock_by_ground(
    times: Array, values: Array, ground: Array, interval: float, channels: Iterable[Array] = ()
) -> ControllerClock | None:
    """The clock by recorded ground acceleration (n,) at times (n,) of a logger, s, and the plan's (ticks,).

    What `channels` (n,) hold says more of it, where they move longer than the ground. None where what was recorded is
    no number of the controller, held from tick to tick.
    """
    same, tick = in_force(times, values, ground, interval)
    if same is None:
        return None
    when, ticks = times[same], tick[same]
    high = when - interval * ticks
    rows = [
        (float(np.mean(when[own])), highs[-ONE_LESS] - interval, highs[ONE_LESS - 1])
        for own in blocks(when / interval)
        for highs in (np.sort(high[own]),)
    ]
    limits = agreeing(rows, interval)
    found = None if limits is None else within(limits, interval, turning=False)
    found = (found and clock_of(times, channels, interval, found)) or found
    return refined(found, when, ticks) if found and found.between else found


def in_force(
    times: Array, values: Array, ground: Array, interval: float
) -> tuple[npt.NDArray[np.bool_] | None, npt.NDArray[np.int_]]:
    """Which rows (n,) show at which tick they were taken, and that tick; no rows where too few of those that could do.

    What a clock that is fast or slow gains until a block of rows is known from the blocks before.
    """
    usual = np.floor(times / interval + ON_TICK).astype(int)
    tick, clear, same = usual.copy(), np.zeros(usual.size, dtype=bool), np.zeros(usual.size, dtype=bool)
    least, gained = APART * float(np.sqrt(np.mean(np.square(ground)))), 0
    reach = (
        AROUND + int(np.ceil(float(np.median(np.diff(times))) / interval - ON_TICK)) - 1
    )  # of slower rows more
    for own in blocks(times / interval, fewest=0):
        near = usual[own, None] + gained + np.arange(-reach, reach + 1)
        away = np.abs(ground[np.clip(near, 0, ground.size - 1)] - values[own, None])
        best = np.argmin(away, axis=1)
        nearest, other = np.partition(away, 1, axis=1)[:, :2].T
        clear[own] = (other > least) & (near[:, 0] >= 0)
        same[own] = clear[own] & (nearest < SAME * other)
        tick[own] = near[np.arange(best.size), best]
        if same[own].any():
            gained = round(float(np.median((tick[own] - usual[own])[same[own]])))
    few = np.count_nonzero(same) < max(LEAST_RUNS, (1.0 - MISSED) * np.count_nonzero(clear))
    return None if few else same, tick


def refined(clock: ControllerClock, times: Array, ticks: npt.NDArray[np.int_]) -> ControllerClock:
    """The clock that begins so that most rows at times (n,), s, lie behind the ticks (n,) at which they were taken."""
    few = max(1, times.size // ENOUGH)
    times, ticks = times[::few], ticks[::few]
    for share in NEARBY:
        nearby = clock.begin + share * clock.interval * np.linspace(-1.0, 1.0, TRIED)
        fit = [np.count_nonzero(np.floor(clock._replace(begin=one).places(times)) == ticks) for one in nearby]
        best = np.flatnonzero(np.array(fit) == max(fit))
        clock = clock._replace(begin=float(np.mean(nearby[best])))
    return clock


def clock_by_changes(
    times: Array, values: Array, interval: float, known: ControllerClock | None
) -> ControllerClock | None:
    """The clock by the bounds of one channel (n,); None where they contradict each other.

    The bounds are those of any tick. A clock that is `known` roughly says which one is the first.
    """
    if np.count_nonzero(np.diff(values)) > (1.0 + OTHER) * (times[-1] - times[0]) / interval + 1.0:
        return None  # it changes between ticks
    low, high = bounds(times, values, interval)
    if low.size < LEAST_RUNS:
        return None
    rows = [in_common(low[own], high[own], interval) for own in blocks(0.5 * (low + high) / interval)]
    limits = agreeing(rows, interval)
    if limits is None:
        return None
    centre = 0.5 * limits[1:].sum(axis=0) / interval
    begin = float(centre[0]) if known is None else known.begin / interval
    limits[1:] += interval * turns(centre, begin, passed(times, values, interval, limits[0]))
    found = within(limits, interval, turning=known is None)
    near = high - low < BOUNDED * interval
    hardly = hardly_faster(times, interval)
    return sharpened(found, low[near], high[near]) if found and hardly else found


def agreeing(rows: Sequence[tuple[float, float, float]], interval: float) -> Array | None:
    """The middle of each block and its limits (3, blocks), s, of those that do not contradict themselves.

    In the block where the ticks of a clock that is out of step pass a row, one half contradicts the other. None where
    most blocks do.
    """
    agreed = [row for row in rows if row[1] <= row[2] + 2.0 * ROUNDED * interval]
    return np.array(agreed).T if len(agreed) > AGREEING * len(rows) else None


def blocks(ticks: Array, fewest: float = 1.0 / MISSED) -> Iterator[slice]:
    """The places of increasing times (n,), in ticks, block by block, of those with more than `fewest`.

    A block is as long as `BLOCK` ticks, or as holds twice so many as are needed for few of them to be missed.
    """
    apart = (ticks[-1] - ticks[0]) / max(1, ticks.size - 1)
    block = np.floor(ticks / max(BLOCK, 2.0 * apart / MISSED))
    ends = [0, *(np.flatnonzero(np.diff(block)) + 1), block.size]
    for first, behind in itertools.pairwise(ends):
        if behind - first > fewest:
            yield slice(first, behind)


def bounds(times: Array, values: Array, interval: float) -> tuple[Array, Array]:
    """Times (runs,), s, between which there is a tick, by each run of rows that have one value for no longer than that.

    A run from row a to row b begins with a tick between rows a−1 and a, and the next one is between rows b and b+1.
    """
    new = np.flatnonzero(np.diff(values)) + 1
    first, last = new[:-1], new[1:] - 1
    low = np.maximum(times[first - 1], times[last] - interval)
    high = np.minimum(times[first], times[last + 1] - interval)
    kept: npt.NDArray[np.bool_] = high > low
    return low[kept], high[kept]


def in_common(low: Array, high: Array, interval: float) -> tuple[float, float, float]:
    """The middle of a block of bounds (runs,), s, and between which times after a multiple of an interval they agree.

    Few of them may be missed. Where ticks pass the rows of a logger of twice the rate, the bounds before and after it
    are half an interval apart: no time is agreed on, as either may come first.
    """
    middle = 0.5 * (low + high)
    narrow = 1.0 / (high - low)
    turned = np.sum(narrow * np.exp(2j * np.pi * middle / interval))
    about = float(np.angle(turned)) / (2.0 * np.pi) * interval
    off = (middle - about + 0.5 * interval) % interval - 0.5 * interval
    if np.mean(np.abs(off) > (0.5 - ROUNDED) * interval) > MISSED:
        return float(np.mean(middle)), math.inf, -math.inf
    half = 0.5 * (high - low)
    least, most = np.quantile(off - half, 1.0 - MISSED), np.quantile(off + half, MISSED)
    return float(np.mean(middle)), about + float(least), about + float(most)


def passed(times: Array, values: Array, interval: float, until: Array) -> Array:
    """How many ticks passed a row of a logger of twice the rate, until each of some times (blocks,), s, from the last.

    One that passes a row towards later ones leaves a value in three rows in place of two, and counts one; one that
    passes a row towards earlier ones leaves a value in one row, and counts minus one.
    """
    new = np.flatnonzero(np.diff(values)) + 1
    apart = np.diff(times[new]) / interval
    way = (np.abs(apart - 1.5) < ROUNDED).astype(float) - (np.abs(apart - 0.5) < ROUNDED)
    return np.histogram(times[new[1:]], np.concatenate([[-math.inf], until]), weights=way)[0]


def turns(centre: Array, begin: float, ways: Array) -> Array:
    """Whole intervals (blocks,) that join limits about `centre` (blocks,), in intervals, to a course from `begin` on.

    Where a limit may go on either side by as much, it goes the way (blocks,) that the ticks go, or else to where they
    are nearer to the first row.
    """
    result, last = np.zeros(centre.size), begin
    for place, here in enumerate(centre):
        result[place] = round(last + math.copysign(TOWARDS, ways[place] or -last) - here)
        last = float(here + result[place])
    return result


def within(limits: Array, interval: float, *, turning: bool = True) -> ControllerClock | None:
    """The clock within limits (3, blocks), the middle of each block and limits there, s; None where none is.

    Limits that are `turning` hold for any tick, and the first one is the one nearest to the first row. The clock is in
    step, or begins with a tick, where that is within them as well: many loggers do by design.
    """
    middle, least, most = limits
    rates = STEP * np.arange(-round(FASTEST / STEP), round(FASTEST / STEP) + 1)
    low = np.array([np.max(least - fast * middle) for fast in rates]) - ROUNDED * interval
    high = np.array([np.min(most - fast * middle) for fast in rates]) + ROUNDED * interval
    allowed = low <= high
    usual = allowed & (np.abs(rates) <= QUARTZ)
    places = np.flatnonzero(usual if usual.any() else allowed)
    if not places.size:
        return None
    in_step = rates.size // 2
    width = high[in_step] - low[in_step] - 2.0 * ROUNDED * interval
    steady = (
        width > -ON_TICK * interval and width > STEADY * float(np.median(most - least)) - ON_TICK * interval
    )
    place = in_step if steady else int(places[[0, -1]].mean())
    begin, half = 0.5 * (low[place] + high[place]), 0.5 * (high[place] - low[place])
    if turning:
        begin -= interval * round(begin / interval)
    known, near = half - ROUNDED * interval, ON_TICK * interval
    on_tick = abs(begin) <= known + near and (known < near or begin - known < -near)
    unsure = 0.0 if steady else 0.5 * float(np.ptp(rates[places]))
    return ControllerClock(interval, 0.0 if on_tick else float(begin), float(rates[place]), unsure)
