"""Numbers and times in the cells of a text file, as loggers and spreadsheets write them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from models.registry import Array

EXPONENT = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d)")  # as Fortran writes it
OTHER = {".": ",", ",": "."}  # the sign that may part thousands, by the decimal sign
# What parts groups of three digits, by the character that states it: an apostrophe also as a typographic one, in
# Unicode and in the code page of Windows, a space also as one that is thin or that does not break.
THOUSANDS = {",": ",", ".": ".", "'": "'\u2019\x92", " ": " \u00a0\u2007\u2009\u202f"}
# A number in groups begins with no zero: 0,125 is a fraction.
GROUPED = {
    (decimal, mark): re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:[{signs}]\d{{3}})+(?:[{decimal}]\d*)?")
    for decimal in OTHER
    for mark, signs in THOUSANDS.items()
    if mark != decimal
}
TIME_OF_DAY = re.compile(
    r"(?:(\d{4}-\d\d-\d\d)[T ]+)?(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)(?:Z|\s*([ap])\.?\s?m\.?)?", re.IGNORECASE
)
DAY = 86400.0  # s
HALF = 12  # hours to noon
MOSTLY = 0.5  # of the cells of a column with something in them, which must be numbers: the others are errors


class Notation(NamedTuple):
    """How numbers are written."""

    decimal: str = "."
    thousands: str = (
        ""  # what parts groups of three digits; empty: nothing, or the other sign than the decimal one
    )


def grouped(text: str, decimal: str, mark: str) -> bool:
    """Whether a text is a number whose thousands are parted by a mark of `THOUSANDS`."""
    return mark != decimal and GROUPED[decimal, mark].fullmatch(text) is not None


def number(cell: str, notation: Notation) -> float | None:
    """The number in a cell that is written in this notation, None where there is none."""
    decimal, mark = notation.decimal, notation.thousands or OTHER[notation.decimal]
    text = cell.strip()
    if "_" in text:  # which Python reads as part of a number
        return None
    if grouped(text, decimal, mark):
        text = re.sub(f"[{THOUSANDS[mark]}]", "", text)
    if decimal != "." and "." in text:
        return None
    try:
        return float(EXPONENT.sub("e", text.replace(decimal, ".")))
    except ValueError:
        return None


def numbers(cells: Sequence[str], notation: Notation) -> Array | None:
    """The numbers (n,) in a column of texts, NaN where a cell has none; None where the column holds other texts."""
    found = [number(cell, notation) for cell in cells]
    filled = sum(1 for cell in cells if cell.strip())
    right = sum(1 for one in found if one is not None)
    if right == 0 or right < MOSTLY * filled:
        return None
    return np.array([np.nan if one is None else one for one in found])


def times(cells: Sequence[str]) -> Array | None:
    """Times of day (n,), with or without a date, in s from the first on; None where a cell holds anything else.

    Without a date the time goes on after midnight. All cells have 24 hours, or all have AM or PM.
    """
    found = [TIME_OF_DAY.fullmatch(cell.strip()) for cell in cells]
    if not found or any(one is None for one in found):
        return None
    parts = [one.groups() for one in found if one is not None]
    hours = [hour_of_day(int(hour), half) for _, hour, _, _, half in parts]
    if None in hours or len({half is None for *_, half in parts}) > 1:
        return None
    within = np.array([60.0 * int(m) + float(s.replace(",", ".")) for _, _, m, s, _ in parts])
    seconds = 3600.0 * np.array(hours, dtype=np.float64) + within
    if all(date for date, *_ in parts):
        days = np.array([date for date, *_ in parts], dtype="datetime64[D]").astype(np.float64)
        seconds += DAY * (days - days[0])
    else:
        seconds += DAY * np.cumsum(np.diff(seconds, prepend=seconds[0]) < -0.5 * DAY)
    return np.asarray(seconds - seconds[0])


def hour_of_day(hour: int, half: str | None) -> int | None:
    """The hour of 24 of an hour with the first letter of AM or PM, where it has one; None where there is no such."""
    if half is None:
        return hour
    if not 1 <= hour <= HALF:
        return None
    return hour % HALF + (HALF if half in "pP" else 0)
