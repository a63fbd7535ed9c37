"""What is known of a sensor's noise: its rms and colour, where that was found, its lines and its resolution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from models.registry import Array

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
