"""Numbers and times in the cells of a text file, as loggers and spreadsheets write them."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from models.registry import Array

EXPONENT = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d)")  # as Fortran writes it
# Groups of three digits, by the decimal sign beside which the other one parts them.
GROUPED = {
    ".": re.compile(r"[+-]?\d{1,3}(,\d{3})+(\.\d*)?"),
    ",": re.compile(r"[+-]?\d{1,3}(\.\d{3})+(,\d*)?"),
}
TIME_OF_DAY = re.compile(r"(?:(\d{4}-\d\d-\d\d)[T ]+)?(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)Z?")
DAY = 86400.0  # s
MOSTLY = 0.5  # of the cells of a column with something in them, which must be numbers: the others are errors


def number(cell: str, decimal: str) -> float | None:
    """The number in a cell with this decimal sign, None where there is none."""
    text = cell.strip()
    if "_" in text:  # which Python reads as part of a number
        return None
    if GROUPED[decimal].fullmatch(text):
        text = text.replace("," if decimal == "." else ".", "")
    if decimal != "." and "." in text:
        return None
    try:
        return float(EXPONENT.sub("e", text.replace(decimal, ".")))
    except ValueError:
        return None


def numbers(cells: Sequence[str], decimal: str) -> Array | None:
    """The numbers (n,) in a column of texts, NaN where a cell has none; None where the column holds other texts."""
    found = [number(cell, decimal) for cell in cells]
    filled = sum(1 for cell in cells if cell.strip())
    right = sum(1 for one in found if one is not None)
    if right == 0 or right < MOSTLY * filled:
        return None
    return np.array([np.nan if one is None else one for one in found])


def times(cells: Sequence[str]) -> Array | None:
    """Times of day (n,), with or without a date, in s from the first on; None where a cell holds anything else.

    Without a date the time goes on after midnight.
    """
    found = [TIME_OF_DAY.fullmatch(cell.strip()) for cell in cells]
    if not found or any(one is None for one in found):
        return None
    parts = [one.groups() for one in found if one is not None]
    seconds = np.array([3600.0 * int(h) + 60.0 * int(m) + float(s.replace(",", ".")) for _, h, m, s in parts])
    if all(date for date, *_ in parts):
        days = np.array([date for date, *_ in parts], dtype="datetime64[D]").astype(np.float64)
        seconds += DAY * (days - days[0])
    else:
        seconds += DAY * np.cumsum(np.diff(seconds, prepend=seconds[0]) < -0.5 * DAY)
    return np.asarray(seconds - seconds[0])
