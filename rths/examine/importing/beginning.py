"""When the test begins in a data file that began before it, by the ground motion that the plan knows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from common.errors import InputError
from common.plan.tables import LONGEST_TEST
from models.registry import Array
from report.text.tabular import DataTable
from rths.examine.importing.import_map import ImportMap
from rths.examine.importing.onto_ticks import GROUND
from rths.examine.importing.time_base import pick, time_base

AGREES = 0.95  # correlation of the recorded motion with the plan's from where the test begins
BETTER = 0.5  # of what it lacks to one from the first row on, which less must be lacking there
LACKING = 1e-6  # that a correlation may lack to the best one
FEWEST = 2  # rows with a number, without which there is no motion
AHEAD = 0.5  # s before the test at least: less may be an error of the controller, which reads the motion late
HELD = 0.5  # share of the plan's motion, by its energy, that the data must hold
FASTER = 0.95  # of an interval, below which rows come faster than ticks
PLACES = 16  # in an interval, at which the first tick may be
# Times the least error, and an error of a motion that is printed exactly: of places where a held motion is the same the
# last one counts.
AS_GOOD, EXACT = 1.001, 1e-9


def begun(mapping: ImportMap, table: DataTable, data: Path) -> tuple[ImportMap, float | None]:
    """The map from the first row of the test on, where it states none, and when that begins in the data, s.

    None where the data do not begin before the test, or the map says when it does. Of rows that come faster than ticks
    the nearest one to the first tick is the first of the test: the clock of a controller is known beside it, to half an
    interval.

    Raises:
        InputError: a column is missing, or the time does not increase.
    """
    source = mapping.signals.get(GROUND)
    planned = None if mapping.static or mapping.start is not None else motion(mapping)
    if planned is None or source is None or source.value is not None:
        return mapping, None
    times, rows = time_base(mapping, table, data)
    column = pick(table, source.column, data)[rows]
    there = np.isfinite(column)
    interval = mapping.plan.test.interval
    if np.count_nonzero(there) < FEWEST or times[-1] - times[0] > LONGEST_TEST:
        return mapping, None
    grid = np.arange(times[0], times[-1], interval)
    ahead = ticks_before(np.interp(grid, times[there], column[there]), planned)
    if ahead * interval < AHEAD:
        return mapping, None
    begin = first_tick(times[there], column[there], planned, times[0] + ahead * interval, interval)
    return replace(mapping, start=float(times[first_row(times, begin, interval)])), begin


def first_row(times: Array, begin: float, interval: float) -> int:
    """Place of the first row of a test that begins at a time (s), of rows at times (n,), s."""
    after = min(int(np.searchsorted(times, begin)), times.size - 1)
    fast = float(np.median(np.diff(times))) < FASTER * interval
    return after - 1 if fast and after > 0 and begin - times[after - 1] < times[after] - begin else after


def motion(mapping: ImportMap) -> Array | None:
    """The ground acceleration of the plan (ticks,), None where it has none or its file cannot be read."""
    from loop.substructure import recorded_ground

    try:
        found = recorded_ground(mapping.plan)
    except InputError:
        return None
    return None if found is None else found[1][0]


def ticks_before(recorded: Array, planned: Array) -> int:
    """How many ticks of a recorded motion (n,) lie before the planned one (m,) begins in it; 0 where it does not."""
    size = 1 << int(np.ceil(np.log2(recorded.size + planned.size)))
    along = np.fft.irfft(np.fft.rfft(recorded, size) * np.conj(np.fft.rfft(planned, size)), size)[
        : recorded.size
    ]
    first = np.arange(recorded.size)
    last = np.minimum(first + planned.size, recorded.size)
    within = np.append(0.0, np.cumsum(np.square(recorded)))
    held = np.append(0.0, np.cumsum(np.square(planned)))[last - first]
    energy = held * (within[last] - within[first])
    whole = (held > HELD * float(np.sum(np.square(planned)))) & (energy > 0.0)
    agrees = np.where(whole, along / np.sqrt(np.where(energy > 0.0, energy, 1.0)), 0.0)
    most = float(agrees.max())
    best = int(np.argmax(agrees > most - LACKING))  # a wave that goes on begins where it does first
    return best if most > AGREES and 1.0 - most < BETTER * (1.0 - agrees[0]) else 0


def first_tick(times: Array, recorded: Array, planned: Array, near: float, interval: float) -> float:
    """The time (s) of the first tick near one that is known to an interval, by a recorded motion (n,) at times (n,), s.

    A controller holds the planned motion (m,) from tick to tick; a reading of the ground goes on straight lines. Where
    rows on ticks leave a whole interval for the beginning it is a row's.
    """
    places = near + interval / PLACES * np.arange(-2 * PLACES, PLACES + 1)
    errors = np.array([missed(times, recorded, planned, place, interval) for place in places])
    shape = int(np.argmin(errors.min(axis=0)))
    last = np.flatnonzero(errors[:, shape] <= AS_GOOD * max(errors[:, shape].min(), EXACT))[-1]
    after = times[np.searchsorted(times, places[last] - 0.5 * interval / PLACES) :][:1]
    near_row = after.size and after[0] < places[last] + interval / PLACES
    return float(after[0]) if near_row else float(places[last])


def missed(
    times: Array, recorded: Array, planned: Array, begin: float, interval: float
) -> tuple[float, float]:
    """Shares of a motion (n,) that one from `begin` (s) on misses, held from tick to tick and on straight lines.

    Each is taken at the factor at which it misses least.
    """
    ticks = (times - begin) / interval
    there = (ticks >= 0.0) & (ticks < planned.size - 1)
    ticks, values = ticks[there], recorded[there]
    held = planned[np.floor(ticks + 1e-6).astype(int)]
    straight = np.interp(ticks, np.arange(planned.size), planned)
    whole = float(values @ values)
    errors = [1.0 - float(values @ one) ** 2 / (whole * float(one @ one)) for one in (held, straight)]
    return errors[0], errors[1]
