"""A link plug-in that delays and loses messages at random; both directions alike, each with random draws of its own.

    extra delay of a message = delay + g,    g ~ Gamma(jitter_shape, jitter/√jitter_shape)

so that `delay` is the smallest extra delay, and of what is more `jitter` is the standard deviation and
jitter·√jitter_shape the mean. The Gamma distribution of shape one is the exponential distribution: most messages come
soon and some late, as with queues. One of shape two is nearly half of a normal distribution. Messages may overtake each
other.

Losses follow the two-state chain of Gilbert (Bell Syst. Tech. J. 39 (1960) 1253-1265), every message lost in its bad
state and none in the good one: the share `loss` of all messages is lost, in runs of `burst` on average. A run cannot
be shorter than loss/(1 − loss), where every message between two runs stands alone.
"""

from __future__ import annotations

import math

import numpy as np

from common.errors import InputError

DIRECTIONS = {"command": 1, "feedback": 2}
DRAWN = 256  # messages drawn at once: some ten microseconds


class ImpairedLink:
    """The network of a test; the delay or loss of a message depends on seed, direction and number alone.

    The catalogue's effects on the link are meant to be diagnosed, so the watchdogs judge the real link instead.
    """

    watched = False

    def __init__(
        self,
        seed: int,
        delay: float = 0.0,
        jitter: float = 0.0,
        loss: float = 0.0,
        burst: float = 1.0,
        jitter_shape: float = 1.0,
    ) -> None:
        if not (0.0 <= delay < np.inf and 0.0 <= jitter < np.inf):
            raise InputError(
                f"delay is {delay} s and jitter {jitter} s, but both must be at least 0 and finite."
            )
        if not (0.0 <= loss < 1.0 and 1.0 <= burst < np.inf):
            raise InputError(f"loss is {loss} and burst {burst}, but must be in [0, 1) and at least 1.")
        if not 0.0 < jitter_shape < np.inf:
            raise InputError(f"jitter_shape is {jitter_shape}, but must be above 0 and finite.")
        self._delay, self._jitter = delay, jitter
        self._streams = {
            direction: Losses(np.random.default_rng([seed, number]), loss, burst, jitter_shape)
            for direction, number in DIRECTIONS.items()
        }
        self._fates: dict[str, list[float | None]] = {direction: [] for direction in DIRECTIONS}

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        """Extra delay (s) of the message of tick `seq`; None if it is lost. The test time `t` is not used."""
        fates = self._fates[direction]
        while len(fates) <= seq:
            lost, scatter = self._streams[direction].draw()
            delays = (self._delay + self._jitter * scatter).tolist()
            fates += [None if gone else extra for gone, extra in zip(lost, delays, strict=True)]
        return fates[seq]


class Losses:
    """The draws of one direction."""

    def __init__(self, generator: np.random.Generator, loss: float, burst: float, shape: float) -> None:
        self._generator, self._shape = generator, shape
        leave = 1.0 / max(burst, loss / (1.0 - loss))
        self._stay = 1.0 - leave
        self._enter = leave * loss / (1.0 - loss)
        self._lost = bool(generator.random() < loss)

    def draw(self) -> tuple[list[bool], np.ndarray[tuple[int], np.dtype[np.float64]]]:
        """Whether each of the next `DRAWN` messages is lost, and their random delays, of deviation one."""
        lost = []
        for chance in self._generator.random(DRAWN).tolist():
            lost.append(self._lost)
            self._lost = chance < (self._stay if self._lost else self._enter)
        if self._shape == 1.0:
            return lost, self._generator.standard_exponential(DRAWN)
        return lost, self._generator.standard_gamma(self._shape, DRAWN) / math.sqrt(self._shape)
