"""The benchmark as one HTML page, readable without network."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rths.page import frame, render
from rths.page.photo import photo
from rths.yardstick.criteria import MEANINGS
from rths.yardstick.evidence import Check, Evidence
from rths.yardstick.figures import Figure
from rths.yardstick.tables import tables

TITLE = "The 2020 benchmark of real-time hybrid simulation"


def page(evidence: Evidence, checks: Sequence[Check], figures: Sequence[Figure], folder: Path) -> str:
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
