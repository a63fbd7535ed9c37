"""The earthquake's time of a test that an operator may hold: its value at every tick, and its rate.

It is counted in control intervals from the start of the motion, and at full rate passes one of them per tick. A hold
slows it down to standstill over a ramp of `ramp` ticks and a resumption speeds it up over as many, along the curve

    rate = 1 − 3u² + 2u³,  u = ticks since the order / ramp

whose first derivative is zero at both ends. Each ramp passes exactly ramp/2 intervals, a whole number because the ramp
is even, so that before, during and after a hold the motion is computed for the same times as without it.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple


class EarthquakePace(Enum):
    """How the earthquake's time passes."""

    __hash__ = object.__hash__

    FULL = "full"
    SLOWING = "slowing"
    HELD = "held"
    RESUMING = "resuming"


class Passing(NamedTuple):
    """The earthquake's time at a tick."""

    place: float  # control intervals since the start of the motion
    rate: float  # intervals per tick
    change: float  # of the rate, per tick
    bend: float  # of that change, per tick


class EarthquakeTime:
    """The earthquake's time of one test; `ramp` is the even number of ticks of a ramp of its rate."""

    def __init__(self, ramp: int) -> None:
        self.ramp = ramp
        self.behind = 0  # ticks that the holds before the present one have added to the test
        self.begun: int | None = None  # tick of the order to hold that is in force
        self.resumed: int | None = None  # tick at which it speeds up again

    def hold(self, tick: int) -> None:
        """Slow down from a tick on; the pace must be full."""
        self.settle(tick)
        self.begun = tick

    def resume(self, tick: int) -> None:
        """Speed up from a tick on, or from standstill on where the tick is before it; a hold must be in force."""
        assert self.begun is not None  # noqa: S101 - the caller asks `pace` first
        self.resumed = max(tick, self.begun + self.ramp)

    def pace(self, tick: int) -> EarthquakePace:
        """How the time passes in the interval after a tick."""
        if self.begun is None or self._over(tick):
            return EarthquakePace.FULL
        if tick < self.begun + self.ramp:
            return EarthquakePace.SLOWING
        return EarthquakePace.HELD if self.resumed is None or tick < self.resumed else EarthquakePace.RESUMING

    def settle(self, tick: int) -> bool:
        """Forget a hold that is over at a tick; return whether the pace is full."""
        if self.begun is not None and self.resumed is not None and self._over(tick):
            self.behind += self.resumed - self.begun
            self.begun = self.resumed = None
        return self.begun is None

    def _over(self, tick: int) -> bool:
        return self.resumed is not None and tick >= self.resumed + self.ramp

    def at(self, tick: int) -> Passing:
        """The time at a tick, from the order of the present hold on."""
        if self.begun is None or tick <= self.begun:
            return Passing(float(tick - self.behind), 1.0, 0.0, 0.0)
        first = self.begun - self.behind
        if self.resumed is None or tick <= self.resumed:
            if tick > self.begun + self.ramp:
                return Passing(first + 0.5 * self.ramp, 0.0, 0.0, 0.0)
            slow = slowed(tick - self.begun, self.ramp)
            return slow._replace(place=first + slow.place)
        left = self.resumed + self.ramp - tick
        if left <= 0:
            return Passing(float(tick - self.behind - (self.resumed - self.begun)), 1.0, 0.0, 0.0)
        whole, rest = first + self.ramp, slowed(left, self.ramp)
        return Passing(whole - rest.place, rest.rate, -rest.change, rest.bend)

    def added(self, tick: int) -> int:
        """Ticks that holds add to the test, if the one in force at a tick ends as early as it can."""
        if self.begun is None:
            return self.behind
        resumed = self.resumed if self.resumed is not None else max(tick, self.begun + self.ramp)
        return self.behind + resumed - self.begun


def slowed(ticks: int, ramp: int) -> Passing:
    """The time that has passed `ticks` after the order to hold, at most the ramp."""
    u = ticks / ramp
    return Passing(
        ticks - ramp * (u**3 - 0.5 * u**4),
        1.0 - u * u * (3.0 - 2.0 * u),
        -6.0 * u * (1.0 - u) / ramp,
        -6.0 * (1.0 - 2.0 * u) / ramp**2,
    )
