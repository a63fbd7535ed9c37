"""Several recordings as one HTML page."""

from __future__ import annotations

from collections.abc import Sequence

from report.page import frame, render
from report.several import pictures, tables
from report.several.runs import Chosen, OneRun
from report.text.terminal import TitledTable

ACROSS = 6  # columns that fit on paper beside the first one


def page(runs: Sequence[OneRun], signals: Sequence[Chosen]) -> str:
    """The page's text."""
    body = render(
        "several.html",
        count=len(runs),
        picture=pictures.histories(runs, signals),
        tables=[split(one) for one in tables.all_of(runs, signals)],
    )
    return frame(f"{len(runs)} recordings", body)


def split(table: TitledTable) -> list[TitledTable]:
    """A table as several ones, each with the first column and as many further ones as fit on paper."""
    places = range(1, len(table.head), ACROSS)
    return [
        TitledTable(
            table.title if begin == 1 else "",
            [table.head[0], *table.head[begin : begin + ACROSS]],
            [[row[0], *row[begin : begin + ACROSS]] for row in table.rows],
        )
        for begin in places
    ]
