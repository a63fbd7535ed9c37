"""The rig as a diagram: parts and paths, coloured by their share of the gap."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any, NamedTuple

from report.gap import wording
from report.text.formats import as_float, known, percent

WIDTH, HEIGHT = 480, 352
HALF_WIDTH, HALF_HEIGHT = 50, 27
ACCENT = "#D55E00"
STRONGEST = 0.7  # opacity of a site that holds the whole gap; text stays readable on it
FONTS = {
    "part": 'font-size="15"',
    "share": 'font-size="14" font-weight="700"',
    "note": 'font-size="12.5"',
}


class Sensor(NamedTuple):
    """A reading on the diagram; its label stands at `anchor` of the point beside the circle."""

    x: int
    y: int
    label: str
    dx: int
    dy: int
    anchor: str


SITES = {
    "ground": (58, 44),
    "structure": (210, 44),
    "actuator": (424, 44),
    "column": (424, 158),
    "link": (210, 204),
    "table": (210, 304),
    "damper": (424, 304),
}
ARROWS = (
    ("M108 44 H156", "motion", 134, 36, "middle"),
    ("M260 44 H370", "command path", 315, 36, "middle"),
    ("M424 71 V127", "", 0, 0, "middle"),
    ("M374 158 H248 V75", "force path", 306, 150, "middle"),
    ("M190 71 V173", "commands", 182, 126, "end"),
    ("M218 177 V75", "", 0, 0, "middle"),
    ("M210 231 V273", "", 0, 0, "middle"),
    ("M260 304 H370", "", 0, 0, "middle"),
    ("M424 277 V214 H264", "damper force back", 342, 230, "middle"),
)
SENSORS = {
    "column_displacement": Sensor(424, 98, "displacement", -12, 4, "end"),
    "column_force": Sensor(374, 158, "force", -8, 20, "end"),
    "table_displacement": Sensor(160, 294, "displacement", -12, 4, "end"),
    "table_acceleration": Sensor(160, 316, "acceleration", -12, 4, "end"),
    "damper_stroke": Sensor(402, 331, "stroke", -8, 17, "middle"),
    "damper_force": Sensor(446, 331, "force", 6, 17, "middle"),
}


def rig(report: Mapping[str, Any]) -> str:
    """The diagram as inline SVG; text and lines take the page's colour."""
    shares = {str(item.get("site")): as_float(item.get("share")) for item in report.get("where") or []}
    parts = [arrow(*item) for item in ARROWS]
    parts += [box(name, shares.get(name)) for name in SITES]
    parts += [circle(name, shares.get(f"sensor.{name}")) for name in SENSORS]
    named = ", ".join(f"{wording.site(name)} {percent(share)}" for name, share in shares.items()) or "none"
    return (
        f'<svg class="rig" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="{html.escape(f"The rig; shares of the gap: {named}")}">'
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
        'orient="auto"><path d="M0 0 L8 4 L0 8 Z" fill="currentColor"/></marker></defs>'
        f"{''.join(parts)}</svg>"
    )


def opacity(share: float | None) -> float:
    """How strongly a site is coloured."""
    return STRONGEST * max(min(share, 1.0), 0.08) if share is not None and known(share) else 0.0


def arrow(path: str, label: str, x: int, y: int, anchor: str) -> str:
    """A path between two parts."""
    line = f'<path d="{path}" fill="none" stroke="currentColor" stroke-width="1.4" marker-end="url(#tip)"/>'
    return line + (text(x, y, label, anchor, "note") if label else "")


def box(name: str, share: float | None) -> str:
    """A part with its share."""
    x, y = SITES[name]
    shape = (
        f'<rect x="{x - HALF_WIDTH}" y="{y - HALF_HEIGHT}" width="{2 * HALF_WIDTH}" height="{2 * HALF_HEIGHT}" '
        f'rx="6" fill="{ACCENT}" fill-opacity="{opacity(share):.2f}" stroke="currentColor" '
        f'stroke-width="{2.2 if share is not None else 1.0}"/>'
    )
    if share is None:
        return shape + text(x, y + 5, name, "middle", "part")
    return shape + text(x, y - 3, name, "middle", "part") + text(x, y + 15, percent(share), "middle", "share")


def circle(name: str, share: float | None) -> str:
    """A sensor; one with a share of the gap is larger and says it."""
    item = SENSORS[name]
    radius = 4.5 if share is None else 8.0
    label = item.label if share is None else f"{item.label} {percent(share)}"
    return (
        f'<circle cx="{item.x}" cy="{item.y}" r="{radius}" style="fill: var(--back)"/>'
        f'<circle cx="{item.x}" cy="{item.y}" r="{radius}" fill="{ACCENT}" fill-opacity="{opacity(share):.2f}" '
        f'stroke="currentColor"/>'
        + text(item.x + item.dx, item.y + item.dy, label, item.anchor, "note" if share is None else "share")
    )


def text(x: int, y: int, words: str, anchor: str, style: str) -> str:
    """A label."""
    return (
        f'<text x="{x}" y="{y}" text-anchor="{anchor}" fill="currentColor" {FONTS[style]}>'
        f"{html.escape(words)}</text>"
    )
