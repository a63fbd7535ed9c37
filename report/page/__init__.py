"""The common frame of all HTML pages: style, contents, blocks; a page is one file that loads nothing else.

Templates are jinja2's with autoescape, not strings put together: text of a recording is escaped wherever it stands,
without a call for it. What is HTML already is `Markup`.
"""

from __future__ import annotations

import base64
import functools
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

FOLDER = Path(__file__).parent
HEADING = re.compile(r'<section id="([^"]*)"><h2>(.*?)</h2>', re.DOTALL)
NUMBER = re.compile(r"[<>≤≥±×+−-]?\s?[\d∞][\d.,]*(e[+-]?\d+)?(\s?[^\s\d]{1,6})?( \(.*\))?")
NOTHING = ("", "–", "?", "unstable")  # cells that say that there is no number


@functools.cache
def environment() -> Environment:
    """The templates of this folder."""
    found = Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.globals["table"] = table
    found.filters["breakable"] = breakable
    return found


def render(template: str, **values: Any) -> Markup:
    """A template of this folder filled in; texts are escaped."""
    return Markup(environment().get_template(template).render(**values))  # noqa: S704 - of autoescape


def block(name: str, *values: Any, **named: Any) -> Markup:
    """One block of `blocks.html` filled in; texts are escaped."""
    return block_of("blocks.html", name, *values, **named)


def block_of(template: str, name: str, *values: Any, **named: Any) -> Markup:
    """One block of a template of this folder filled in; texts are escaped."""
    module: Any = environment().get_template(template).module
    return Markup(getattr(module, name)(*values, **named).strip())  # noqa: S704 - of autoescape


def frame(title: str, body: Markup) -> str:
    """A whole page: `body` is a header and its sections, of which the contents are listed between them."""
    listed = [(name, Markup(text)) for name, text in HEADING.findall(body)]  # noqa: S704 - of the body
    start = body.find("<section")
    head, rest = (body, Markup()) if start < 0 else (body[:start], body[start:])
    style = Markup((FOLDER / "style.css").read_text(encoding="utf-8"))  # noqa: S704 - of this folder
    return str(render("frame.html", title=title, style=style, head=head, contents=listed, body=rest))


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Markup:
    """A table in a box of its own that scrolls; nothing without rows. Columns of numbers are right-aligned."""
    if not rows:
        return Markup()
    right = [numeric(column) for column in zip(*rows, strict=True)]
    return block("table", head, rows, right)


def numeric(column: Iterable[str]) -> bool:
    """Whether a column's cells are numbers, units and intervals included, and one at least is there."""
    given = [cell for cell in column if str(cell) not in NOTHING]
    return bool(given) and all(NUMBER.fullmatch(str(cell)) for cell in given)


def breakable(name: str) -> Markup:
    """A signal's name that may go on in the next line behind each of its words."""
    return Markup(re.sub(r"([_/])", r"\1<wbr>", str(escape(name))))  # noqa: S704 - escaped before


def data_uri(png: bytes) -> str:
    """A picture as an address that holds it."""
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"
