"""Into which segments the laboratory of the kind table divides an interval, from long ones to short ones.

A segment is long where the forces beyond the matrices are the same all over it, as `steady` says: most of a motion
slides one way. Where they are not, as at a reversal, `advance` goes on by shorter ones.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np

from laboratories.column.model import substeps
from laboratories.table.linear import BEHIND_LOOP
from laboratories.table.record import Whole
from models.friction import COULOMB
from models.registry import Array
from models.system import DamperEffects, TableEffects
from models.transfer_systems import delay

# Shortest segments of dry friction in a usual one: its jump at a reversal is met to 0.06 ms at an interval of 2 ms, and
# the stroke of the damper errs by a fifth of what it does with usual ones.
JUMPS = 4
KEPT = 64  # divisions of an interval


def levels(interval: float, table: TableEffects, damper: DamperEffects) -> tuple[int, ...]:
    """Into how many segments an interval (s) is divided, from the longest to the shortest."""
    usual = substeps(interval)
    bent = damper.asymmetry != 0.0 or damper.damping_exponent != 1.0 or damper.stiffening != 0.0
    law = table.learned or damper.learned or table.backlash_law == BEHIND_LOOP or bent
    if law or not (math.isinf(table.velocity_limit) and math.isinf(damper.second_frequency)):
        return (usual,)
    rubbing = [part for part in (table, damper) if part.friction]
    if rubbing and all(dry(part) for part in rubbing):
        return tuple(sorted({1, usual, JUMPS * usual}))
    if rubbing or table.backlash or damper.stop_stiffness:
        return tuple(sorted({1, usual}))
    return (1,)


def dry(part: TableEffects | DamperEffects) -> bool:
    """Whether a friction jumps at a reversal and has one size otherwise."""
    return part.friction_velocity <= COULOMB and part.friction_drop == 0.0 and part.presliding == 0.0


@lru_cache(maxsize=KEPT)
def divided(interval: float, dead: float, numbers: tuple[int, ...]) -> tuple[Array, int, Array, Whole]:
    """The segments of an interval (s) divided into each of some numbers, with the kink of a dead time (s) among them.

    They are kept, since most hypotheses of a diagnosis have the same ones, and must not be written to.

    Returns:
        Taps of the delayed command at the borders of the shortest segments, as `delay.split` gives them.
        Length of the history of commands.
        The different lengths of segments, s.
        (levels, borders, 2): from a border on, by level, the place of the segment's length, −1 for none, and its end.
    """
    levels = [delay.split(interval, dead, number) for number in numbers]
    whole = np.concatenate([segments.lengths for segments in levels])
    # equal ones differ by rounding only
    _, first, kinds = np.unique(np.round(whole, 12), return_index=True, return_inverse=True)
    shortest = borders(levels[-1])
    walk = np.full((len(numbers), len(shortest) - 1, 2), -1)
    kind = iter(kinds.tolist())
    for level, segments in enumerate(levels):
        places = [int(np.argmin(np.abs(shortest - border))) for border in borders(segments)]
        for begin, end in pairwise(places):
            walk[level, begin] = next(kind), end
    return levels[-1].taps, levels[-1].memory, whole[first], walk


def borders(segments: delay.DelaySegments) -> Array:
    """Borders of segments from the beginning of the interval, (m + 1,) s."""
    return np.concatenate([[0.0], np.cumsum(segments.lengths)])
