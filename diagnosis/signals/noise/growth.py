"""Noise that grows with the reading: the louder the larger it is, from sample to sample anew.

A converter whose reference is noisy, a bridge with a noisy supply or a laser that measures by triangulation errs by a
share of what it reads beside a noise of its own. The level of the highest frequencies tells how it grows, as no model
of a part has errors there: that level is a straight line in the size of the reading, or the root of a sum of squares.
The maximum of the likelihood of sums of such sizes, which nearly have a gamma distribution, is found by Fisher's
scoring (P. McCullagh and J. A. Nelder, Generalized Linear Models, 1989, sections 2.5 and 8.3).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from models.registry import Array

HIGHEST = 4  # times that noise is differentiated, so that the bends of a motion are left out
TOGETHER = 5  # differences whose mean size counts as one, as neighbours are related
LAWS = (1, 2)  # powers of the size and of the level that are on a straight line
STEPS = 15
FLOOR = 0.02  # of the mean level, below which it is nowhere
# Nats beyond steady noise from which on it grows: in eight recordings behind loggers 32 readings with other noise had
# 4.5 at most, and 12 whose noise grew 3.4-fold had 46 or more.
SURE = 20.0
BEHIND = 2.0  # nats that another motion may be likelier by, so that the reading itself still counts
LOUDER = (
    1.2  # mean level where the reading is largest over that where it is smallest, below which nobody asks
)
FEWEST = 60  # mean sizes without which it cannot be told


class LevelBySize(NamedTuple):
    """A level that grows with a size: `(still**power + (slope·size)**power)**(1/power)`."""

    power: int
    still: float  # to that power
    slope: float  # to that power

    def level(self, size: Array) -> Array:
        """The level (n,) at sizes (n,)."""
        return np.asarray((self.still + self.slope * size**self.power) ** (1.0 / self.power))


def growing(noise: Array, reading: Array, others: Array, size: int) -> Array | None:
    """How loud noise is at every tick (ticks,), with a mean square of one; None where it does not grow.

    Args:
        noise: (ticks,), with that of frequencies above 1/(2·size) of the ticks' rate left out.
        reading: (ticks,) from its value at rest.
        others: (ticks, columns) other motions that noise may follow; it grows with none of them by itself.
        size: ticks to be added up so that all frequencies left have noise.
    """
    loud = sizes(noise, size)
    own = rms(reading[:, None], size, loud.size)[:, 0]
    if loud.size < FEWEST or not has_grown(loud, own):
        return None
    law = likeliest(loud, own)
    shape = 1.0 / float(np.var(loud / law.level(own)))
    if nats(loud, np.full(loud.size, loud.mean()), shape) + SURE > (
        best := nats(loud, law.level(own), shape)
    ):
        return None
    for column in rms(others, size, loud.size).T:
        if np.ptp(column) > 0.0 and has_grown(loud, column):
            other = likeliest(loud, column)
            if nats(loud, other.level(column), shape) > best + BEHIND:
                return None
    level = law.level(np.abs(reading))
    return np.asarray(level / np.sqrt(np.mean(np.square(level))))


def sizes(noise: Array, size: int) -> Array:
    """Mean sizes (n,) of the highest frequencies of noise (ticks,) up to 1/(2·size) of the ticks' rate."""
    count = len(noise) // size
    apart = np.abs(np.diff(noise[: count * size].reshape(count, size).sum(axis=1), n=HIGHEST))
    return np.asarray(apart[: apart.size // TOGETHER * TOGETHER].reshape(-1, TOGETHER).mean(axis=1))


def rms(motions: Array, size: int, count: int) -> Array:
    """Rms (count, columns) of motions (ticks, columns) where the differences of `sizes` are."""
    first = HIGHEST // 2 * size
    whole = motions[first : first + count * TOGETHER * size]
    return np.asarray(np.sqrt(np.mean(np.square(whole.reshape(count, -1, motions.shape[1])), axis=1)))


def has_grown(loud: Array, own: Array) -> bool:
    """Whether the mean level (n,) is higher where a motion is largest than where it is smallest."""
    low, high = np.quantile(own, (0.25, 0.9))
    return bool(loud[own >= high].mean() > LOUDER * loud[own <= low].mean())


def likeliest(loud: Array, own: Array) -> LevelBySize:
    """The likelier law of mean sizes (n,) over those of a motion (n,)."""
    laws = [fitted(loud, own, power) for power in LAWS]
    return max(laws, key=lambda law: nats(loud, law.level(own), 1.0))


def fitted(loud: Array, own: Array, power: int) -> LevelBySize:
    """The law of one power that is likeliest."""
    row = own**power
    least = (FLOOR * float(loud.mean())) ** power
    design = np.column_stack([np.ones_like(row), row])
    law = LevelBySize(
        power, max(least, 0.5 * float(np.mean(loud) ** power)), 0.5 * float(np.mean(loud**power) / row.mean())
    )
    for _ in range(STEPS):
        level = law.level(own)
        slopes = design * (level ** (1 - power) / power / level)[:, None]
        step = np.linalg.lstsq(slopes, loud / level - 1.0, rcond=None)[0]
        law = LevelBySize(power, max(law.still + float(step[0]), least), max(law.slope + float(step[1]), 0.0))
    return law


def nats(loud: Array, level: Array, shape: float) -> float:
    """Logarithm of the likelihood of sizes (n,) of a gamma distribution with these means, but for a constant."""
    return -shape * float(np.sum(np.log(level) + loud / level))
