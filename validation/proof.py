"""Common parts of the proofs' pages: pictures that are drawn into a folder and embedded in the page."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from report.page.photo import Photo, photo
from report.pictures.figure import SINGLE, figure, save


class ProofFigure(NamedTuple):
    """One picture of the evidence, and its caption."""

    file: str
    caption: str
    draw: Callable[[Any, Any], None]  # of the evidence, onto an empty figure
    height: float = 2.6  # inches


def draw_all(figures: Iterable[ProofFigure], evidence: Any, folder: Path) -> list[Photo]:
    """Draw figures into a folder, and return them as they are embedded in a page."""
    photos = []
    for item in figures:
        canvas = figure(SINGLE, item.height)
        item.draw(evidence, canvas)
        save(canvas, folder / item.file)
        photos.append(photo((folder / item.file).read_bytes(), item.caption))
    return photos
