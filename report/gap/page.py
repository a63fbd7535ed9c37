"""A diagnosis as one HTML page, readable without network, on a phone and on paper."""

from __future__ import annotations

from markupsafe import Markup

from report.gap import how_far, limits, overview
from report.gap.where import where
from report.gap.which import which
from report.gap.wording import Report
from report.page import frame


def page(report: Report) -> str:
    """The page's text; pictures stand inside."""
    name = ((report.get("details") or {}).get("test") or {}).get("name")
    sections = (
        overview.overview,
        overview.gap,
        where,
        which,
        how_far.how_far,
        how_far.paths,
        how_far.tolerances,
        limits.equivalents,
        limits.not_exercised,
        limits.next_test,
        limits.warnings,
    )
    body = "".join(section(report) for section in sections) + limits.how_to_read()
    title = "Sim-to-real gap" + (f": {name}" if name else "")
    return frame(title, Markup(body))  # noqa: S704 - made by blocks that escape what they are given
