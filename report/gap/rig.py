"""The rig as a diagram: the building, its laboratories and the paths between them, coloured by their share of the gap.

The building stands at the top left. The master's laboratory goes down on the right of it; the slave's lies below the
link. The sites and readings of both are those of their kinds, as the report names them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from common.roles import MASTER, title
from diagnosis.report.evidence import LaboratorySeen
from diagnosis.report.records import Report
from report.gap import wording
from report.text.formats import percent

STRONGEST = 0.7  # opacity of a site with the whole gap, on which black text can still be read
FAINTEST = 0.08  # share of the gap below which a colour could not be distinguished from the page
MOST_SITES = 2  # of a laboratory: the picture has room for two boxes, and no kind has more sites
WIDE, LOW = 352, 196  # height of the picture with a slave's laboratory and without one

GROUND, STRUCTURE, LINK = (58, 44), (210, 44), (210, 204)
OWN = ((424, 44), (424, 158))  # boxes of the master's laboratory
OTHER = ((210, 304), (424, 304))  # boxes of the slave's
BUILDING_ARROWS = (("M108 44 H156", "motion", 134, 36, "middle"),)
LINK_ARROWS = (
    ("M190 71 V173", "commands", 182, 126, "end"),
    ("M218 177 V75", "", 0, 0, "middle"),
    ("M210 231 V273", "", 0, 0, "middle"),
)
COMMAND = ("M260 44 H370", "command path", 315, 36, "middle")
FORCE_NOTE = ("force path", 306, 150, "middle")
BACK = "force back"


class Sensor(NamedTuple):
    """A reading on the diagram; its label stands at `anchor` of the point beside the circle."""

    x: int
    y: int
    label: str
    dx: int
    dy: int
    anchor: str


class Box(NamedTuple):
    """A part of the rig with its share of the gap, empty where it has none."""

    name: str
    x: int
    y: int
    share: str
    opacity: str


class Circle(NamedTuple):
    """A sensor; one with a share of the gap is larger and says it."""

    sensor: Sensor
    share: str
    opacity: str


def rig(report: Report) -> dict[str, Any] | None:
    """Values for the template of the diagram; None for a report that does not list the sites of its laboratories."""
    labs = report.details.laboratories
    if not labs or any(len(lab.sites) > MOST_SITES for lab in labs):
        return None
    shares = {item.site: item.share for item in report.where}
    named = ", ".join(f"{wording.site(name)} {percent(share)}" for name, share in shares.items()) or "none"
    own = next((lab for lab in labs if lab.role == MASTER), None)
    other = next((lab for lab in labs if lab.role != MASTER), None)
    places = {"ground": GROUND, "structure": STRUCTURE}
    places |= dict(zip(own.sites, OWN, strict=False)) if own else {}
    places |= {"link": LINK, **dict(zip(other.sites, OTHER, strict=False))} if other else {}
    sensors = (own_sensors(own) if own else {}) | (other_sensors(other) if other else {})
    return {
        "description": f"The rig; shares of the gap: {named}",
        "height": WIDE if other else LOW,
        "arrows": [*BUILDING_ARROWS, *own_arrows(own), *other_arrows(other)],
        "notes": [
            *([(f"at the {title(own.role)}", OWN[0][0], 12, "middle")] if own else []),
            *([(f"at the {title(other.role)}", OTHER[0][0], 347, "middle")] if other else []),
        ],
        "boxes": [
            Box(
                wording.placed(name)[0],
                x,
                y,
                percent(shares[name]) if name in shares else "",
                opacity(shares.get(name)),
            )
            for name, (x, y) in places.items()
        ],
        "circles": [
            Circle(sensor, percent(shares[site]) if site in shares else "", opacity(shares.get(site)))
            for site, sensor in sensors.items()
        ],
    }


def own_arrows(lab: LaboratorySeen | None) -> list[tuple[str, str, int, int, str]]:
    """Paths from the building through the master's laboratory and back."""
    if lab is None:
        return []
    if len(lab.sites) == 1:
        return [COMMAND, ("M424 71 V158 H248 V75", *FORCE_NOTE)]
    return [COMMAND, ("M424 71 V127", "", 0, 0, "middle"), ("M374 158 H248 V75", *FORCE_NOTE)]


def other_arrows(lab: LaboratorySeen | None) -> list[tuple[str, str, int, int, str]]:
    """Paths from the building over the link through the slave's laboratory and back."""
    if lab is None:
        return []
    if len(lab.sites) == 1:
        return [*LINK_ARROWS, ("M260 304 H342 V214 H264", BACK, 350, 262, "start")]
    return [
        *LINK_ARROWS,
        ("M260 304 H370", "", 0, 0, "middle"),
        ("M424 277 V214 H264", BACK, 342, 230, "middle"),
    ]


def own_sensors(lab: LaboratorySeen) -> dict[str, Sensor]:
    """Readings of the master's laboratory: the first half below its first box, the others where its force leaves."""
    first, last = halves(lab)
    x, y = OWN[0][0], 98
    found = {
        site: Sensor(x, y + 18 * place - 9 * (len(first) - 1), label, -12, 4, "end")
        for place, (site, label) in enumerate(first)
    }
    if len(last) == 1:
        return found | {site: Sensor(374, OWN[1][1], label, -8, 20, "end") for site, label in last}
    return found | below(last, OWN[1])


def other_sensors(lab: LaboratorySeen) -> dict[str, Sensor]:
    """Readings of the slave's laboratory: the first half on the left of its first box, the others below its last."""
    first, last = halves(lab)
    x, y = OTHER[0]
    found = {
        site: Sensor(x - 50, y + 22 * place - 11 * (len(first) - 1) + 1, label, -12, 4, "end")
        for place, (site, label) in enumerate(first)
    }
    if len(lab.sites) == 1:
        return found | {
            site: Sensor(x + 50, y + 22 * place - 11 * (len(last) - 1) + 1, label, 12, 16, "start")
            for place, (site, label) in enumerate(last)
        }
    return found | below(last, OTHER[1])


def below(readings: Sequence[tuple[str, str]], box: tuple[int, int]) -> dict[str, Sensor]:
    """Readings on the lower edge of a box, from the left to the right."""
    x, y = box
    spread = [place - (len(readings) - 1) / 2 for place in range(len(readings))]
    return {
        site: Sensor(round(x + 44 * far), y + 27, label, round(14 * far), 17, "middle")
        for far, (site, label) in zip(spread, readings, strict=True)
    }


def halves(lab: LaboratorySeen) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """The sites and short labels of a laboratory's readings, in two halves; the first is the larger one."""
    readings = [(name, name.rpartition("_")[2]) for name in lab.sensors]
    middle = (len(readings) + 1) // 2
    return readings[:middle], readings[middle:]


def opacity(share: float | None) -> str:
    """How strongly a site is coloured."""
    return f"{STRONGEST * max(min(share, 1.0), FAINTEST) if share is not None else 0.0:.2f}"
