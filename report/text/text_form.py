"""The form of a table in a text file: its separator, its decimal sign, and the rows above the names."""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from report.text.cells import THOUSANDS, Notation, grouped, number
from report.text.lines import lines_of

SPACES = " "  # a separator of any number of spaces, as in columns that are printed below each other
SEPARATORS = (",", ";", "\t", SPACES)
CLEAR = (";", "\t")  # separators that stand in no number
DECIMALS = (".", ",")
MARKS = "#%"  # of a comment, in NumPy and in MATLAB, before the names
LOOKED_AT = 200  # rows in which a form is recognised: a preamble of a logger has some tens

Rows = list[list[str]]


class TextForm(NamedTuple):
    """The form of a table in a text file."""

    separator: str = ","
    decimal: str = "."
    skip_rows: int = 0  # before that of the names
    thousands: str = ""  # what parts them, where it is stated

    @property
    def notation(self) -> Notation:
        """How its numbers are written."""
        return Notation(self.decimal, self.thousands)


class StatedForm(NamedTuple):
    """What is known of the form of a text file beforehand; None is recognised in the file."""

    separator: str | None = None
    decimal: str | None = None
    skip_rows: int | None = None
    thousands: str | None = None
    columns: tuple[str, ...] = ()  # names of columns that are looked for


UNSTATED = StatedForm()


def recognised(path: Path, encoding: str, stated: StatedForm) -> TextForm:
    """The form in which most of a file's columns hold numbers; of equals a comma with a decimal point first."""
    lines = list(itertools.islice(lines_of(path, encoding), LOOKED_AT))
    forms = [
        TextForm(separator, decimal, thousands=stated.thousands or "")
        for separator in ([stated.separator] if stated.separator else SEPARATORS)
        for decimal in ([stated.decimal] if stated.decimal else DECIMALS)
        if decimal not in (separator, stated.thousands) and not separator == stated.thousands == SPACES
    ]
    tried = [(form, without_end(split(lines, form.separator), form.notation)) for form in forms]
    form, rows = max(tried, key=lambda one: likely(*one))
    skipped = names_row(rows, form.notation, stated.columns) if stated.skip_rows is None else stated.skip_rows
    return form._replace(skip_rows=skipped)


def likely(form: TextForm, rows: Rows) -> tuple[bool, int]:
    """What orders forms by how likely a file has them, given the rows that it has in this form.

    Where a clear separator leaves numbers only, spaces part thousands and no columns.
    """
    clear = form.separator in CLEAR
    count = numeric_columns(rows, form.notation, may_be_number if clear else is_number)
    return clear and count > 1 and count == len(rows[-1]), count


def split(lines: Sequence[str], separator: str) -> Rows:
    """The cells of each line."""
    lines = [unmarked(line) for line in lines]
    if separator == SPACES:
        return [words(line) for line in lines]
    return list(csv.reader(io.StringIO("".join(lines)), delimiter=separator))


def words(line: str) -> list[str]:
    """The cells of a line between spaces; one that does not break stands within a cell."""
    return [word for word in re.split(r"[ \t\r\n]+", line) if word]


def without_end(rows: Rows, notation: Notation) -> Rows:
    """The rows up to the last one with numbers in as many cells as most of them: behind it a logger writes texts."""
    widths = [len(row) for row in rows if has_number(row, notation)]
    if not widths:
        return rows
    width = max(widths, key=widths.count)
    last = max(place for place, row in enumerate(rows) if len(row) == width and has_number(row, notation))
    return rows[: last + 1]


def numeric_columns(rows: Rows, notation: Notation, numeral: Callable[[str, Notation], bool]) -> int:
    """How many more columns hold numbers than other texts in the last quarter of the rows; empty ones do not count.

    `numeral` says whether a cell is a number.

    A wrong separator cuts numbers in two, and leaves texts of several beside them.
    """
    body = [row for row in rows[3 * len(rows) // 4 :] if row]
    width = len(body[0]) if body else 0
    if any(len(row) != width for row in body):
        return -1
    filled = [[cell for cell in column if cell.strip()] for column in zip(*body, strict=True)]
    numeric = [all(numeral(cell, notation) for cell in column) for column in filled if column]
    return 2 * sum(numeric) - len(numeric)


def names_row(rows: Rows, notation: Notation, columns: Sequence[str]) -> int:
    """The place of the row of names: the last one above the numbers that holds one of these `columns`.

    Where none does it is a row whose cells can be names, with or without a row of units below. Above it lies what a
    logger writes of itself.
    """
    width = len(rows[-1]) if rows else 0
    first = len(rows)
    while first > 0 and len(rows[first - 1]) == width and has_number(rows[first - 1], notation):
        first -= 1
    named = [place for place in range(first) if {cell.strip() for cell in rows[place]} & set(columns)]
    fit = [place for place in (first - 2, first - 1) if place >= 0 and is_head(rows[place], rows[first:])]
    return next(iter([*named[-1:], *fit]), max(first - 1, 0))


def has_number(row: Sequence[str], notation: Notation) -> bool:
    """Whether any cell of a row is a number."""
    return any(is_number(cell, notation) for cell in row)


def is_head(row: Sequence[str], body: Rows) -> bool:
    """Whether the cells of a row may be the names of the columns of a body: one each, and all different."""
    below = body[0] if body else row
    filled = [cell.strip() for cell in row if cell.strip()]
    every = all(name.strip() for name, cell in zip(row, below, strict=False) if cell.strip())
    return len(row) == len(below) and every and len(set(filled)) == len(filled)


def is_number(cell: str, notation: Notation) -> bool:
    """Whether a cell holds a number in this notation."""
    return number(cell, notation) is not None


def may_be_number(cell: str, notation: Notation) -> bool:
    """Whether a cell holds a number in this notation, or one whose thousands are parted by what was not stated."""
    return is_number(cell, notation) or any(
        grouped(cell.strip(), notation.decimal, mark) for mark in THOUSANDS
    )


def unmarked(line: str) -> str:
    """A line without the mark of a comment before it, with which some programs write the names."""
    bare = line.lstrip()
    return bare.lstrip(f"{MARKS} ") if bare.startswith(tuple(MARKS)) else line
