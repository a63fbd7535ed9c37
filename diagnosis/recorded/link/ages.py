"""Delay, jitter and loss of the link where the recording holds no time stamps, from the ages of the messages alone."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import gammaincc

from diagnosis.recorded.link.exchange import Index, Interval, LinkFinding, certainty
from models.registry import Array

# Share of old messages from which on the link delays or loses some of them; on a real clock a process that wakes late
# makes some messages old as well.
LEAST_OLD = 0.03
# Largest shape of a Gamma distribution of times that is jitter alone: its mean is 1.7 times its standard deviation.
# Beyond it most of the time is a delay.
SHAPED = 3.0
WORTH = 10.0  # gain in −2·log-likelihood that each further parameter must bring: by chance once in 600 times
DEPENDENT = 2.0  # factor on intervals, because neighbouring ticks often use the same message
BEND = 0.03  # step of the second differences, in logarithms of the parameters, that give their standard deviations


class Guess(NamedTuple):
    """Parameters of a network that explain the ages."""

    jitter: float  # s
    delay: float = 0.0  # s
    loss: float = 0.0
    burst: float = 1.0
    shape: float = 1.0  # of the jitter's Gamma distribution


# Places of a guess that are fitted, by the model that they make.
FREE = {
    "jitter": (0,),
    "shape": (0, 4),
    "delay": (0, 1),
    "loss": (0, 2, 3),
    "shape and loss": (0, 2, 3, 4),
    "all": (0, 1, 2, 3),
}


def scattered(ages: Index, interval: float) -> list[LinkFinding]:
    """Delay, jitter and loss from the ages alone; delay and loss only where the ages need them.

    A message of age a is in use where it has arrived and none of the a newer ones has. Each of these was lost, in runs,
    or takes longer than the j ticks since it was sent, which has the probability Q(shape, (j·dt − delay)·√shape/std) of
    a Gamma distribution, e^(−(j·dt − delay)/std) of an exponential one. Jitter of another shape stands before a delay
    beside jitter, from which ages hardly tell it.
    """
    counts = np.bincount(np.clip(ages, 0, None)).astype(np.float64) if ages.size else np.zeros(1)
    if counts[1:].sum() <= LEAST_OLD * counts.sum():
        return []
    fits = {name: fitted(counts, interval, places) for name, places in FREE.items()}

    def surprise(name: str) -> float:
        guess, cost, _ = fits[name]
        if guess.shape > SHAPED:
            return math.inf
        return cost + WORTH * (len(FREE[name]) + (guess.delay > 0.0))

    name = min(fits, key=surprise)
    best, _, errors = fits[name]
    text = (
        f"the age of messages scatters over {int(np.count_nonzero(counts))} ticks; "
        "there are no time stamps to tell it closer"
    )

    def told(place: int) -> tuple[float, Interval]:
        value, wide = best[place], math.exp(1.96 * DEPENDENT * min(float(errors[place]), 10.0))
        return value, (value / wide, value * wide)

    jitter = {"std": told(0)} | ({"shape": told(4)} if 4 in FREE[name] else {})
    found = [LinkFinding("link.jitter", jitter, text, certainty(1.0, DEPENDENT * errors[0]))]
    if 1 in FREE[name]:
        found.append(
            LinkFinding("link.delay", {"delay": told(1)}, text, certainty(1.0, DEPENDENT * errors[1]))
        )
    if 2 in FREE[name]:
        burst, (low, high) = told(3)
        values = {"probability": told(2), "burst": (burst, (max(low, 1.0), high))}
        found.append(LinkFinding("link.loss", values, text, certainty(1.0, DEPENDENT * errors[2])))
    return found


def unlikely(guess: Guess, counts: Array, interval: float) -> float:
    """−2·log-likelihood of the ages' counts."""
    waiting = np.clip(np.arange(counts.size) * interval - guess.delay, 0.0, None)
    late = gammaincc(guess.shape, waiting * math.sqrt(guess.shape) / guess.jitter).tolist()
    leave = 1.0 / guess.burst
    enter = min(leave * guess.loss / (1.0 - guess.loss), 1.0)
    lost, came, before = guess.loss, 1.0 - guess.loss, 1.0
    shares = []
    for share in late:
        came *= share  # sent and not yet arrived
        shares.append(max(before - lost - came, 1e-12))
        before = lost + came
        lost, came = lost * (1.0 - leave) + came * enter, lost * leave + came * (1.0 - enter)
    return -2.0 * float(counts @ np.log(shares))


def fitted(counts: Array, interval: float, places: tuple[int, ...]) -> tuple[Guess, float, Array]:
    """Most likely guess with some places free, its −2·log-likelihood, and the guess's relative standard deviations."""
    mean = float(counts @ np.arange(counts.size) / counts.sum()) * interval
    start = np.log([max(mean / 2.0, 0.2 * interval), max(mean / 2.0, 0.2 * interval), 0.01, 1.0, 1.5])

    def guess(x: Array) -> Guess:
        jitter, delay, loss, more, shape = (
            math.exp(min(max(float(x[places.index(place)]), -20.0), 5.0)) if place in places else known
            for place, known in enumerate((0.0, 0.0, 0.0, 0.0, 1.0))
        )
        return Guess(jitter, delay, min(loss, 0.9), 1.0 + more, shape)

    def cost(x: Array) -> float:
        return unlikely(guess(x), counts, interval)

    options = {"xatol": 1e-5, "fatol": 1e-5, "maxiter": 3000, "maxfev": 3000}
    found = minimize(cost, start[list(places)], method="Nelder-Mead", options=options)
    errors = np.zeros(len(Guess._fields))
    for place, axis in zip(places, BEND * np.eye(len(places)), strict=True):
        bend = (cost(found.x + axis) - 2.0 * found.fun + cost(found.x - axis)) / BEND**2
        errors[place] = math.sqrt(2.0 / max(bend, 1e-3))
    return guess(found.x), float(found.fun), errors
