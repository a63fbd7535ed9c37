"""A link plug-in that delays, scatters and loses messages; each direction alike, with draws of its own.

A message's extra delay is `max(delay + n, 0)` with n normal. Losses follow the two-state chain of Gilbert (Bell Syst.
Tech. J. 39 (1960) 1253): a run of lost messages is `burst` long on average, and the stationary share of lost ones
is `loss`.
"""

from __future__ import annotations

import numpy as np

DIRECTIONS = {"command": 1, "feedback": 2}
DRAWN = 1024  # messages drawn at once


class ImpairedLink:
    """One laboratory's view of the network; messages are asked for in the order of their numbers."""

    def __init__(
        self, seed: int, delay: float = 0.0, jitter: float = 0.0, loss: float = 0.0, burst: float = 1.0
    ) -> None:
        self._delay, self._jitter = delay, jitter
        leaving = 1.0 / max(burst, 1.0)
        self._stay = 1.0 - leaving
        self._enter = min(1.0, loss * leaving / (1.0 - loss)) if loss < 1.0 else 1.0
        self._seed = seed
        self._streams: dict[str, Stream] = {}

    def fate(self, direction: str, seq: int, t: float) -> float | None:
        """Seconds of extra delay of a message sent at test time `t`, None for lost."""
        stream = self._streams.get(direction)
        if stream is None:
            stream = self._streams[direction] = Stream(self._seed, DIRECTIONS[direction])
        chance, scatter = stream.draw()
        stream.lost = chance < (self._stay if stream.lost else self._enter)
        return None if stream.lost else max(self._delay + self._jitter * scatter, 0.0)


class Stream:
    """The draws of one direction."""

    def __init__(self, seed: int, direction: int) -> None:
        self._generator = np.random.default_rng([seed, direction])
        self._drawn: list[tuple[float, float]] = []
        self.lost = False

    def draw(self) -> tuple[float, float]:
        """A uniform and a normal number."""
        if not self._drawn:
            chances = self._generator.random(DRAWN).tolist()
            scatters = self._generator.standard_normal(DRAWN).tolist()
            self._drawn = list(zip(chances, scatters, strict=True))[::-1]
        return self._drawn.pop()
