"""The one style of figures: legible in print at one column's width, in colours that everybody can tell apart."""

from __future__ import annotations

from typing import Any

# Okabe and Ito's palette
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


def figure(width: float = 7.0, height: float = 6.0) -> Any:
    """An empty figure of `width` by `height` inches."""
    import matplotlib as mpl
    from cycler import cycler

    mpl.use("Agg")
    mpl.rcParams.update(
        {
            "axes.prop_cycle": cycler(color=COLOURS),
            "axes.grid": True,
            "grid.alpha": 0.3,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "font.size": 8,
            "lines.linewidth": 1.0,
            "savefig.dpi": 150,
            "legend.frameon": False,
        }
    )
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")
