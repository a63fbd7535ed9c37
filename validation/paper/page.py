"""One HTML page with the table and the figures, readable without network."""

from __future__ import annotations

from pathlib import Path

from report.page import frame, render
from report.page.photo import photo
from validation.paper.figures import PaperFigure
from validation.paper.rows import PaperRow

TITLE = "The seed paper, reproduced"


def page(rows: list[PaperRow], figures: list[PaperFigure], folder: Path) -> str:
    """The page's text; pictures are taken from `folder` and stand inside."""
    passed = sum(row.passed for row in rows)
    images = [photo((folder / item.file).read_bytes(), item.caption) for item in figures]
    body = render("reproduction.html", title=TITLE, rows=rows, passed=passed, images=images)
    return frame(TITLE, body)
