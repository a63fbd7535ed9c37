"""A picture in a page: an address that holds it, its size on the screen, its caption."""

from __future__ import annotations

from typing import NamedTuple

from report.page import data_uri
from report.pictures import figure

DOTS = 96 / figure.DOTS  # CSS pixels per dot of a picture
SIZE_AT = 16  # of width and height in the file of a picture


class Photo(NamedTuple):
    """A figure of a page: an address that holds it, CSS pixels, caption."""

    source: str
    size: tuple[int, int]
    caption: str


def photo(png: bytes, caption: str) -> Photo:
    """A picture as it stands inside a page."""
    width, height = (int.from_bytes(png[at : at + 4], "big") for at in (SIZE_AT, SIZE_AT + 4))
    return Photo(data_uri(png), (round(width * DOTS), round(height * DOTS)), caption)
