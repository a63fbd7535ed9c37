"""Fragility curves as one HTML page."""

from __future__ import annotations

from report.fragility import pictures, tables
from report.fragility.curves import Curves
from report.page import frame, render
from report.text.formats import quantity

METHOD = (
    "The chance follows the lognormal distribution of greatest likelihood for the tests that passed the limit at each "
    "intensity. The intervals hold for tests that are independent of each other; tests of few records are not, and "
    "other records may give another curve."
)


def page(found: Curves) -> str:
    """The page's text."""
    facts = [
        ("table", found.table),
        ("quantity", found.quantity),
        ("limit", quantity(found.limit, found.unit)),
        ("intensity", found.intensity),
        ("tests", f"{sum(one.fit.tests for one in found.curves):,}"),
    ]
    body = render(
        "fragility.html",
        quantity=found.quantity,
        facts=facts,
        method=METHOD,
        picture=pictures.drawing(found),
        fits=tables.fits(found),
        missing=tables.missing(found),
        stripes=tables.stripes(found),
    )
    return frame(f"Fragility: {found.quantity}", body)
