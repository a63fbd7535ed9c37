"""The rig as a diagram: parts and paths, coloured by their share of the gap."""

from __future__ import annotations

from typing import Any, NamedTuple

from diagnosis.report.records import Report
from report.gap import wording
from report.text.formats import percent

STRONGEST = 0.7  # opacity of a site that holds the whole gap; text stays readable on it


class DrawnSensor(NamedTuple):
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
    "column_displacement": DrawnSensor(424, 98, "displacement", -12, 4, "end"),
    "column_force": DrawnSensor(374, 158, "force", -8, 20, "end"),
    "table_displacement": DrawnSensor(160, 294, "displacement", -12, 4, "end"),
    "table_acceleration": DrawnSensor(160, 316, "acceleration", -12, 4, "end"),
    "damper_stroke": DrawnSensor(402, 331, "stroke", -8, 17, "middle"),
    "damper_force": DrawnSensor(446, 331, "force", 6, 17, "middle"),
}


class Box(NamedTuple):
    """A part of the rig with its share of the gap, empty where it has none."""

    name: str
    x: int
    y: int
    share: str
    opacity: str


class Circle(NamedTuple):
    """A sensor; one with a share of the gap is larger and says it."""

    sensor: DrawnSensor
    share: str
    opacity: str


def rig(report: Report) -> dict[str, Any] | None:
    """What the template of the diagram takes; None for laboratories that the diagram does not have."""
    if not drawn(report):
        return None
    shares = {item.site: item.share for item in report.where}
    named = ", ".join(f"{wording.site(name)} {percent(share)}" for name, share in shares.items()) or "none"
    return {
        "said": f"The rig; shares of the gap: {named}",
        "arrows": ARROWS,
        "boxes": [
            Box(name, x, y, percent(shares[name]) if name in shares else "", opacity(shares.get(name)))
            for name, (x, y) in SITES.items()
        ],
        "circles": [
            Circle(sensor, percent(shares[site]) if site in shares else "", opacity(shares.get(site)))
            for site, sensor in ((f"sensor.{name}", item) for name, item in SENSORS.items())
        ],
    }


def drawn(report: Report) -> bool:
    """Whether the diagram has all sites and readings of a report."""
    sites = {*SITES, *(f"sensor.{name}" for name in SENSORS)}
    return (
        sites.issuperset(item.site for item in report.where) and SENSORS.keys() >= report.gap.signals.keys()
    )


def opacity(share: float | None) -> str:
    """How strongly a site is coloured."""
    return f"{STRONGEST * max(min(share, 1.0), 0.08) if share is not None else 0.0:.2f}"
