"""Building blocks of the page. What takes text escapes it; what is called `content` is HTML already."""

from __future__ import annotations

import html
from collections.abc import Sequence

from rths.diagnosis_report.values import as_float, known, percent


def esc(text: object) -> str:
    """Text that is safe inside HTML."""
    return html.escape(str(text))


def section(name: str, title: str, *content: str) -> str:
    """A section with its anchor."""
    return (
        f'<section id="{esc(name)}"><h2>{esc(title)}</h2>\n{chr(10).join(filter(None, content))}</section>\n'
    )


def heading(text: str) -> str:
    """A heading inside a section."""
    return f"<h3>{esc(text)}</h3>"


def paragraph(text: str, style: str = "") -> str:
    """A paragraph of text."""
    if not text:
        return ""
    return f'<p class="{esc(style)}">{esc(text)}</p>' if style else f"<p>{esc(text)}</p>"


def absent(text: str) -> str:
    """A sentence that says what is not there."""
    return paragraph(text, "absent")


def bullets(texts: Sequence[str]) -> str:
    """A list of texts."""
    return f"<ul>{''.join(f'<li>{esc(text)}</li>' for text in texts)}</ul>" if texts else ""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; cells are HTML already, heads are text."""
    if not rows:
        return ""
    top = "".join(f"<th>{esc(text)}</th>" for text in head)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


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
    if not picture:
        return ""
    small = f"<small>{esc(note)}</small>" if note else ""
    return (
        f'<figure role="img" aria-label="{esc(caption)}">{picture}'
        f"<figcaption>{esc(caption)}{small}</figcaption></figure>"
    )


def gallery(figures: Sequence[str]) -> str:
    """Pictures side by side where there is room."""
    found = [item for item in figures if item]
    return f'<div class="gallery">{"".join(found)}</div>' if found else ""
