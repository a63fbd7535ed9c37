"""The ramp to rest: bounded velocity, acceleration and jerk to a hold, then the specimen is unloaded; never a step."""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import Any, Protocol

from common.plan.tables import SafetyTable
from common.safety.speed_change import SpeedChange

UNLOADED = 0.01  # of the force at the hold: below it the specimen counts as unloaded
STEPS = 4  # intervals at most in which a phase ends beside its profile: one each, and the last command
SLOWEST = 1 / 64  # of the ramp's velocity: a shorter way is not worth a movement


class Ramp(Protocol):
    """Commands that bring a rig to rest."""

    def step(self, measured: Any | None) -> tuple[float, ...]:
        """The command for the coming interval; `measured` is what the rig reads, None where it gives nothing."""

    @property
    def done(self) -> bool:
        """Whether the commands are at rest."""

    @property
    def travel(self) -> float:
        """How far apart the displacement commands have been, m."""

    @property
    def left(self) -> float:
        """How long it takes at most from here on, s."""

    def doing(self, measured: Any | None) -> str:
        """What it does, in words, with what is left by a measurement."""


class _Phase(Enum):
    """What the ramp is doing."""

    STOPPING = auto()
    UNLOADING = auto()
    ENDING = auto()


class MotionRamp:
    """A displacement command from where and how fast it is to a hold, and on to where the specimen carries no force.

    Args:
        position: the last command written, m.
        velocity: its change per time, m/s.
        unload: whether the specimen is unloaded after the hold: towards zero, until its force is gone.
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
        """The command for the end of the coming interval, m; `force` on the specimen, N, None where it is unknown."""
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
        """How far apart the commands have been since the ramp began, m."""
        return self._high - self._low

    @property
    def unloading(self) -> bool:
        """Whether the specimen is being unloaded."""
        return self._phase is _Phase.UNLOADING

    @property
    def left(self) -> float:
        """How long it takes at most from here on, s, where no interval is left out."""
        if self.done:
            return 0.0
        seconds = max(self._profile.duration - self._t, 0.0) + STEPS * self._interval
        if self._phase is _Phase.STOPPING and self._unload:
            seconds += self._unloading_time(self._from + self._profile.travel(math.inf))
        elif self._phase is _Phase.UNLOADING:
            seconds += abs(self.command / self._slow) + self._change_time(self._slow)
        return seconds

    def _unloading_time(self, position: float) -> float:
        """Time from a hold to zero without load, s."""
        speed = abs(self._unloading_speed(position))
        return abs(position) / speed + 2.0 * self._change_time(speed) if speed else 0.0

    def _next(self, force: float | None) -> None:
        """At a constant speed: unload after the hold, end the unloading in time, be done at the end."""
        if self._phase is _Phase.STOPPING and self._unload and force is not None:
            self._held_force = force
            loaded = force * self.command > 0.0  # where not, the way to zero does not take the force away
            self._slow = self._unloading_speed(self.command) if loaded else 0.0
            self._change(_Phase.UNLOADING if self._slow else _Phase.ENDING, 0.0, self._slow)
        elif self._phase is _Phase.UNLOADING:
            most = self._distance(self._slow) + abs(self._slow) * self._interval
            if force is None or self._free(force) or abs(self.command) <= most:
                self._change(_Phase.ENDING, self._slow, 0.0)
        else:
            self.done = True

    def _change(self, phase: _Phase, before: float, after: float) -> None:
        self._phase, self._from, self._t = phase, self.command, 0.0
        self._profile = SpeedChange(before, after, self._safety.acceleration, self._safety.jerk)

    def _unloading_speed(self, position: float) -> float:
        """Speed towards zero that can be reached and left on the way there, m/s; 0 where the way is too short."""
        speed, way = self._safety.velocity, abs(position)
        while 2.0 * (self._distance(speed) + speed * self._interval) > way:
            speed /= 2.0
            if speed < SLOWEST * self._safety.velocity:
                return 0.0
        return math.copysign(speed, -position)

    def _distance(self, speed: float) -> float:
        """Way from that speed to a halt, m."""
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
        """How long it takes from here on, s."""
        return self._left * self._interval

    @property
    def done(self) -> bool:
        """Whether the force is zero."""
        return self._left == 0
