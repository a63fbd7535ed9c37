"""Noise that comes in bursts: louder for some tenths of a second, whatever the part does.

Welding, a drive that switches, or a radio next to a cable makes noise of a sensor louder for a while. The level of the
highest frequencies, where no model of a part has errors, tells when. It is the median of those of its neighbours in
time, without its own, so that steady noise is likelier without it. What follows a motion is no burst: the error of a
clock that jitters and the chatter of a machine are louder in a while of much motion as well.
"""

from __future__ import annotations

import numpy as np

from diagnosis.signals.noise import growth
from models.registry import Array

WINDOW = 0.3  # s whose median tells a level, so that impacts and tails do not
LEFT_OUT = 1  # mean sizes to either side that share differences with one, and tell nothing of it
NEIGHBOURS = 6  # mean sizes to either side at least
# Nats beyond steady noise from which on it comes in bursts, and the share of these that a law of one motion may tell.
# Of 440 readings behind loggers 19 had bursts, with 66 nats or more and a share of a third at most.
SURE, FOLLOWS = 20.0, 0.5
# Level of the loudest burst over that of most of the time: medians of steady noise come to 1.6 in half a minute, and
# that of readings that were moved in time by ever another part of a row changes by a fifth.
LOUDEST = 2.0


def bursting(noise: Array, motions: Array, size: int, interval: float) -> Array | None:
    """How loud noise is at every tick (ticks,), with a mean square of one; None where it has no bursts.

    Args:
        noise: (n,) of the first n ticks, with that of frequencies above 1/(2·size) of the ticks' rate left out.
        motions: (ticks, columns) that noise may follow, from their values at rest.
        size: ticks to be added up so that all frequencies left have noise.
        interval: s between ticks.
    """
    loud = growth.sizes(noise, size)
    if loud.size < growth.FEWEST or not np.median(loud) > growth.FLOOR * loud.mean():
        return None
    level = neighbouring(loud, round(0.5 * WINDOW / (interval * size * growth.TOGETHER)))
    if level.max() < LOUDEST * level.min():
        return None
    shape = 1.0 / float(np.var(loud / level))
    steady = growth.nats(loud, np.full(loud.size, loud.mean()), shape)
    more = growth.nats(loud, level, shape) - steady
    if more < SURE:
        return None
    for column in growth.rms(motions, size, loud.size).T:
        if np.ptp(column) > 0.0:
            law = growth.likeliest(loud, column)
            if growth.nats(loud, law.level(column), shape) - steady > FOLLOWS * more:
                return None
    middles = (growth.HIGHEST // 2 + growth.TOGETHER * (np.arange(loud.size) + 0.5)) * size
    everywhere = np.interp(np.arange(len(motions)), middles, level)
    return np.asarray(everywhere / np.sqrt(np.mean(np.square(everywhere))))


def neighbouring(loud: Array, reach: int) -> Array:
    """The level (n,) by the medians of mean sizes (n,) up to `reach` away; that of most of them at least."""
    reach = min(max(reach, NEIGHBOURS), loud.size // 4)
    around = np.concatenate([loud[reach:0:-1], loud, loud[-2 : -reach - 2 : -1]])
    windows = np.lib.stride_tricks.sliding_window_view(around, 2 * reach + 1)
    others = np.delete(windows, np.arange(reach - LEFT_OUT, reach + LEFT_OUT + 1), axis=1)
    level = np.maximum(np.median(others, axis=1), np.median(loud))
    return np.asarray(level * np.mean(loud / level))
