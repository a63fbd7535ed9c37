"""The style of all figures: legible in print at one column's width, in colours that are distinct for every reader.

Widths are those of a journal's page: columns are 84 to 90 mm wide (Elsevier 90 mm, Springer 84 mm, ASCE 89 mm), a page
174 to 190 mm. Text is drawn at the size at which it is read, 8 pt and 7 pt: Elsevier's artwork sizing asks for 7 pt in
print, and no superscript below 6 pt. In SVG files letters are saved as outlines, because another font on the reader's
machine would have other widths, and labels would overlap.
"""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

# the colours of Okabe and Ito's palette (2008) that stand out from white paper
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
REFERENCE = "0.35"  # grey of lines that are no measurement: bounds, nominal values

SINGLE, DOUBLE = 3.35, 7.0  # inches: 85 mm and 178 mm
TEXT, SMALL = 8, 7  # pt
PLAIN = (-9, 9)  # powers of ten within which axes show plain numbers and no common factor
DOTS = 300  # per inch of a saved picture
STAMPS: dict[str, dict[str, Any]] = {
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None},
    ".png": {},
}  # metadata by format, without the time: equal pictures are equal files


def style() -> dict[str, Any]:
    """The settings of the drawing library for every figure."""
    from cycler import cycler

    return {
        "axes.prop_cycle": cycler(color=COLOURS),
        "axes.grid": True,
        "axes.formatter.useoffset": False,
        "axes.formatter.limits": PLAIN,
        "grid.alpha": 0.3,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.linewidth": 0.6,
        "xtick.major.width": 0.6,
        "ytick.major.width": 0.6,
        "font.size": TEXT,
        "xtick.labelsize": SMALL,
        "ytick.labelsize": SMALL,
        "legend.fontsize": SMALL,
        "legend.title_fontsize": SMALL,
        "lines.linewidth": 1.0,
        "savefig.dpi": 150,
        "legend.frameon": False,
        "svg.hashsalt": "rths",
        "svg.fonttype": "path",
        "pdf.fonttype": 42,
    }


def figure(width: float = DOUBLE, height: float = 6.0) -> Any:
    """An empty figure of `width` by `height` inches."""
    import matplotlib as mpl

    mpl.use("Agg")
    settings: Any = mpl.rcParams
    settings.update(style())
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def fit_labels(canvas: Any) -> bool:
    """Place the axes of a figure, and break labels that its edge would cut off into lines; whether there are any."""
    canvas.get_layout_engine().execute(canvas)
    found = False
    for axis in canvas.axes:
        for label, size in ((axis.xaxis.label, canvas.bbox.width), (axis.yaxis.label, canvas.bbox.height)):
            box = label.get_window_extent()
            begin, end = (box.x0, box.x1) if label is axis.xaxis.label else (box.y0, box.y1)
            words = label.get_text()
            if begin < 0.0 or end > size:
                middle = 0.5 * (begin + end)
                room = 2.0 * min(middle, size - middle)
                letters = max(int(0.85 * len(words) * room / (end - begin)), 8)
                label.set_text("\n".join(textwrap.wrap(words, letters)))
                found = True
    return found


def save(canvas: Any, path: Path) -> None:
    """Write a figure for print, in the format of the file's ending; raises OSError."""
    fit_labels(canvas)
    canvas.savefig(path, dpi=DOTS, metadata=STAMPS[path.suffix.lower()])
