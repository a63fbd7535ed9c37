"""One HTML page with the table and the figures, readable without network."""

from __future__ import annotations

from report.page import frame, render
from report.page.photo import Photo
from validation.paper.rows import PaperRow

TITLE = "The seed paper, reproduced"


def page(rows: list[PaperRow], images: list[Photo]) -> str:
    """The HTML text with the pictures embedded."""
    passed = sum(row.passed for row in rows)
    return frame(TITLE, render("reproduction.html", title=TITLE, rows=rows, passed=passed, images=images))
