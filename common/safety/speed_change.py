"""A change of velocity with bounded acceleration and jerk (S-curve), in closed form."""

from __future__ import annotations

from math import copysign, sqrt


class SpeedChange:
    """From velocity `before` to `after` (m/s), with zero acceleration at both ends.

    The profile has constant jerk, constant acceleration, and constant jerk back. The bound `acceleration` (m/s²) is
    reached if the change is large enough, the bound `jerk` (m/s³) always.
    """

    def __init__(self, before: float, after: float, acceleration: float, jerk: float) -> None:
        change = abs(after - before)
        peak = min(acceleration, sqrt(change * jerk))
        self._before, self._after = before, after
        self._jerk = copysign(jerk, after - before)
        self._rise = peak / jerk
        self._flat = change / peak - self._rise if peak > 0.0 else 0.0
        self.duration = 2.0 * self._rise + self._flat
        self._whole = 0.5 * (before + after) * self.duration  # the profile is symmetric

    def travel(self, t: float) -> float:
        """The displacement (m) at the time t (s) after the beginning."""
        if t >= self.duration:
            return self._whole + (self._after * (t - self.duration) if self._after else 0.0)
        if t > self._rise + self._flat:  # computed backwards from the end
            left = self.duration - t
            return self._whole - self._after * left + self._jerk * left**3 / 6.0
        first = min(t, self._rise)
        second = t - first
        speed = self._before + 0.5 * self._jerk * first**2
        peak = self._jerk * first
        return self._before * first + self._jerk * first**3 / 6.0 + speed * second + 0.5 * peak * second**2
