"""Dead time on a command that is ramped from sample to sample, or held from one to the next.

The command reaches the value written at tick k−1 at t_k and moves linearly in between, so a command
delayed by any L is piecewise linear too, with one kink per interval where L is no multiple of it.
Splitting each interval at that kink (and, if wanted, into equal substeps) gives segments over which the
delayed command is a straight line: models that are linear propagate over them without any error.

A command that is held acts as a step at the tick it is written; delayed, it steps at the same borders.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from models.compiled import jit
from models.registry import Array


class DelaySegments(NamedTuple):
    """The segments of an interval, and the interpolation of the delayed command at each border."""

    lengths: Array  # (m,) s
    taps: Array  # (m + 1, 2): index into the history of written commands, and the weight of the older one
    memory: int  # length of that history


def split(interval: float, delay: float, substeps: int = 1, *, held: bool = False) -> DelaySegments:
    """Segments of one interval (s) for a dead time (s), with the borders of equal substeps among them.

    History index 0 is the command written at the present tick, reached at the interval's end. At the
    share θ of the interval the delayed command stands between history entries. Of a command that is `held`, the tap
    of a segment's end is that of the whole segment.
    """
    lag = delay / interval
    whole = math.floor(lag + ROUNDED)
    rest = lag - whole
    borders = {i / substeps for i in range(substeps + 1)}
    if rest > ROUNDED:
        borders.add(rest)
    shares = sorted(borders)
    if held:
        middles = [0.5 * (early + late) for early, late in pairwise(shares)]
        steps = [max(math.ceil(whole + (rest if rest > ROUNDED else 0.0) - share), 0) for share in middles]
        return DelaySegments(
            np.diff(shares) * interval, np.array([(index, 0.0) for index in (steps[0], *steps)]), whole + 3
        )
    places = [1.0 + lag - share for share in shares]
    if rest <= ROUNDED:
        places = [1.0 + whole - share for share in shares]
    taps = [(min(math.floor(place + 1e-12), whole + 1), place) for place in places]
    table = np.array([(index, max(place - index, 0.0)) for index, place in taps])
    return DelaySegments(np.diff(shares) * interval, table, whole + 3)


ROUNDED = 1e-9  # of an interval: a delay that differs by less from whole intervals counts as whole


@jit
def remember(history: Array, command: float) -> None:
    """Shift the history by one tick and put the newest command in front."""
    for i in range(history.size - 1, 0, -1):
        history[i] = history[i - 1]
    history[0] = command


@jit
def delayed(history: Array, taps: Array, border: int) -> float:
    """The delayed command at a segment's border, by linear interpolation, which is exact for ramps."""
    index = int(taps[border, 0])
    weight = taps[border, 1]
    if weight == 0.0:
        return history[index]
    return (1.0 - weight) * history[index] + weight * history[index + 1]
