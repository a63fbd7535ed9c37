"""Reader of AT2 files of the Pacific Earthquake Engineering Research Center (PEER)."""

from __future__ import annotations

import re
from pathlib import Path

from common.errors import InputError
from models.ground_motion.record import STANDARD_GRAVITY, GroundMotion
from models.ground_motion.source import MotionFile, number, numbers, read_source

HEADER = 4  # lines
TITLE, UNITS, SAMPLING = 1, 2, 3  # their indices

IN_G = re.compile(r"\bUNITS?\s+(?:OF\s+|IN\s+|ARE\s+)?G\b(?!\s*/)", re.IGNORECASE)
BY_NAME = {
    "NPTS": re.compile(r"\bNPTS\s*[=:]\s*([^\s,]+)", re.IGNORECASE),
    "DT": re.compile(r"\bDT\s*[=:]\s*([^\s,]+)", re.IGNORECASE),
}
VALUES_FIRST = re.compile(r"^\s*([^\s,]+)[\s,]+([^\s,]+)\s+NPTS\s*,\s*DT\b", re.IGNORECASE)


def read_at2(path: Path) -> GroundMotion:
    """A motion from four header lines and wrapped values in g.

    The fourth line names the number of points and the interval in s, as `NPTS= 4000, DT= .0100 SEC` or as
    `4000 0.0100 NPTS, DT`. The name is the second line: earthquake, date, station and component.

    Raises:
        InputError: a header line is missing or impossible, the unit is not g, a value is not a finite
            number, or the number of values is not the announced one.
    """
    source = read_source(path)
    if len(source.lines) <= HEADER:
        raise InputError(f"{path} ends within the four header lines of an AT2 file: get the whole file.")
    if not IN_G.search(source.lines[UNITS]):
        raise InputError(
            f"Line {source.at(UNITS)} does not say UNITS OF G, the only unit of AT2 files read here:"
            " convert the record to a CSV file that names its unit."
        )
    points, interval = sampling(source)
    values = numbers(source, HEADER)
    if values.size != points:
        raise InputError(
            f"{path} announces NPTS = {points} in line {SAMPLING + 1} but holds {values.size} values:"
            " get the whole file or correct NPTS."
        )
    name = " ".join(source.lines[TITLE].split()) or path.stem
    return GroundMotion(name, source.version, interval, STANDARD_GRAVITY * values)


def sampling(source: MotionFile) -> tuple[int, float]:
    """Number of points and interval (s) of the fourth line; raises InputError where they are missing or wrong."""
    line, where = source.lines[SAMPLING], source.at(SAMPLING)
    first = VALUES_FIRST.match(line)
    found = dict(zip(BY_NAME, first.groups(), strict=True)) if first else {}
    for name, pattern in BY_NAME.items():
        match = pattern.search(line)
        if match:
            found[name] = match[1]
        if name not in found:
            raise InputError(f"Line {where} does not give {name}: write it as NPTS= 4000, DT= .0100 SEC.")
    points, interval = number(found["NPTS"], where), number(found["DT"], where)
    if points != int(points) or points < 2:
        raise InputError(f"NPTS at {where} is {found['NPTS']}, but must be a whole number of at least 2.")
    if interval <= 0.0:
        raise InputError(f"DT at {where} is {found['DT']} s, but must be above 0: correct the file.")
    return int(points), interval
