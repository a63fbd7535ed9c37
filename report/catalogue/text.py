"""Cells of the catalogue's tables on a terminal and on its page."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence

from report.catalogue import store
from report.catalogue.columns import BY_NAME, COLUMNS, WHOLE, Facts
from report.text.formats import quantity
from report.text.terminal import TitledTable

LISTED = ("file", "started", "test", "scale", "outcome", "late")  # columns of every list
EMPTY = "–"


def cell(facts: Facts, name: str) -> str:
    """A fact as text; the outcome of a recording that cannot be read is what its file is."""
    value, unit = facts[name], BY_NAME[name].unit
    if name == "outcome" and value is None and facts["state"] != WHOLE:
        return str(facts["state"])
    if value is None:
        return EMPTY
    if unit is None:
        return str(value)
    if unit in ("", "B"):
        return f"{value:,.0f}" if float(value).is_integer() else f"{value:g}"
    return quantity(value, unit)


def listed(
    base: sqlite3.Connection, found: Sequence[Facts], columns: Sequence[str], signals: Sequence[str]
) -> TitledTable:
    """Recordings as a table: the usual columns, further ones, and the peaks of signals."""
    names = list(dict.fromkeys((*LISTED, *columns)))
    signals = list(dict.fromkeys(signals))
    largest = [store.largest(base, signal) for signal in signals]
    rows = []
    for facts in found:
        peaks = [one.get(facts["file"]) for one in largest]
        cells = [quantity(peak.value, peak.unit) if peak else EMPTY for peak in peaks]
        rows.append([*(cell(facts, name) for name in names), *cells])
    return TitledTable("", [*names, *(f"peak {signal}" for signal in signals)], rows)


def whole(facts: Facts) -> list[tuple[str, str]]:
    """All that is known of one recording, as names and texts."""
    return [(one.name, cell(facts, one.name)) for one in COLUMNS if facts[one.name] is not None]
