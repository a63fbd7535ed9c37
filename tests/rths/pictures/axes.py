"""Checks of the axes of every figure on any page."""

from __future__ import annotations

import re
from typing import Any

TOLERANCE = 0.5  # of a pixel of the figure's own resolution


def check_axes(canvas: Any, name: str) -> None:
    """Fails where a text is cut off by the figure's edge, or numbers of an axis have a factor such as 1e-3 above it."""
    for text in texts(canvas):
        box = text.get_window_extent()
        inside = box.x0 >= -TOLERANCE and box.x1 <= canvas.bbox.x1 + TOLERANCE
        inside = inside and box.y0 >= -TOLERANCE and box.y1 <= canvas.bbox.y1 + TOLERANCE
        assert inside, f"{name}: {text.get_text()} {box} {canvas.bbox.size}"
    for axis in canvas.axes:
        for line in (axis.xaxis, axis.yaxis):
            assert line.get_offset_text().get_text() == "", f"{name}: {line.get_label_text()}"
            numbers = [label.get_text() for label in line.get_ticklabels()]
            assert not [text for text in numbers if re.search(r"\de[+−-]?\d", text)], f"{name}: {numbers}"


def texts(canvas: Any) -> list[Any]:
    """All visible text of a figure."""
    from matplotlib.text import Text

    found = [item for item in canvas.findobj(Text) if item.get_visible() and item.get_text()]
    unseen = {id(label) for axis in canvas.axes for label in hidden(axis)}
    return [item for item in found if id(item) not in unseen]


def hidden(axis: Any) -> list[Any]:
    """Labels of ticks beyond an axis' ends, which are never drawn."""
    ticks = [(axis.xaxis, tick) for tick in [*axis.xaxis.get_major_ticks(), *axis.xaxis.get_minor_ticks()]]
    ticks += [(axis.yaxis, tick) for tick in [*axis.yaxis.get_major_ticks(), *axis.yaxis.get_minor_ticks()]]
    beyond = []
    for line, tick in ticks:
        low, high = sorted(line.get_view_interval())
        if not low <= tick.get_loc() <= high:
            beyond += [tick.label1, tick.label2]
    return beyond
