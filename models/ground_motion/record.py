"""One component of a recorded ground motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

STANDARD_GRAVITY = 9.80665  # m/s²
GAL = 0.01  # m/s²


@dataclass(frozen=True, eq=False)
class GroundMotion:
    """Ground acceleration at equal intervals, the first sample at t = 0.

    `version` says which of the published digitisations or files of `name` this is: there are several of
    one earthquake, with different peaks. The acceleration is kept as a read-only copy.
    """

    name: str
    version: str
    interval: float  # s
    acceleration: NDArray[np.float64]  # (points,) m/s²

    def __post_init__(self) -> None:
        own = np.array(self.acceleration, dtype=np.float64)
        own.setflags(write=False)
        object.__setattr__(self, "acceleration", own)

    @property
    def points(self) -> int:
        """Number of samples."""
        return int(self.acceleration.size)

    @property
    def peak(self) -> float:
        """Largest absolute acceleration, m/s²."""
        return float(np.abs(self.acceleration).max())

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, s."""
        return (self.points - 1) * self.interval

    def describe(self) -> str:
        """One line for reports: name, version, interval, points and peak, the latter in standard gravities."""
        return (
            f"{self.name} ({self.version}), dt {self.interval:g} s, {self.points} points,"
            f" PGA {self.peak / STANDARD_GRAVITY:.4g} g"
        )

    def scaled(self, factor: float) -> GroundMotion:
        """The motion with its acceleration times `factor`; a factor other than 1 is noted in the version."""
        version = self.version if factor == 1.0 else f"{self.version}, scaled by {factor:g}"
        return replace(self, version=version, acceleration=factor * self.acceleration)
