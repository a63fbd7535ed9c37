"""How the transfer systems followed around the strongest motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from common.recording.run import Run
from report.pictures.curves import Pair, pairs
from report.pictures.layout import legend_above, shrink, wide
from report.text.formats import axis_scale


def draw(recording: Run, canvas: Any) -> bool:
    """Target and measurement of each transfer system and their difference; False where there is none."""
    present = pairs(recording)
    if not present:
        return False
    for (upper, lower), pair in zip(double_rows(canvas, len(present)), present, strict=True):
        follow(upper, lower, pair)
    canvas.align_ylabels()
    return True


def double_rows(canvas: Any, count: int) -> list[tuple[Any, Any]]:
    """For each system axes for the curves and, below, for their difference."""
    if wide(canvas):
        axes = canvas.subplots(2, count, squeeze=False)
        return [(axes[0, place], axes[1, place]) for place in range(count)]
    shrink(canvas, count, 2)
    rows = canvas.subplots(2 * count, 1)
    return [(rows[2 * place], rows[2 * place + 1]) for place in range(count)]


def follow(upper: Any, lower: Any, pair: Pair) -> None:
    """The seconds around the largest target."""
    part = pair.strongest()
    factor, unit = axis_scale(float(np.nanmax(np.abs([pair.wanted[part], pair.got[part]]))), "m")
    t, wanted, got = pair.t[part], factor * pair.wanted[part], factor * pair.got[part]
    upper.plot(t, wanted, label=pair.word)
    upper.plot(t, got, linestyle=(0, (4, 2)), label="measured")
    upper.set_ylabel(pair.label.replace(" ", "\n") + f", {unit}")
    legend_above(upper)
    lower.sharex(upper)
    of_error, unit = axis_scale(float(np.nanmax(np.abs(pair.error[part]))), "m")
    lower.plot(t, of_error * pair.error[part], linewidth=0.8)
    lower.set(xlabel="time, s", ylabel=f"measured\n− {pair.word}, {unit}")
    upper.tick_params(labelbottom=False)
