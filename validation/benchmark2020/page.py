"""The benchmark as one HTML page, readable without network."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from report.page import frame, render
from report.page.photo import photo
from validation.benchmark2020.criteria import MEANINGS
from validation.benchmark2020.evidence import BenchmarkEvidence, GoalCheck
from validation.benchmark2020.figures import GoalFigure
from validation.benchmark2020.tables import tables

TITLE = "The 2020 benchmark of real-time hybrid simulation"


def page(
    evidence: BenchmarkEvidence, checks: Sequence[GoalCheck], figures: Sequence[GoalFigure], folder: Path
) -> str:
    """The page's text; pictures are taken from `folder` and stand inside."""
    body = render(
        "benchmark2020.html",
        title=TITLE,
        plants=evidence.plants,
        seed=evidence.seed,
        tests=len(evidence.results),
        checks=checks,
        tables=tables(evidence),
        meanings=list(MEANINGS.items()),
        images=[photo((folder / item.file).read_bytes(), item.caption) for item in figures],
    )
    return frame(TITLE, body)
