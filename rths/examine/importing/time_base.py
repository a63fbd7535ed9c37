"""The time base of a data file: which of its rows are read, and when they were taken."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from common.errors import InputError, PlanError
from common.plan.schema import nearest
from common.signals import TIME
from models.registry import Array
from report.text.tabular import DataTable
from report.text.text_form import is_number
from rths.examine.importing.import_map import ImportMap, in_unit

ENDS = 0.02  # share of the rows that may come before a column begins, or behind its end
REPEATED = 0.01  # share of the rows that a busy logger may have written twice
AROUND = 101  # rows, over which is counted how often a column changes
BY_CHANCE = 0.01  # of a row being like the one before, from which on it may come from coarse steps of what hardly moves
NEAR = 1e-3  # of the distance of rows, within which a row is at the start or stop of a map
FOR_A_SPLINE = 4  # rows at least
EVENLY = 1.5  # usual distances of a channel's own rows, from which on one is missing


def put_together(mapping: ImportMap, table: DataTable, data: Path) -> DataTable:
    """The data with one row for two of the same time, of two loggers in one file, that share no column with numbers.

    Other rows of the same time stay, and are refused as times that do not increase.
    """
    if mapping.static or not mapping.time:
        return table
    t = pick(table, mapping.time, data)
    first = np.flatnonzero(np.diff(t) == 0.0)
    second = first + 1
    others = [
        column for name, column in table.columns.items() if name != mapping.time and column.size == t.size
    ]
    if np.isin(second, first).any() or any(
        np.any(np.isfinite(column[first]) & np.isfinite(column[second])) for column in others
    ):
        return table

    def one_row(column: Array) -> Array:
        if column.size != t.size:
            return column
        whole = column.copy()
        whole[first] = np.where(np.isfinite(column[first]), column[first], column[second])
        return np.delete(whole, second)

    return table._replace(columns={name: one_row(column) for name, column in table.columns.items()})


def without_repeats(mapping: ImportMap, table: DataTable, data: Path) -> tuple[DataTable, int]:
    """The data without rows that repeat the row before them in every column of the map, and how many those are.

    A logger that was busy writes its last row again. The noise of several readings does not come twice; where many rows
    repeat, the logger is faster than what it reads. Where nothing moves, coarse steps leave a row as the one before.
    """
    from scipy import ndimage

    columns = [pick(table, source.column, data) for source in mapping.signals.values() if source.column]
    moving = [column for column in columns if np.any(column != column[:1])]
    if mapping.static or not mapping.time or len(moving) < 2 or len({column.size for column in columns}) > 1:
        return table, 0
    same = np.array([column[1:] == column[:-1] for column in columns])
    often = ndimage.uniform_filter1d(same.astype(np.float64), AROUND, axis=1, mode="nearest")
    again = np.append(False, np.all(same, axis=0) & (np.prod(often, axis=0) < BY_CHANCE))
    count = int(np.count_nonzero(again))
    if not 0 < count <= REPEATED * again.size:
        return table, 0
    left = {
        name: column[~again] if column.size == again.size else column
        for name, column in table.columns.items()
    }
    return table._replace(columns=left), count


def time_base(mapping: ImportMap, table: DataTable, data: Path) -> tuple[Array, Any]:
    """Times of the rows that are read, s, and which rows those are; raises InputError where they do not increase."""
    counted = np.arange(length(mapping, table, data), dtype=np.float64) / (mapping.rate or 1.0)
    t = seconds(mapping, table, data) if mapping.time else counted
    bad = np.flatnonzero(~(np.diff(t) > 0.0))
    if not mapping.static and (bad.size or t.size < 2):
        row = int(bad[0]) + 2 if bad.size else t.size
        hint = " It may be printed with too few digits: give rate, the samples per second, in its place."
        same = bool(bad.size) and t[bad[0]] == t[bad[0] + 1]
        raise InputError(
            f"{data}: the time in column '{mapping.time}' does not increase at row {row}.{hint if same else ''}"
        )
    rows = np.zeros(t.size, dtype=bool)
    rows[mapping.span] = True
    near = NEAR * float(np.median(np.diff(t))) if t.size > 1 else 0.0
    if mapping.start is not None:
        rows &= t >= mapping.start - near
    if mapping.stop is not None:
        rows &= t <= mapping.stop + near
    if np.count_nonzero(rows) < 2:
        raise InputError(
            f"{data}: fewer than two rows lie between first_row and last_row; it has {t.size} rows."
            if mapping.span != slice(0, None)
            else f"{data}: fewer than two rows lie between start and stop; its times go from {t[0]:g} to {t[-1]:g} s."
        )
    return t[rows], rows


def without_holes(
    mapping: ImportMap, table: DataTable, data: Path, rows: npt.NDArray[np.bool_]
) -> npt.NDArray[np.bool_]:
    """The rows of a static test that have a number in every column; all where more than a few have none.

    A row there stands for itself, so that one of which a logger had no reading can be left out.
    """
    columns = [pick(table, source.column, data) for source in mapping.signals.values() if source.column]
    whole = rows & np.all(np.isfinite(columns), axis=0)
    lacking = np.count_nonzero(rows) - np.count_nonzero(whole)
    return whole if lacking <= ENDS * np.count_nonzero(rows) else rows


def outside(
    mapping: ImportMap, table: DataTable, data: Path, theirs: Array, rows: npt.NDArray[np.bool_]
) -> tuple[int, int]:
    """How many rows at both ends, with times (n,) s, come before a column of the map begins, or behind its end.

    Loggers that stand in one file rarely begin and end together. More than a few rows are a hole.
    """
    before = behind = 0
    for source in mapping.signals.values():
        if source.value is None:
            there = np.flatnonzero(np.isfinite(pick(table, source.column, data)[rows]))
            if there.size < FOR_A_SPLINE:
                continue
            usual = EVENLY * float(np.median(np.diff(theirs[there])))
            if theirs[there[0]] - theirs[0] >= usual:
                before = max(before, int(there[0]))
            if theirs[-1] - theirs[there[-1]] >= usual:
                behind = max(behind, theirs.size - 1 - int(there[-1]))
    most = ENDS * theirs.size
    return (before if before <= most else 0), (behind if behind <= most else 0)


def without_ends(
    theirs: Array, rows: npt.NDArray[np.bool_], before: int, behind: int
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Times (n,) and the rows that have them, without some at both ends."""
    kept, places = rows.copy(), np.flatnonzero(rows)
    kept[places[:before]] = False
    kept[places[places.size - behind :]] = False
    return theirs[before : theirs.size - behind], kept


def seconds(mapping: ImportMap, table: DataTable, data: Path) -> Array:
    """The column of the time, s."""
    t = pick(table, mapping.time, data)
    unit = time_unit(mapping, table)
    try:
        return t * in_unit(unit, TIME, "time") if unit else t
    except PlanError as error:
        raise InputError(f"{mapping.path}: {str(error).replace(' in [signals]', '')}") from None


def time_unit(mapping: ImportMap, table: DataTable) -> str:
    """The map's unit of the time, else that in the row below its name; empty for seconds.

    What stands there may be a word such as sec, or a format. That it is not in seconds
    then shows in how far rows are apart.
    """
    stated = mapping.time_unit
    unit = stated or table.units.get(mapping.time, "")
    try:
        in_unit(unit or "s", TIME, "time")
    except PlanError:
        return stated
    return unit


def length(mapping: ImportMap, table: DataTable, data: Path) -> int:
    """How many rows the columns of the map have; raises InputError where they differ."""
    names = [*([mapping.time] if mapping.time else []), *(row.column for row in mapping.signals.values())]
    sizes = {name: pick(table, name, data).size for name in names if name}
    if len(set(sizes.values())) > 1:
        counts = ", ".join(f"'{name}' has {size}" for name, size in sizes.items())
        raise InputError(f"{data}: the columns of the map have different numbers of rows: {counts}.")
    return next(iter(sizes.values()), 0)


def pick(table: DataTable, name: str, data: Path) -> Array:
    """A column by name; raises InputError with the nearest name where there is none, or where there are two."""
    if name in table.twice:
        raise InputError(f"{data} has more than one column '{name}': give each a name of its own.")
    if name not in table.columns:
        if table.form and all(is_number(one, table.form.notation) for one in table.columns):
            raise InputError(f"{data} has no row of names: write one above the numbers, with '{name}' in it.")
        if name in table.texts:
            raise InputError(
                f"{data}: column '{name}' holds texts such as '{table.texts[name]}', but must hold numbers, or "
                "times of day such as 13:30:05.2, 1:30:05.2 PM or 2024-02-29 13:30:05.2."
            )
        raise InputError(f"{data} has no numeric column '{name}': {nearest(name, table.columns)}")
    return table.columns[name]
