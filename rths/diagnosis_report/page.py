"""A diagnosis as one HTML page, readable without network, on a phone, in light and in dark."""

from __future__ import annotations

from pathlib import Path

from rths.diagnosis_report import how_far, limits, overview
from rths.diagnosis_report.blocks import esc
from rths.diagnosis_report.where import where
from rths.diagnosis_report.which import which
from rths.diagnosis_report.wording import Report

STYLE = """
:root { color-scheme: light dark; --back: #fff; --ink: #1c1f23; --soft: #59616b; --line: #d5d9de; --tint: #f3f5f7;
  --accent: #d55e00; --good: #00694b; --amber: #8a5a00; --purple: #8a3a6b; --curve: #0072b2; }
@media (prefers-color-scheme: dark) { :root { --back: #16181b; --ink: #e6e8ea; --soft: #a3abb5; --line: #3a3f46;
  --tint: #1f2226; --accent: #f08a3c; --good: #4cc9a0; --amber: #e6b04c; --purple: #e39cc4;
  --curve: #56b4e9; } }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 66rem; margin: 0 auto; padding: 1rem;
  color: var(--ink); background: var(--back); overflow-wrap: break-word; }
h1 { font-size: 1.5rem; margin: .5rem 0; } h2 { font-size: 1.2rem; margin: 2.2rem 0 .6rem; padding-top: .6rem;
  border-top: 1px solid var(--line); } h3 { font-size: 1rem; margin: 1.4rem 0 .4rem; }
h4 { font-size: 1rem; margin: 0; }
p { margin: .4rem 0; } small, .note, .facts, figcaption { font-size: 13px; color: var(--soft); }
.verdict { font-size: 1.15rem; line-height: 1.4; } .absent { color: var(--soft); font-style: italic; }
.warn { color: var(--amber); font-weight: 600; } small.block, figcaption small { display: block; }
.chip { font-size: .85rem; font-weight: 600; padding: .15rem .6rem; border-radius: 1rem; border: 1.5px solid;
  white-space: nowrap; vertical-align: middle; color: var(--soft); }
.chip.explained, .chip.no_gap { color: var(--good); } .chip.partly_explained, .chip.ambiguous { color: var(--amber); }
.chip.unknown_effect { color: var(--purple); }
.tiles { display: flex; flex-wrap: wrap; gap: .6rem; margin: .8rem 0; }
.tiles div { flex: 1 1 8.5rem; background: var(--tint); border-radius: 8px; padding: .5rem .8rem; }
.tiles dt { font-size: 13px; color: var(--soft); } .tiles dd { margin: 0; font-size: 1.15rem; font-weight: 600; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; font-size: 14px; margin: .4rem 0; }
th, td { text-align: left; vertical-align: top; padding: .3rem .9rem .3rem 0; border-bottom: 1px solid var(--line); }
th { font-weight: 600; color: var(--soft); font-size: 13px; } code { font-size: .88em; }
.bar { display: inline-block; width: 6rem; height: .7rem; background: var(--line); border-radius: 2px;
  margin-right: .5rem; } .bar i { display: block; height: 100%; background: var(--accent); border-radius: 2px; }
.number { white-space: nowrap; font-variant-numeric: tabular-nums; }
.beside, .gallery { display: flex; flex-wrap: wrap; gap: .5rem 2rem; align-items: flex-start; }
.beside > *, .gallery > * { flex: 1 1 21rem; min-width: 0; max-width: 31rem; }
.cards { display: flex; flex-wrap: wrap; gap: .8rem; }
.card { flex: 1 1 20rem; min-width: 0; border: 1px solid var(--line); border-radius: 8px; padding: .7rem .9rem; }
figure { margin: .8rem 0; break-inside: avoid; } figure svg { display: block; width: 100%; height: auto; }
.rig { font-family: system-ui, sans-serif; } .whole { white-space: nowrap; }
.glossary dt { font-weight: 600; } .glossary dd { margin: 0 0 .4rem; color: var(--soft); } li { margin: .2rem 0; }
@media (max-width: 30rem) { body { padding: .7rem; } .bar { width: 4rem; } }
@media print { body { max-width: none; } }
"""


def write(report: Report, path: Path) -> None:
    """Write the page."""
    path.write_text(page(report), encoding="utf-8")


def page(report: Report) -> str:
    """The page's text; pictures stand inside."""
    name = ((report.get("details") or {}).get("test") or {}).get("name")
    title = "Sim-to-real gap" + (f": {name}" if name else "")
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{esc(title)}</title><style>{STYLE}</style></head>
<body>
{overview.overview(report)}{overview.gap(report)}{where(report)}{which(report)}{how_far.how_far(report)}
{how_far.paths(report)}{how_far.tolerances(report)}{limits.equivalents(report)}{limits.not_exercised(report)}
{limits.next_test(report)}{limits.warnings(report)}{limits.how_to_read()}
</body></html>
"""
