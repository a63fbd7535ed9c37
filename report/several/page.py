"""Several recordings as one HTML page."""

from __future__ import annotations

from collections.abc import Sequence

from report.page import frame, render
from report.several import choice, pictures, tables
from report.several.runs import ChosenSignal, OneRun
from report.text.terminal import TitledTable

ACROSS = 7  # columns that fit on paper


def page(runs: Sequence[OneRun], signals: Sequence[ChosenSignal]) -> str:
    """The page's text."""
    body = render(
        "several.html",
        count=len(runs),
        picture=pictures.histories(runs, signals),
        offered=choice.offered(runs, signals),
        tables=[split(one) for one in tables.all_of(runs, signals)],
    )
    return frame(f"{len(runs)} recordings", body)


def split(table: TitledTable) -> list[TitledTable]:
    """A table as several ones that fit on paper; each begins with the columns that tell the rows apart."""
    keys = 1 if len({row[0] for row in table.rows}) == len(table.rows) else 2
    step = ACROSS - keys
    return [
        TitledTable(
            table.title if begin == keys else "",
            [*table.head[:keys], *table.head[begin : begin + step]],
            [[*row[:keys], *row[begin : begin + step]] for row in table.rows],
        )
        for begin in range(keys, len(table.head), step)
    ]
