"""Columns of a data file as signals on the ticks of a plan."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from common.errors import InputError, PlanError
from common.plan.plan import Plan
from common.plan.read import with_test
from common.plan.tables import LONGEST_TEST
from common.recording.imported import ImportedChannel
from common.roles import MASTER
from common.signals import FieldType, Signal
from models.registry import Array
from report.text.tabular import DataTable
from rths.examine.importing.clock_by_smoothness import clock_by_smoothness
from rths.examine.importing.controller_clock import clock_by_ground, clock_by_rows, clock_of
from rths.examine.importing.import_map import ImportMap, SignalSource, in_unit, lab_signals
from rths.examine.importing.ticks import ControllerClock
from rths.examine.importing.time_base import (
    EVENLY,
    FOR_A_SPLINE,
    outside,
    pick,
    time_base,
    time_unit,
    without_ends,
    without_holes,
)

GROUND = "ground_acceleration"  # the signal that the plan knows as well
# Distance of rows over the plan's interval, and the plan's interval over it, from which on the time has another unit:
# milliseconds for seconds make 1000, while minutes make 60 and an oscilloscope has a hundred rows in an interval.
FAR_APART, TOO_CLOSE = 90.0, 900.0
GAP = 4.5  # usual distances of rows from which on rows are missing between two: more than three of them
FAST = 1.03  # rows in an interval, from which on they show whether a channel holds its value
ON_TICKS = 1e-3  # of an interval, within which a row is on its tick: times in a text file are rounded to a microsecond


@dataclass(frozen=True)
class OnTicks:
    """The signals on the ticks, each with the stated properties of its channel."""

    t: Array  # s, from 0
    values: dict[str, Array]  # by our name of the signal
    stated: dict[str, ImportedChannel]
    units: dict[str, str]  # taken from the file's row of units, by our name
    begin: float = 0.0  # s, the time of the first row in the data
    gaps: tuple[tuple[float, float], ...] = ()  # s in the data's own time, between which rows are missing
    clock: ControllerClock | None = None  # of the controller, where what it holds tells it
    # rows before the first and behind the last one in which every column began and ends
    ends: tuple[int, int] = (0, 0)
    left_out: int = 0  # rows of a static test in which a column has no number

    @property
    def interpolated(self) -> list[str]:
        """The signals whose rows were not on the ticks."""
        return [name for name, row in self.stated.items() if row.interpolated]


class TickGrid(NamedTuple):
    """The ticks on which signals are wanted."""

    t: Array  # s, by the controller
    interval: float  # s
    clock: ControllerClock | None  # of the controller, where the data tell it

    def read(
        self, times: Array, values: Array, row: Signal, known: Array | None, *, computed: bool
    ) -> tuple[Array, bool]:
        """What a channel (n,) with rows at times (n,), s, has at the ticks, and whether that lies between its rows.

        A controller `computed` it, or it was read by a converter of the logger. Where it is `known` (ticks,) what it
        should be, that is followed between rows.
        """
        clock, places = self.clock, self.t
        if clock is not None:
            places, slow = clock.ticks(self.t), rate_of(times) * self.interval < FAST
            if row.kind is FieldType.INDEX:
                return clock.latest(times, values, self.t), not stands_on(times, places, self.interval)
            if computed and slow:
                when, held = clock.seen(times, values)
                return self.between(when, held, row, known), not stands_on(when, self.t, self.interval)
            if not slow and clock.holds(times, values):
                return self.between(*clock.held(times, values, self.t), row, known), False
        apart = not stands_on(times, places, self.interval)
        return (moved(times, values, places, row) if apart else values[nearest_rows(times, places)]), apart

    def follows(self, known: Array | None) -> bool:
        """Whether a channel is what it should be between the ticks that a controller's rows showed."""
        return self.clock is not None and known is not None and known.size >= self.t.size

    def between(self, when: Array, values: Array, row: Signal, known: Array | None) -> Array:
        """What a channel has at all ticks by its values (m,) at some of them, at `when` (m,), s."""
        if when.size == self.t.size and np.max(np.abs(when - self.t)) < ON_TICKS * self.interval:
            return values
        if known is None or not self.follows(known):
            return moved(when, values, self.t, row)
        there = known[np.clip(np.rint(when / self.interval).astype(int), 0, self.t.size - 1)]
        return known[: self.t.size] + moved(when, values - there, self.t, row)


def on_ticks(mapping: ImportMap, table: DataTable, data: Path, *, as_is: bool = False) -> OnTicks:
    """The signals at the plan's interval, by a cubic spline; numbers of messages and what holds its value are held.

    Raises:
        InputError: a column is missing or has a hole, its unit is of another quantity, or time does not increase, is
            longer than a test or, unless `as_is`, has another unit.
    """
    theirs, rows = time_base(mapping, table, data)
    ends = (0, 0) if mapping.static else outside(mapping, table, data, theirs, rows)
    theirs, rows = without_ends(theirs, rows, *ends)
    interval = mapping.plan.test.interval
    gaps: tuple[tuple[float, float], ...] = ()
    begin, left_out = 0.0, 0
    if mapping.static:
        read = np.count_nonzero(rows)
        rows = without_holes(mapping, table, data, rows)
        t = np.arange(np.count_nonzero(rows), dtype=np.float64) * interval
        theirs, left_out = t, int(read - t.size)
    else:
        if not as_is:
            refuse_unit(mapping, theirs, data)
        refuse_length(theirs, data)
        gaps, begin = missing_rows(theirs), float(theirs[0])
        theirs = theirs - begin
        t = np.arange(int(np.floor(theirs[-1] / interval + 1e-9)) + 1, dtype=np.float64) * interval
    clock, ground = (None, None) if mapping.static else clock_in(mapping, table, data, theirs, rows)
    if clock is not None:  # and no tick after the last row
        t = np.arange(int(clock.places(theirs[-1:])[0] + ON_TICKS) + 1, dtype=np.float64) * interval
    ticks = TickGrid(t, interval, clock)
    rate = 0.0 if mapping.static else rate_of(theirs)
    known, computed = lab_signals(mapping.plan), of_controller(mapping.plan)
    found = OnTicks(t, {}, {}, {}, begin, gaps, clock, ends, left_out)
    if mapping.time and not mapping.time_unit and time_unit(mapping, table) not in ("", "s"):
        found.units["time"] = time_unit(mapping, table)
    for name, source in mapping.signals.items():
        row = known[name][1]
        if source.value is not None:
            found.values[name] = np.full(t.size, source.value)
            found.stated[name] = ImportedChannel(known=True)
            continue
        column = pick(table, source.column, data)[rows]
        own = np.isfinite(column)
        if not own.all() and (mapping.static or not every_so_often(theirs, own, gaps_between(gaps, begin))):
            place = int(np.arange(rows.size)[rows][np.flatnonzero(~own)[0]]) + 1
            raise InputError(
                f"{data}: column '{source.column}' has no number in row {place}: fill the gap or cut it out."
            )
        scale, unit = scale_of(name, source, row, table, data)
        if unit:
            found.units[name] = unit
        times, values = theirs[own], scale * column[own] + source.offset
        should = ground if name == GROUND else None
        found.values[name], apart = ticks.read(times, values, row, should, computed=name in computed)
        begin_, fast = (clock.begin, clock.fast) if clock else (0.0, 0.0)
        own_rate = (1.0 + fast) * (rate if own.all() else rate_of(times))
        first = 0.0 if mapping.static else (float(times[0]) - begin_) / (1.0 + fast)
        followed = apart and ticks.follows(should)
        said = channel(source, row, own_rate, first, between=apart, followed=followed)
        found.stated[name] = replace(said, printed=last_decimal(table, source, scale))
    return found


def clock_in(
    mapping: ImportMap, table: DataTable, data: Path, theirs: Array, rows: Any
) -> tuple[ControllerClock | None, Array | None]:
    """The clock of the controller by times (rows,) of the data, s, and the plan's ground (ticks,) where that tells it.

    None where nothing tells it.
    """
    interval = mapping.plan.test.interval
    planned = None
    if (ground := recorded_ground(mapping, table, data, rows)) is not None:
        planned = planned_ground(mapping.plan, float(theirs[-1]))
    if (own := rows_of_controller(mapping, table, data, rows)) is not None:
        there = None if ground is None or np.isnan(ground[own]).any() else ground[own]
        return clock_by_rows(theirs[own], interval, there, planned), planned
    channels = columns_of(mapping.signals.values(), table, data, rows)
    if ground is not None and planned is not None and np.isfinite(ground).all():
        found = clock_by_ground(theirs, ground, planned, interval, channels)
        if found is not None:
            return found, planned
    if (found := clock_of(theirs, channels, interval)) is not None:
        return found, None
    computed = of_controller(mapping.plan)
    sources = [one for name, one in mapping.signals.items() if name in computed]
    numbers = [one for one in sources if one.filter is None and not one.late]
    return clock_by_smoothness(theirs, columns_of(numbers, table, data, rows), interval), None


def recorded_ground(mapping: ImportMap, table: DataTable, data: Path, rows: Any) -> Array | None:
    """The ground acceleration (rows,) as a logger recorded a number of the controller, m/s²; None for any other.

    It is NaN in rows of another logger.
    """
    source = mapping.signals.get(GROUND)
    if source is None or source.value is not None or source.filter is not None or source.late:
        return None
    scale, _ = scale_of(GROUND, source, lab_signals(mapping.plan)[GROUND][1], table, data)
    found: Array = scale * pick(table, source.column, data)[rows] + source.offset
    return found


def rows_of_controller(
    mapping: ImportMap, table: DataTable, data: Path, rows: Any
) -> npt.NDArray[np.bool_] | None:
    """Which rows (n,) have the numbers of the controller, where these stand between those of another logger."""
    computed = of_controller(mapping.plan)
    for name, source in mapping.signals.items():
        if name in computed and source.value is None:
            own = np.isfinite(pick(table, source.column, data)[rows])
            return None if own.all() else own
    return None


def planned_ground(plan: Plan, seconds: float) -> Array | None:
    """The plan's ground acceleration at the ticks of a test, m/s²; None where it cannot be read."""
    from loop import substructure

    try:
        found = substructure.recorded_ground(with_test(plan, duration=seconds + 4.0 * plan.test.interval))
    except InputError:
        return None
    return None if found is None else found[1][0]


def of_controller(plan: Plan) -> set[str]:
    """The signals that a controller computes, numbers and times of messages apart."""
    from laboratories import kinds

    there = [kinds.own(plan), *(kinds.kind_of(plan, role) for role in plan.roles)]
    read = {row.name for kind in there if kind for row in kind.channels.measured}
    return {
        name
        for name, (topic, row) in lab_signals(plan).items()
        if row.name not in read and row.kind is not FieldType.INDEX and topic in (MASTER, *plan.roles)
    }


def columns_of(sources: Iterable[SignalSource], table: DataTable, data: Path, rows: Any) -> list[Array]:
    """The columns (rows,) of the data that signals are read from and that have a number in every row."""
    columns = [pick(table, source.column, data)[rows] for source in sources if source.value is None]
    return [one for one in columns if np.isfinite(one).all()]


def rate_of(times: Array) -> float:
    """Rows per s, by the mean of distances that are usual: printed times are rounded, which shows in each of them."""
    apart = np.diff(times)
    usual = apart[apart < EVENLY * np.median(apart)] if apart.size else apart
    return 1.0 / float(np.mean(usual)) if usual.size else 0.0


def gaps_between(gaps: Sequence[tuple[float, float]], begin: float) -> list[tuple[float, float]]:
    """Times between which rows are missing, s from where the data begin."""
    return [(last - begin, following - begin) for last, following in gaps]


def every_so_often(theirs: Array, own: npt.NDArray[np.bool_], gaps: Sequence[tuple[float, float]]) -> bool:
    """Whether a channel has its numbers at a rate of its own, as one that is logged half as often: not with holes.

    `theirs` are the times of all rows, s, `own` those with a number, and between `gaps` no channel has any.
    """
    times = theirs[own]
    if times.size < FOR_A_SPLINE:
        return False
    apart = np.diff(times)
    usual = EVENLY * float(np.median(apart))
    holes = ((times[place], times[place + 1]) for place in np.flatnonzero(apart > usual))
    within = all(any(last <= a and b <= following for a, b in gaps) for last, following in holes)
    return within and times[0] - theirs[0] < usual and theirs[-1] - times[-1] < usual


def refuse_unit(mapping: ImportMap, theirs: Array, data: Path) -> None:
    """Raise InputError where the rows stand so far apart, or so close, that their time has another unit."""
    interval = mapping.plan.test.interval
    apart = float(np.median(np.diff(theirs)))
    if 1.0 / TOO_CLOSE < apart / interval < FAR_APART:
        return
    what = "the unit of the time" if mapping.time else "the rate"
    unit = ' (time_unit = "ms" says that it is in ms)' if mapping.time else ""
    raise InputError(
        f"{data}: its rows are {apart:.3g} s apart, and the plan's interval is {interval:.3g} s: check {what}{unit} "
        "and the plan's interval; if they are right, import it with --as-is."
    )


def refuse_length(theirs: Array, data: Path) -> None:
    """Raise InputError where the rows last longer than a test may."""
    lasts = float(theirs[-1] - theirs[0])
    if lasts > LONGEST_TEST:
        raise InputError(
            f"{data}: its rows last {lasts:.6g} s, and a test lasts {LONGEST_TEST:g} s at most: say with start and "
            "stop, in the map, which part is the test."
        )


def missing_rows(theirs: Array) -> tuple[tuple[float, float], ...]:
    """The times, s, between which rows are missing."""
    apart = np.diff(theirs)
    places = np.flatnonzero(apart > GAP * np.median(apart))
    return tuple((float(theirs[place]), float(theirs[place + 1])) for place in places)


def stands_on(theirs: Array, t: Array, interval: float) -> bool:
    """Whether every tick has a row of its own."""
    away = np.abs(theirs[nearest_rows(theirs, t)] - t)
    return bool(np.max(away, initial=0.0) <= ON_TICKS * interval)


def nearest_rows(theirs: Array, t: Array) -> npt.NDArray[np.intp]:
    """The row nearest to each tick."""
    after = np.clip(np.searchsorted(theirs, t), min(1, theirs.size - 1), theirs.size - 1)
    before = np.maximum(after - 1, 0)
    return np.where(np.abs(theirs[after] - t) < np.abs(theirs[before] - t), after, before)


def moved(theirs: Array, values: Array, t: Array, row: Signal) -> Array:
    """Values at the ticks: interpolated between rows, or the last row's for the number of a message.

    Straight lines would take (ω·Δ)²/12 of a wave of frequency ω away, with rows every Δ: of a stroke of 40 mm at 2 Hz
    and 256 Hz that is 8 µm, four times the noise of a good sensor. A cubic spline leaves the share (ω·Δ)⁴/720. Between
    rows of which some are missing it may swing far, so that a straight line is taken there.
    """
    if row.kind is FieldType.INDEX:
        return values[np.clip(np.searchsorted(theirs, t + 1e-9, side="right") - 1, 0, None)]
    straight = np.interp(t, theirs, values)
    if theirs.size < FOR_A_SPLINE:
        return np.asarray(straight)
    from scipy.interpolate import CubicSpline

    smooth = np.asarray(CubicSpline(theirs, values)(np.clip(t, theirs[0], theirs[-1])))
    for begin, end in missing_rows(theirs):
        inside = (t > begin) & (t < end)
        smooth[inside] = straight[inside]
    return smooth


def scale_of(name: str, source: SignalSource, row: Signal, table: DataTable, data: Path) -> tuple[float, str]:
    """The factor to the signal's unit; where the map gives none, from the unit below the column's name or in it."""
    unit = table.units.get(source.column, "")
    if source.scaled or not unit or row.kind is FieldType.INDEX:
        return source.scale, ""
    try:
        return in_unit(unit, row, name), unit
    except PlanError as error:
        raise InputError(f"{data}: {error} Or give its scale in the map.") from None


def last_decimal(table: DataTable, source: SignalSource, scale: float) -> float:
    """The step of the last decimal of a column in the signal's unit; 0 where its rows differ in how many they have."""
    decimals = table.decimals.get(source.column)
    return 0.0 if decimals is None else abs(scale) * 10.0**-decimals


def channel(
    source: SignalSource, row: Signal, rate: float, first: float, *, between: bool, followed: bool
) -> ImportedChannel:
    """The stated properties of the channel of a measured signal; `rate` (Hz) and `first` (s) are by the controller."""
    counted = row.kind is FieldType.INDEX
    return ImportedChannel(
        source.filter,
        source.delay,
        source.resolution,
        source.calibration,
        source.high_pass,
        interpolated=between and not counted,
        rate=rate,
        first=first if between and not counted else 0.0,
        average=source.average,
        means=source.means,
        delay_stated=source.delay_stated,
        followed=followed,
    )
