"""Values for the template of the page: tables, pictures with captions, and cells that are more than text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from markupsafe import Markup

from report import page
from report.text.formats import as_float, known, percent


class Rows(NamedTuple):
    """A table: heads, and rows of cells that are text or made by a block."""

    head: tuple[str, ...]
    rows: list[list[str]]


class Drawing(NamedTuple):
    """A picture with its caption."""

    picture: Markup  # SVG
    caption: str
    note: str = ""


def drawings(*found: tuple[str, str] | tuple[str, str, str]) -> list[Drawing]:
    """Pictures with captions and notes; those without a picture are left out."""
    return [Drawing(Markup(item[0]), *item[1:]) for item in found if item[0]]  # noqa: S704 - made by pictures


def bar(share: object, label: str = "") -> Markup:
    """A share as a bar with its number."""
    number = as_float(share)
    width = 100.0 * min(max(number, 0.0), 1.0) if known(number) else 0.0
    return page.block("bar", f"{width:.1f}", label or percent(share))


def strong(text: str) -> Markup:
    """A cell in bold."""
    return page.block("strong", text)


def code(name: str) -> Markup:
    """A name as written in files."""
    return page.block("code", name)


def lines(texts: Sequence[str]) -> Markup:
    """Texts below each other, none of them broken."""
    return page.block("lines", texts)
