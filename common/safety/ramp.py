"""The ramp to rest: to a hold with bounded velocity, acceleration and jerk, then the specimen is unloaded.

The force is measured behind the transfer system's delay. If it opposes the unloading at the hold (its sign is not that
of the command), it may still be that of an earlier position. So the ramp then holds for `settle`, in which the transfer
system follows, and judges the force again: a specimen that has yielded may really push towards zero and stays loaded,
an elastic one is unloaded.
"""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import Any, Protocol

from common.plan.tables import SafetyTable
from common.safety.speed_change import SpeedChange

UNLOADED = 0.01  # of the force at the hold, at which the specimen counts as unloaded: the order of a load cell's error
STEPS = 5  # largest number of intervals beyond the profiles: one for each phase, and one for the last command
# Smallest velocity of unloading over the plan's: at the default of 10 mm/s a specimen whose way to zero takes less,
# some 0.7 µm at 2 ms, is not moved.
SLOWEST = 1 / 64


class Ramp(Protocol):
    """Commands that bring a rig to rest."""

    def step(self, measured: Any | None) -> tuple[float, ...]:
        """The command for the coming interval; `measured` are the rig's measurements, None where it gives none."""

    @property
    def done(self) -> bool:
        """Whether the commands are at rest."""

    @property
    def travel(self) -> float:
        """The distance between the largest and the smallest displacement command, m."""

    @property
    def left(self) -> float:
        """The longest remaining time, s."""

    def doing(self, measured: Any | None) -> str:
        """The present phase in words, with the force that is left by a measurement."""


class _Phase(Enum):
    """The phases of a ramp."""

    STOPPING = auto()
    HOLDING = auto()
    UNLOADING = auto()
    ENDING = auto()


class MotionRamp:
    """A displacement command from its position and velocity to a hold, and on until the specimen carries no force.

    Args:
        position: the last command written, m.
        velocity: its change per time, m/s.
        unload: whether the specimen is unloaded after the hold, by a motion towards zero until its force is gone.
    """

    def __init__(
        self, safety: SafetyTable, interval: float, position: float, velocity: float, *, unload: bool
    ) -> None:
        self._safety = safety
        self._interval = interval
        self._unload = unload
        self._held_force = self._slow = 0.0
        self.command = self._low = self._high = position
        self.done = False
        self._change(_Phase.STOPPING, velocity, 0.0)

    def step(self, force: float | None) -> float:
        """The command (m) for the end of the coming interval; `force` (N) of the specimen, None where it is unknown."""
        if self.done:
            return self.command
        self._t += self._interval
        self.command = self._from + self._profile.travel(self._t)
        self._low, self._high = min(self._low, self.command), max(self._high, self.command)
        if self._t >= self._profile.duration:
            self._next(force)
        return self.command

    @property
    def travel(self) -> float:
        """The distance between the largest and the smallest command since the ramp began, m."""
        return self._high - self._low

    @property
    def unloading(self) -> bool:
        """Whether the specimen is being unloaded."""
        return self._phase is _Phase.UNLOADING

    @property
    def holding(self) -> bool:
        """Whether the command is held until the transfer system has followed."""
        return self._phase is _Phase.HOLDING

    @property
    def left(self) -> float:
        """The longest remaining time, s, if no interval is missed."""
        if self.done:
            return 0.0
        seconds = max(self._profile.duration - self._t, 0.0) + STEPS * self._interval
        if self._phase is _Phase.STOPPING and self._unload:
            hold = self._from + self._profile.travel(math.inf)
            seconds += self._safety.settle + self._unloading_time(hold)
        elif self._phase is _Phase.HOLDING:
            seconds += max(self._safety.settle - self._t, 0.0) + self._unloading_time(self.command)
        elif self._phase is _Phase.UNLOADING:
            seconds += abs(self.command / self._slow) + self._change_time(self._slow)
        return seconds

    def _unloading_time(self, position: float) -> float:
        """Time from a hold to zero, s."""
        speed = abs(self._unloading_speed(position))
        return abs(position) / speed + 2.0 * self._change_time(speed) if speed else 0.0

    def _next(self, force: float | None) -> None:
        """Go to the next phase when the present one has reached its constant velocity."""
        if self._phase is _Phase.STOPPING and self._unload and force is not None:
            self._at_hold(force, last=False)
        elif self._phase is _Phase.HOLDING:
            if self._t >= self._safety.settle:
                self._at_hold(force or 0.0, last=True)
        elif self._phase is _Phase.UNLOADING:
            most = self._distance(self._slow) + abs(self._slow) * self._interval
            if force is None or self._free(force) or abs(self.command) <= most:
                self._change(_Phase.ENDING, self._slow, 0.0)
        else:
            self.done = True

    def _at_hold(self, force: float, *, last: bool) -> None:
        """Unload, or hold where the force opposes that, unless it did so already when it was judged `last`."""
        self._held_force = force
        speed = self._unloading_speed(self.command)
        if force * self.command > 0.0:
            self._slow = speed
            self._change(_Phase.UNLOADING if speed else _Phase.ENDING, 0.0, speed)
        else:
            self._change(_Phase.HOLDING if speed and not last else _Phase.ENDING, 0.0, 0.0)

    def _change(self, phase: _Phase, before: float, after: float) -> None:
        self._phase, self._from, self._t = phase, self.command, 0.0
        self._profile = SpeedChange(before, after, self._safety.acceleration, self._safety.jerk)

    def _unloading_speed(self, position: float) -> float:
        """Velocity towards zero that can be reached and left on the way there, m/s; 0 where the way is too short."""
        speed, way = self._safety.velocity, abs(position)
        while 2.0 * (self._distance(speed) + speed * self._interval) > way:
            speed /= 2.0
            if speed < SLOWEST * self._safety.velocity:
                return 0.0
        return math.copysign(speed, -position)

    def _distance(self, speed: float) -> float:
        """Distance from that speed to a halt, m."""
        return abs(SpeedChange(speed, 0.0, self._safety.acceleration, self._safety.jerk).travel(math.inf))

    def _change_time(self, speed: float) -> float:
        """Time from that speed to a halt, s."""
        return SpeedChange(speed, 0.0, self._safety.acceleration, self._safety.jerk).duration

    def _free(self, force: float) -> bool:
        return force * self._held_force <= UNLOADED * self._held_force**2


class ForceRelease:
    """The damper's motor force from its last command (N) to zero, in equal parts."""

    def __init__(self, safety: SafetyTable, interval: float, force: float) -> None:
        self._interval = interval
        self._left = max(math.ceil(safety.release / interval - 1e-9), 1)
        self._part = force / self._left
        self.command = force

    def step(self) -> float:
        """The force for the coming interval, N."""
        if self._left:
            self._left -= 1
            self.command = self._part * self._left + 0.0  # not minus zero
        return self.command

    @property
    def left(self) -> float:
        """The remaining time, s."""
        return self._left * self._interval

    @property
    def done(self) -> bool:
        """Whether the force is zero."""
        return self._left == 0
