"""One HTML page with the table and the figures, readable without network."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from rths import figure
from rths.page import data_uri, frame, render
from rths.reproduction.figures import Figure
from rths.reproduction.rows import Row

TITLE = "The seed paper, reproduced"
DOTS = 96 / figure.DOTS  # CSS pixels per dot of a picture
SIZE_AT = 16  # of width and height in the file of a picture


class Image(NamedTuple):
    """A figure of the page: an address that holds it, CSS pixels, caption."""

    source: str
    size: tuple[int, int]
    caption: str


def page(rows: list[Row], figures: list[Figure], folder: Path) -> str:
    """The page's text; pictures are taken from `folder` and stand inside."""
    passed = sum(row.passed for row in rows)
    images = [image((folder / item.file).read_bytes(), item.caption) for item in figures]
    body = render("reproduction.html", title=TITLE, rows=rows, passed=passed, images=images)
    return frame(TITLE, body)


def image(png: bytes, caption: str) -> Image:
    """A figure as it stands inside the page."""
    width, height = (int.from_bytes(png[at : at + 4], "big") for at in (SIZE_AT, SIZE_AT + 4))
    return Image(data_uri(png), (round(width * DOTS), round(height * DOTS)), caption)
