"""White noise of the sensors: the same draws whether read one by one or all at once."""

from __future__ import annotations

import numpy as np

from models.registry import Array

LAB_A, LAB_B = 1, 2
BLOCK = 1024  # rows drawn at once, so that a reading costs a list's pop


def lab_seed(seed: int, lab: int) -> int:
    """Seed of one laboratory under the seed of a plan or of a reality."""
    return int(np.random.SeedSequence([seed, lab]).generate_state(1)[0])


class Noise:
    """The noise of one laboratory's readings, tick by tick or all at once: the same draws either way."""

    def __init__(self, seed: int, levels: Array) -> None:
        self._generator = np.random.default_rng(seed)
        self._levels = levels
        self._block: list[list[float]] = []

    def rows(self, ticks: int) -> Array:
        """The next `ticks` rows, one column per reading."""
        return self._generator.standard_normal((ticks, self._levels.size)) * self._levels

    def row(self) -> list[float]:
        """The next row."""
        if not self._block:
            self._block = self.rows(BLOCK).tolist()[::-1]
        return self._block.pop()
