"""The picture of the closed loop: the messages and signals of one interval of the default test."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

EDGE, FILL = "#1d4f73", "#e8f1f8"
SIZE = 8.4, 4.15  # inches
EXTENT = (0.0, 11.2), (0.1, 5.6)  # of the coordinates below, across and up
TITLE, TEXT = 10, 8.5  # pt


class Box(NamedTuple):
    """A part of the test: its centre, width and height, its name and its task."""

    x: float
    y: float
    width: float
    height: float
    title: str
    does: str = ""


class Arrow(NamedTuple):
    """A connection of two parts: both ends, its label and the label's place, solid or dashed."""

    start: tuple[float, float]
    end: tuple[float, float]
    label: str = ""
    place: tuple[float, float] = (0.0, 0.0)
    dashed: bool = False


BOXES = (
    Box(0.95, 3.2, 1.7, 0.8, "ground motion"),
    Box(3.6, 3.2, 2.4, 1.1, "master", "integrates the\nnumerical substructure"),
    Box(9.0, 3.2, 2.4, 1.1, "slave", "follows the commands"),
    Box(3.6, 0.8, 2.4, 1.1, "laboratory A", "actuator and column"),
    Box(9.0, 0.8, 2.4, 1.1, "laboratory B", "shaking table and\nactive mass damper"),
    Box(6.3, 5.0, 2.4, 0.9, "recorder", "every sample, in MCAP"),
)
ARROWS = (
    Arrow((1.8, 3.2), (2.4, 3.2)),
    Arrow((4.8, 3.45), (7.8, 3.45), "command k: table motion,\nmotor force", (6.3, 3.77)),
    Arrow((7.8, 2.95), (4.8, 2.95), "feedback k: damper force", (6.3, 2.73)),
    Arrow((3.0, 2.65), (3.0, 1.35), "displacement", (2.2, 2.0)),
    Arrow((4.2, 1.35), (4.2, 2.65), "measured force", (5.1, 2.0)),
    Arrow((8.4, 2.65), (8.4, 1.35), "displacement", (7.6, 2.0)),
    Arrow((9.6, 1.35), (9.6, 2.65), "measured force", (10.5, 2.0)),
    Arrow((3.6, 3.75), (5.1, 4.85), dashed=True),
    Arrow((9.0, 3.75), (7.5, 4.85), dashed=True),
)
LINK = "zenoh, every 2 ms", (6.3, 3.2)


def draw(path: Path) -> None:
    """Write the picture as SVG, with its letters as outlines, so that every viewer shows the same."""
    import matplotlib as mpl

    from report.pictures.figure import figure

    canvas = figure(*SIZE)
    axes = canvas.subplots()
    axes.set_axis_off()
    axes.grid(visible=False)
    for box in BOXES:
        draw_box(axes, box)
    for arrow in ARROWS:
        draw_arrow(axes, arrow)
    text, place = LINK
    axes.text(*place, text, ha="center", va="center", fontsize=TEXT, style="italic")
    axes.set(xlim=EXTENT[0], ylim=EXTENT[1])
    with mpl.rc_context({"svg.hashsalt": "rths"}):
        canvas.savefig(path, metadata={"Date": None}, facecolor="white")


def draw_box(axes: Any, box: Box) -> None:
    """A box with its title above what it does."""
    from matplotlib.patches import FancyBboxPatch

    corner = box.x - box.width / 2, box.y - box.height / 2
    shape = "round,pad=0,rounding_size=0.08"
    axes.add_patch(FancyBboxPatch(corner, box.width, box.height, boxstyle=shape, fc=FILL, ec=EDGE))
    above, below = (0.25, 0.17) if box.does else (0.0, 0.0)
    axes.text(box.x, box.y + above, box.title, ha="center", va="center", fontsize=TITLE, weight="bold")
    axes.text(box.x, box.y - below, box.does, ha="center", va="center", fontsize=TEXT)


def draw_arrow(axes: Any, arrow: Arrow) -> None:
    """An arrow with its label."""
    line = {"arrowstyle": "-|>", "color": "#444", "linestyle": "--" if arrow.dashed else "-"}
    axes.annotate("", arrow.end, arrow.start, arrowprops=line | {"shrinkA": 0, "shrinkB": 0})
    axes.text(*arrow.place, arrow.label, ha="center", va="center", fontsize=TEXT)
