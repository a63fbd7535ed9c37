"""White noise of the sensors."""

from __future__ import annotations

import numpy as np

from models.registry import Array

LAB_A, LAB_B = 1, 2
BLOCK = 1024  # rows drawn at once, two seconds of a test, so that a reading only takes the next row of a list


def lab_seed(seed: int, lab: int) -> int:
    """Seed of one laboratory under the seed of a plan or of a reality."""
    return int(np.random.SeedSequence([seed, lab]).generate_state(1)[0])


class Noise:
    """The noise of one laboratory's readings, which is the same whether it is drawn tick by tick or all at once."""

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
