"""The benchmark as one HTML page, readable without network."""

from __future__ import annotations

from collections.abc import Sequence

from report.page import frame, render
from report.page.photo import Photo
from validation.benchmark2020.criteria import MEANINGS
from validation.benchmark2020.evidence import BenchmarkEvidence, GoalCheck
from validation.benchmark2020.tables import tables

TITLE = "The 2020 benchmark of real-time hybrid simulation"


def page(evidence: BenchmarkEvidence, checks: Sequence[GoalCheck], images: Sequence[Photo]) -> str:
    """The HTML text with the pictures embedded."""
    body = render(
        "benchmark2020.html",
        title=TITLE,
        plants=evidence.plants,
        seed=evidence.seed,
        tests=len(evidence.results),
        checks=checks,
        tables=tables(evidence),
        meanings=list(MEANINGS.items()),
        images=images,
    )
    return frame(TITLE, body)
