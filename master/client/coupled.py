"""A laboratory of a client's element: its target from the element's displacement, the element's force from its own."""

from __future__ import annotations

from collections import deque

import numpy as np

from common.plan.plan import Plan
from laboratories import kinds
from laboratories.kind import Coupling, Follows
from models import force_correction


class CoupledLaboratory:
    """One laboratory of an element: converts the element's displacement into a target, and the force back."""

    def __init__(self, coupling: Coupling, interval: float, intervals: int) -> None:
        self.coupling = coupling
        self.sign = 1.0 if coupling.follows is Follows.DRIFT else -1.0  # OpenSees takes forces that resist
        self.target = 0.0
        self._interval, self._intervals = interval, intervals
        self._past: deque[float] = deque([0.0] * 3, maxlen=3)  # targets before the present one, newest first
        chosen = coupling.correction
        self._filter = force_correction.coefficients(chosen, interval)
        self._filtered = np.zeros(force_correction.CORRECTED + 1)
        self._delayed: float | None = 0.0 if chosen.unit_delay else None

    def follow(self, displacement: float) -> tuple[float, float, float, float, float]:
        """The target (m) for the end of the interval, the motor's force (N), and the target's rates (m/s, m/s², m/s³).

        Over one interval the first two rates are backward differences of second order, the third of first order. Over
        several intervals the motion is a ramp, of which only the velocity is not zero.
        """
        target, h = self.coupling.ratio * displacement, self._interval
        x1, x2, x3 = self._past
        velocity, acceleration, jerk = (target - self.target) / h, 0.0, 0.0
        if self._intervals == 1:
            x0, x1, x2, x3 = target, self.target, x1, x2
            velocity = (3.0 * x0 - 4.0 * x1 + x2) / (2.0 * h)
            acceleration = (2.0 * x0 - 5.0 * x1 + 4.0 * x2 - x3) / h**2
            jerk = (x0 - 3.0 * x1 + 3.0 * x2 - x3) / h**3
        self._past.appendleft(self.target)
        self.target = target
        effort = self.coupling.effort * velocity / self.coupling.ratio
        return target, effort, velocity, acceleration, jerk

    def resists(self, force: float) -> float:
        """The element's resisting force (N) from the measured force (N), with the plan's force correction."""
        corrected: float = force_correction.step(*self._filter, self._filtered, force)
        if self._delayed is not None:
            corrected, self._delayed = self._delayed, corrected
        return self.sign * self.coupling.scale * corrected


def couplings_of(plan: Plan) -> dict[str, Coupling]:
    """The coupling of every laboratory by role, in the order of an element's degrees of freedom."""
    return {role: kind.coupling(plan.of(role)) for role, kind in kinds.kinds_of(plan).items()}
