"""The catalogue as one HTML page: a table that is sorted by its heads and filtered by words."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from typing import NamedTuple

from report.catalogue import store
from report.catalogue.columns import BY_NAME, DRIFT, Facts
from report.catalogue.text import EMPTY, cell
from report.page import frame, render
from report.text.formats import quantity

SHOWN = (
    "file",
    "started",
    "test",
    "motion",
    "scale",
    "duration",
    "clock",
    "outcome",
    "late",
    "diagnosis",
    "tags",
    "notes",
)


class Cell(NamedTuple):
    """A cell: what it shows, and what it is sorted by."""

    text: str
    order: float | str


def page(
    base: sqlite3.Connection, found: Sequence[Facts], name: str, signals: Sequence[str] = (DRIFT,)
) -> str:
    """The page's text; `name` is that of the catalogue's folder, `signals` are those whose peaks are shown."""
    largest = [store.largest(base, signal) for signal in signals]
    rows = []
    for facts in found:
        cells = [Cell(cell(facts, column), sortable(facts[column])) for column in SHOWN]
        for peaks in largest:
            peak = peaks.get(facts["file"])
            cells.append(Cell(quantity(peak.value, peak.unit), peak.value) if peak else Cell(EMPTY, ""))
        rows.append((facts["state"], facts["damage"], cells))
    heads = [(column, BY_NAME[column].text) for column in SHOWN]
    heads += [(f"peak {signal}", "the largest magnitude of the signal") for signal in signals]
    outcomes = sorted({str(facts["outcome"] or facts["state"]) for facts in found})
    body = render(
        "catalogue.html", name=name, heads=heads, rows=rows, outcomes=outcomes, place=SHOWN.index("outcome")
    )
    return frame(f"Tests in {name}", body)


def sortable(value: object) -> float | str:
    """A value by which rows are sorted."""
    return value if isinstance(value, int | float) else str(value or "").lower()
