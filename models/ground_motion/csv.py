"""Reader of two columns, time and acceleration, under a header that names the unit of the acceleration."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.errors import InputError
from models.ground_motion.record import GAL, STANDARD_GRAVITY, GroundMotion
from models.ground_motion.source import Source, number, read_source

UNITS = {"g": STANDARD_GRAVITY, "gal": GAL, "cm/s2": 0.01, "m/s2": 1.0, "mm/s2": 0.001}  # in m/s²
EXAMPLE = "write a first line such as: time (s),acceleration (g)"
UNEVEN = 0.02  # of the interval; times are often written with few digits

Row = tuple[int, list[str]]  # index of the line, cells


def read_csv(path: Path) -> GroundMotion:
    """A motion from columns parted by comma, semicolon or tab; the record begins at its first line's time.

    The header gives the unit in parentheses: g, gal, cm/s2, m/s2 or mm/s2, the square also as ^2 or ².
    Empty lines and lines that begin with # are passed over.

    Raises:
        InputError: no header or unit, not two columns, a missing cell, a value that is not a finite
            number, or times that do not increase in equal intervals.
    """
    source = read_source(path)
    rows = cells(source)
    factor = unit(source, rows)
    data = np.array([[number(cell, source.at(index)) for cell in row] for index, row in rows[1:]])
    if len(data) < 2:
        raise InputError(f"{path} holds fewer than two samples: get the whole file.")
    interval = even_interval(data[:, 0], [source.at(index) for index, _ in rows[1:]])
    return GroundMotion(path.stem, source.version, interval, factor * data[:, 1])


def cells(source: Source) -> list[Row]:
    """The lines that hold something, each with its two cells; raises InputError where a line has not two."""
    kept = [(i, line) for i, line in enumerate(source.lines) if line.strip() and not line.startswith("#")]
    separator = next((mark for mark in ",;\t" if kept and mark in kept[0][1]), ",")
    rows = [(i, [cell.strip().strip('"') for cell in line.split(separator)]) for i, line in kept]
    for index, row in rows:
        if len(row) != 2:
            raise InputError(
                f"Line {source.at(index)} holds {len(row)} column{'s' * (len(row) > 1)}, but must hold time and"
                f" acceleration with '{separator}' between; {EXAMPLE}."
            )
        if "" in row:
            missing = ("time", "acceleration")[row.index("")]
            raise InputError(
                f"The {missing} is missing at {source.at(index)}: fill the cell or drop the line."
            )
    return rows


def unit(source: Source, rows: list[Row]) -> float:
    """The header's unit of acceleration in m/s²; raises InputError where there is none or an unknown one."""
    if not rows:
        raise InputError(f"{source.path} is empty: {EXAMPLE}.")
    index, (time, acceleration) = rows[0]
    match = re.search(r"\(([^)]*)\)", acceleration)
    known = ", ".join(UNITS)
    if not match:
        raise InputError(f"Line {source.at(index)} names no unit of the acceleration ({known}): {EXAMPLE}.")
    name = re.sub(r"[\s^*]", "", match[1].lower().replace("²", "2"))
    if name not in UNITS:
        raise InputError(f"Unit '{match[1]}' at {source.at(index)} is none of {known}: {EXAMPLE}.")
    if "(" in time and not re.search(r"\(\s*(s|sec)\s*\)", time, re.IGNORECASE):
        raise InputError(f"The time at {source.at(index)} must be in seconds: {EXAMPLE}.")
    return UNITS[name]


def even_interval(time: NDArray[np.float64], places: list[str]) -> float:
    """Interval (s) of times (n,) in s; raises InputError at the first that does not fit in."""
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0.0)
    if back.size:
        place = places[back[0] + 1]
        raise InputError(f"The time at {place} does not increase: sort the lines and drop repeated ones.")
    usual = float(np.median(steps))
    odd = np.flatnonzero(np.abs(steps - usual) > UNEVEN * usual)
    if odd.size:
        raise InputError(
            f"The time at {places[odd[0] + 1]} comes {steps[odd[0]]:g} s after the line before, elsewhere it is"
            f" {usual:g} s: resample the record at equal intervals, and write the time with enough digits."
        )
    return round(float(time[-1] - time[0]) / steps.size, 12)
