"""How pictures are laid out at either width, and what their axes have in common."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Any

from report.pictures.figure import DOUBLE, REFERENCE, SINGLE, SMALL, TEXT

MARGIN = 0.45  # inches of a figure's height for labels that panels below one another have only once
# Ratios of the ends of a logarithmic axis: below FEW, under two decades, ticks at 1, 2 and 5; above MANY powers of ten.
FEW, MANY = 60.0, 2e4
LINE = 1.25 * SMALL / 72.0  # inches, of the caption
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def wide(canvas: Any) -> bool:
    """Whether a figure spans more than one column."""
    return bool(canvas.get_figwidth() > 0.5 * (SINGLE + DOUBLE))


def shrink(canvas: Any, count: int, usual: int) -> None:
    """Reduce a figure's height by that of the panels that are missing."""
    height = canvas.get_figheight() - MARGIN
    canvas.set_figheight(MARGIN + height * count / usual)


def panels(canvas: Any, count: int, usual: int) -> Sequence[Any]:
    """Axes below one another in one column, beside one another on two."""
    if wide(canvas):
        return list(canvas.subplots(1, count, squeeze=False)[0])
    shrink(canvas, count, usual)
    return list(canvas.subplots(count, 1, squeeze=False)[:, 0])


def legend_above(axis: Any, columns: int = 2, **options: Any) -> Any:
    """A legend above the axis, where no curve runs."""
    return axis.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        borderpad=0.2,
        borderaxespad=0.1,
        labelspacing=0.3,
        columnspacing=1.0,
        **{"handlelength": 2.2} | options,
    )


def note(axis: Any, x: float, y: float, text: str) -> None:
    """Small text in a corner of an axis, in its fractions."""
    axis.text(
        x,
        y,
        text,
        transform=axis.transAxes,
        ha="left" if x < 0.5 else "right",
        va="bottom" if y < 0.5 else "top",
        fontsize=SMALL,
        linespacing=1.3,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
    )


def decades(axis: Any) -> None:
    """Numbers along a logarithmic axis (`axis.xaxis`): powers of ten over many decades, plain over few.

    The drawing library's own powers are text of 5 pt.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    ratio = high / low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if ratio < FEW else (1.0,), numticks=9))
    written = power if ratio > MANY else plain
    axis.set_major_formatter(FuncFormatter(lambda value, _place: written(value)))
    axis.set_minor_formatter(NullFormatter())


def plain(value: float) -> str:
    """A number without an exponent."""
    return f"{value:.10g}"


def power(value: float) -> str:
    """A power of ten."""
    return "10" + str(round(math.log10(value))).translate(SUPERSCRIPTS)


def bound(axis: Any, label: str, *, x: float | None = None, y: float | None = None) -> None:
    """A reference line, vertical at `x` or horizontal at `y`."""
    options = {"color": REFERENCE, "linewidth": 0.8, "label": label}
    if x is not None:
        axis.axvline(x, linestyle=(0, (1, 1)), **options)
    if y is not None:
        axis.axhline(y, linestyle=(0, (4, 2)), **options)


def caption(canvas: Any, text: str) -> Any:
    """Small text above a figure, whose height grows by it; the text is broken into lines that fit the width."""
    limit = canvas.bbox.width * 0.98
    longest = max(map(len, text.splitlines()), default=1)
    label = canvas.suptitle("", fontsize=SMALL, x=0.01, ha="left", parse_math=False)
    while True:
        label.set_text("\n".join(line for part in text.splitlines() for line in textwrap.wrap(part, longest)))
        width = label.get_window_extent().width
        if width <= limit or longest <= TEXT:
            break
        longest = min(longest - 1, int(longest * limit / width))
    canvas.set_figheight(canvas.get_figheight() + LINE * len(label.get_text().splitlines()))
    return label
