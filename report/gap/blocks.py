"""Building blocks of the page, those of all pages. What takes text escapes it; `content` and cells are HTML already."""

from __future__ import annotations

import html
from collections.abc import Sequence

from markupsafe import Markup

from report import page
from report.text.formats import as_float, known, percent


def esc(text: object) -> str:
    """Text that is safe inside HTML."""
    return html.escape(str(text))


def section(name: str, title: str, *content: str) -> str:
    """A section with its anchor."""
    inside = ready("\n".join(filter(None, content)))
    return str(page.block("section", name, title, caller=lambda: inside)) + "\n"


def ready(content: str) -> Markup:
    """What is HTML already, for blocks that escape text."""
    return Markup(content)  # noqa: S704 - made here


def heading(text: str) -> str:
    """A heading inside a section."""
    return f"<h3>{esc(text)}</h3>"


def paragraph(text: str, style: str = "") -> str:
    """A paragraph of text."""
    return str(page.block("paragraph", text, style)) if text else ""


def absent(text: str) -> str:
    """A sentence that says what is not there."""
    return paragraph(text, "absent")


def bullets(texts: Sequence[str]) -> str:
    """A list of texts."""
    return str(page.block("bullets", texts)) if texts else ""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; cells are HTML already, heads are text."""
    return str(page.table(head, [[ready(cell) for cell in row] for row in rows]))


def bar(share: object, label: str = "", style: str = "") -> str:
    """A share as a bar with its number."""
    number = as_float(share)
    width = 100.0 * min(max(number, 0.0), 1.0) if known(number) else 0.0
    return (
        f'<span class="bar {esc(style)}"><i style="width:{width:.1f}%"></i></span>'
        f'<span class="number">{esc(label or percent(share))}</span>'
    )


def figure(picture: str, caption: str, note: str = "") -> str:
    """A picture with its caption; nothing where there is no picture."""
    return str(page.block("drawing", ready(picture), caption, note)) if picture else ""


def gallery(figures: Sequence[str]) -> str:
    """Pictures side by side where there is room."""
    found = [item for item in figures if item]
    return f'<div class="gallery">{"".join(found)}</div>' if found else ""
