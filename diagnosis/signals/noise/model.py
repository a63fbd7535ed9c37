"""What is known of a sensor's noise: its rms and colour, where that was found, its lines and its resolution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from diagnosis.signals.noise import colour
from models.registry import Array

WAVES = 8.0  # half waves that a record must hold of a frequency to tell how loud its noise is
# Times the lowest such frequency, and times the density there, by which noise is louder at that one if it goes on to
# become louder below it.
OCTAVES, RISING = 16.0, 2.0
Kind = Literal["white", "ar"]
Source = Literal["at rest", "quiet part", "residual"]


@dataclass(frozen=True)
class NoiseModel:
    """The noise of one sensor, as its averaged samples show it."""

    rms: float  # in the signal's unit, lines aside
    kind: Kind = "white"
    order: int = 0  # of the autoregression
    source: Source = "residual"
    lines: tuple[float, ...] = ()  # Hz, of what it picks up
    resolution: float = 0.0  # in the signal's unit, 0 for none
    density: Array | None = None  # over `colour.GRID`, in the signal's unit squared; None for white noise
    samples: float = math.inf  # averaged samples that its level was found from, infinite for the whole record
    tails: float = 1.0  # how much its energy varies more than that of normal noise
    steady: bool = False  # whether it is as loud where its part hardly moves as where it moves far more

    @property
    def unproven(self) -> bool:
        """Whether only a residual tells of its colour, and one that may follow the motion, as a gap does."""
        return self.density is not None and self.source == "residual" and not self.steady

    def at_most(self, density: Array) -> Array:
        """Its density (401,) over `colour.GRID`, at frequencies too low for its record at least another one's.

        It is so where its own becomes louder towards these, as that of pink noise does.
        """
        own, lowest = np.asarray(self.density), WAVES / self.samples
        rises = np.interp(lowest, colour.GRID, own) > RISING * np.interp(OCTAVES * lowest, colour.GRID, own)
        return np.where((lowest > colour.GRID) & rises, np.maximum(density, own), own)
