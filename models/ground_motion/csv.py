"""Reader of columns of text: acceleration alone, or time and acceleration, with or without a header.

docs/reference/ground-motion.md describes the format for users.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from models.ground_motion.header import EXAMPLE, UNITS, Header, columns
from models.ground_motion.record import GroundMotion
from models.ground_motion.source import MotionFile, number, read_source

UNEVEN = 0.02  # of the interval: times with four decimals and an interval of 5 ms differ by that much
COMMENTS = ("#", "%", "//")
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?|[-+]?(?:nan|inf|infinity)", re.IGNORECASE)
COMMAS = "write numbers with a decimal point, not with a comma"
KINDS = {1: "acceleration alone", 2: "time and acceleration"}


class CsvLine(NamedTuple):
    """One line of a file, split into cells."""

    line: int  # from 0
    cells: list[str]


def read_csv(path: Path, dt: float = 0.0, unit: str = "") -> GroundMotion:
    """A motion from one column or two, separated by commas, semicolons, tabs or blanks; it begins at its first line.

    `dt` (s) is the interval of a file without times, `unit` that of an acceleration whose header says none, which is
    m/s² otherwise. Where the file says either itself, it must be the same. Times must come in equal steps: a
    record that its maker sampled unevenly has no content between its points that could be known here.

    Raises:
        InputError: not one or two columns, a name or unit that is not known, a missing cell, a value that is not a
            finite number, times that do not increase in equal steps, or no interval at all.
    """
    source = read_source(path)
    rows = parted(source)
    header, data = split(source, rows)
    values = np.array([[number(cell, source.at(row.line)) for cell in row.cells] for row in data])
    if len(data) < 2:
        raise InputError(f"{path} holds fewer than two samples: get the whole file.")
    with np.errstate(over="ignore"):
        acceleration = UNITS[agreed_unit(source, header, unit)] * values[:, header.acceleration]
    return GroundMotion(
        path.stem, source.version, interval_of(source, header, data, values, dt), acceleration
    )


def parted(source: MotionFile) -> list[CsvLine]:
    """The lines that hold something, each in its cells; raises InputError where the file holds none."""
    kept = [
        (index, line.strip())
        for index, line in enumerate(source.lines)
        if line.strip() and not line.strip().startswith(COMMENTS)
    ]
    if not kept:
        raise InputError(f"{source.path} is empty: {EXAMPLE}.")
    mark = separator([line for _, line in kept])
    return [CsvLine(index, parts(line, mark)) for index, line in kept]


def separator(lines: list[str]) -> str:
    """The separator of the columns, judged by the first line of numbers; a blank means any number of blanks."""
    line = next((line for line in lines if line[0] in "+-.0123456789"), lines[0])
    return next((mark for mark in ";\t," if mark in line), " ")


def parts(line: str, mark: str) -> list[str]:
    """The cells of a line, which are separated by `mark`."""
    cells = line.split() if mark == " " else line.split(mark)
    return [cell.strip().strip('"').strip() for cell in cells]


def numeric(cells: list[str]) -> bool:
    """Whether any cell of a line is a number, so that it is one of data."""
    return any(NUMBER.fullmatch(cell) or DECIMAL_COMMA.fullmatch(cell) for cell in cells)


def split(source: MotionFile, rows: list[CsvLine]) -> tuple[Header, list[CsvLine]]:
    """What the header says, and the lines of data, which all have as many cells; a file may do without a header.

    Raises:
        InputError: a line has not the cells that it must have, or the header cannot be understood.
    """
    titled = not numeric(rows[0].cells)
    data = rows[1:] if titled else rows
    count = len(data[0].cells) if data else len(rows[0].cells)
    for row in data:
        checked(source, row, count)
    if not titled:
        return Header(None if count == 1 else 0, count - 1, 1.0, ""), data
    title = rows[0].cells
    if len(title) != count and count <= 2:  # a separator of its own, or blanks within its names
        title = header_cells(source.lines[rows[0].line], count)
    if len(title) != count or count > 2:
        raise InputError(
            f"Line {source.at(rows[0].line)} names {len(title)} columns, and {count} follow: {EXAMPLE}."
        )
    return columns(title, source.at(rows[0].line)), data


def header_cells(line: str, count: int) -> list[str]:
    """The names of a header whose names hold blanks, or that has another separator than the data."""
    if count == 1:
        return [line.strip()]
    for mark in (r"[;\t]", ",", r"\s{2,}", r"(?<=[)\]])\s+|\s+(?=[^\s(\[]+\s*(?:[(\[].*)?$)"):
        cells = [cell.strip().strip('"').strip() for cell in re.split(mark, line.strip())]
        if len(cells) == count:
            return cells
    return [line.strip()]


def checked(source: MotionFile, row: CsvLine, count: int) -> None:
    """Raise InputError where a line of data has not its one or two cells, or has decimal commas."""
    place, cells = source.at(row.line), row.cells
    if any(DECIMAL_COMMA.fullmatch(cell) for cell in cells):
        raise InputError(f"The numbers at {place} seem to have decimal commas: {COMMAS}.")
    if len(cells) == count <= 2:
        if "" in cells:
            missing = "time" if count == 2 and not cells[0] else "acceleration"
            raise InputError(f"The {missing} is missing at {place}: fill the cell or drop the line.")
        return
    wanted = KINDS.get(count, "time and acceleration, or acceleration alone")
    hint = f"; where these are decimal commas, {COMMAS}" if len(cells) in (3, 4) else ""
    raise InputError(
        f"Line {place} holds {len(cells)} column{'s' * (len(cells) > 1)}, but must hold {wanted}; {EXAMPLE}{hint}."
    )


def agreed_unit(source: MotionFile, header: Header, unit: str) -> str:
    """The unit of the acceleration; raises InputError where file and plan say two."""
    if header.unit and unit and UNITS[header.unit] != UNITS[unit]:
        raise InputError(
            f"{source.path} says that its acceleration is in {header.unit}, and unit in [ground_motion] says {unit}: "
            "correct one of them."
        )
    return header.unit or unit or "m/s2"


def interval_of(
    source: MotionFile, header: Header, data: list[CsvLine], values: NDArray[np.float64], dt: float
) -> float:
    """Interval (s) of a record; raises InputError where nothing says it, or two things say two."""
    if header.time is None:
        if dt <= 0.0:
            raise InputError(
                f"{source.path} holds one column: give the time between its samples in s as dt in [ground_motion], or "
                "add a column of times."
            )
        return dt
    with np.errstate(over="ignore", invalid="ignore"):
        found = even_interval(header.second * values[:, header.time], [source.at(row.line) for row in data])
    same_interval(source.path, found, dt)
    return found


def same_interval(path: Path, found: float, dt: float) -> None:
    """Raise InputError where the plan gives another interval than the file has, both in s."""
    if dt > 0.0 and abs(found - dt) > UNEVEN * dt:
        raise InputError(
            f"The samples of {path} come every {found:g} s, and dt in [ground_motion] is {dt:g} s: leave out dt, which "
            "is for files without times."
        )


def even_interval(time: NDArray[np.float64], places: list[str]) -> float:
    """Interval (s) of times (n,) in s; raises InputError at the first that does not fit in."""
    steps = np.diff(time)
    back = np.flatnonzero(~(steps > 0.0))
    if back.size:
        place = places[back[0] + 1]
        raise InputError(
            f"The time at {place} does not increase: sort the lines and drop repeated ones, or, where these are "
            f"decimal commas, {COMMAS}."
        )
    usual = float(np.median(steps))
    odd = np.flatnonzero(~(np.abs(steps - usual) <= UNEVEN * usual))
    if odd.size:
        raise InputError(
            f"The time at {places[odd[0] + 1]} comes {steps[odd[0]]:g} s after the line before, elsewhere it is"
            f" {usual:g} s: resample the record at equal intervals, and write the time with enough digits."
        )
    whole = float(time[-1] - time[0]) / steps.size
    return round(whole, 12) if math.isfinite(whole) else math.inf
