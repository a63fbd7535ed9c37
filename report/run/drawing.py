"""The pictures of a recording in the form in which its page holds them."""

from __future__ import annotations

import io
from typing import NamedTuple

from common.recording.run import Run
from common.roles import name_of, title
from common.terminal.telling import Tell
from report.facts.laboratories import views
from report.page import data_uri
from report.pictures import PICTURES, Picture, figure, needs, shows

INCH = 96  # CSS pixels
WIDE = ("histories",)  # pictures over the whole test, which get two columns where there is room


class DrawnPicture(NamedTuple):
    """A picture: an address that holds it, its CSS pixels, what it shows; `wide` for two columns, or empty."""

    name: str
    source: str
    size: tuple[int, int]
    alt: str
    caption: str
    wide: str = ""


Pictures = dict[str, list[DrawnPicture]]  # by the role of the slave that they concern


def draw_all(run: Run, tell: Tell) -> tuple[Pictures, dict[str, str]]:
    """Every picture that a recording has signals for, by slave; and those left out, with the signals they need."""
    parts = views(run)
    asked = [(role, picture) for role in parts for picture in PICTURES.values()]
    found: Pictures = {role: [] for role in parts}
    for place, (role, picture) in enumerate(asked):
        tell(picture.name, place, len(asked))
        if drawn := draw(parts[role], role, picture):
            found[role].append(drawn)
    names = {drawn.name for several in found.values() for drawn in several}
    return found, {name: needs(run, picture) for name, picture in PICTURES.items() if name not in names}


def draw(part: Run, role: str, picture: Picture) -> DrawnPicture | None:
    """One picture of the part of a recording that concerns a slave; None where it lacks the picture's signals."""
    narrow = png(part, picture, picture.size)
    if narrow is None:
        return None
    wide = png(part, picture, picture.double) if picture.name in WIDE else None
    of = f" of the {title(role)}" if name_of(role) else ""
    return DrawnPicture(
        picture.name,
        data_uri(narrow[0]),
        narrow[1],
        f"{picture.name.capitalize()}{of}",
        f"{picture.name.capitalize()}: {shows(part, picture)}.",
        data_uri(wide[0]) if wide else "",
    )


def png(part: Run, picture: Picture, size: tuple[float, float]) -> tuple[bytes, tuple[int, int]] | None:
    """A picture as PNG and its CSS pixels; unlike SVG, PNG stays small however long the test was."""
    canvas = figure.figure(*size)
    if not picture.on(part, canvas):
        return None
    stream = io.BytesIO()
    canvas.savefig(stream, format="png", dpi=figure.DOTS, metadata=figure.STAMPS[".png"])
    width, height = (round(INCH * float(inches)) for inches in canvas.get_size_inches())
    return stream.getvalue(), (width, height)
