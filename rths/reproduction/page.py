"""One HTML page with the table and the figures, readable without network."""

from __future__ import annotations

import base64
import html
from pathlib import Path

from rths.reproduction.figures import Figure
from rths.reproduction.rows import Row

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; width: 100%; font-size: 13px; }
th, td { text-align: left; vertical-align: top; padding: .35rem .5rem; border-bottom: 1px solid #ccc; }
.pass { color: #00694b; font-weight: 600; } .fail { color: #b33000; font-weight: 600; }
small { color: #555; display: block; } figure { margin: 2rem 0; break-inside: avoid; } img { width: 100%; }
figcaption { font-size: 13px; color: #444; }
"""


def page(rows: list[Row], figures: list[Figure], folder: Path) -> str:
    """The page's text; pictures are taken from `folder` and stand inside."""
    passed = sum(row.passed for row in rows)
    table = "\n".join(map(line, rows))
    pictures = "\n".join(picture(item, folder) for item in figures)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>The seed paper, reproduced</title><style>{STYLE}</style></head>
<body><h1>The seed paper, reproduced</h1>
<p>Yokoyama, Fushihara, Mukai, Fujinaga, Fujitani: Real-time hybrid test using multi-actuators to estimate response
control performance of RC frame structure, 17th World Conference on Earthquake Engineering (2020). Every number comes
from a recording of the emulated laboratories, sensor noise on, made by <code>rths reproduce</code>:
{passed} of {len(rows)} rows within their tolerance.</p>
<table><thead><tr><th>quantity</th><th>paper</th><th>computed</th><th>must be</th><th></th></tr></thead>
<tbody>{table}</tbody></table>
{pictures}
</body></html>
"""


def line(row: Row) -> str:
    """One row of the table."""
    verdict = '<span class="pass">pass</span>' if row.passed else '<span class="fail">fail</span>'
    note = f"<small>{html.escape(row.note)}</small>" if row.note else ""
    cells = [html.escape(text) for text in (row.paper, row.computed, row.wanted)]
    return (
        f"<tr><td>{html.escape(row.name)}{note}</td><td>{cells[0]}</td><td>{cells[1]}</td>"
        f"<td>{cells[2]}</td><td>{verdict}</td></tr>"
    )


def picture(item: Figure, folder: Path) -> str:
    """One figure with its caption."""
    data = base64.b64encode((folder / item.file).read_bytes()).decode()
    caption = html.escape(item.caption)
    image = f'<img alt="{caption}" src="data:image/png;base64,{data}">'
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"
