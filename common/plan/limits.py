"""Limits of a plan on commands and measurements: beyond one of them a laboratory stops its rig.

A limit trips, it never clamps. NaN is beyond any limit, and nothing else is beyond an infinite one.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter, le, ne
from types import MappingProxyType
from typing import Any, NamedTuple

from common.plan.tables import Limits

UNITS: dict[str, str] = {field.name: field.metadata["rule"].unit for field in dataclasses.fields(Limits)}

# intervals in a row by which an error must be beyond its limit: a message or two that is late makes one for a moment
PATIENCE = 3
# by so many times its nominal noise a command has moved: the reading must then differ beyond any doubt
TRAVEL = 10.0


NO_UNITS: Mapping[str, str] = MappingProxyType({})


class LimitViolation(NamedTuple):
    """A value beyond the limit of that name."""

    name: str
    value: float
    limit: float
    unit: str = ""  # of a limit that is none of the plan's own

    @property
    def values(self) -> dict[str, float]:
        """What is recorded with it."""
        return {self.name: self.value, "limit": self.limit}

    @property
    def sentence(self) -> str:
        """What was violated, by how much, in a sentence."""
        limit = f"{self.limit:g} {UNITS.get(self.name, self.unit)}".rstrip()
        return f"{self.name} is {self.value:.6g}, beyond its limit of {limit}."

    def __str__(self) -> str:
        return self.sentence


class Standstill(NamedTuple):
    """A sensor that has given one value so many times in a row."""

    channel: str
    value: float
    times: int
    name: str = "frozen"

    @property
    def values(self) -> dict[str, float]:
        """What is recorded with it."""
        return {self.channel: self.value, "readings": float(self.times)}

    def __str__(self) -> str:
        return (
            f"{self.channel} is frozen: {self.times} readings in a row of {self.value:.6g} while its rig moved; look "
            "at its cable and its driver, or set its noise in [sensors] to 0."
        )


def violated(limits: Mapping[str, float], **values: float) -> LimitViolation | None:
    """The first of some values, by the names of their limits, that is beyond its own."""
    for name, value in values.items():
        most = limits.get(name, math.inf)
        if not abs(value) <= most:
            return LimitViolation(name, value, most)
    return None


class Guard:
    """Checks values by their names; one name may stand for several. `units` are those of limits outside the plan."""

    def __init__(
        self,
        limits: Mapping[str, float],
        names: tuple[str, ...],
        units: Mapping[str, str] = NO_UNITS,
    ) -> None:
        limited = [place for place, name in enumerate(names) if name in limits]
        self._all = {place: limits[names[place]] for place in limited}
        twice = (*limited, *limited[:1])  # the first again: the getter of one place gives no tuple
        self._values: Callable[[Any], Any] = itemgetter(*twice) if twice else lambda _: ()
        self._most = [self._all[place] for place in twice]
        self._names, self._units = names, units

    def violation(self, values: Sequence[float]) -> LimitViolation | None:
        """The first value beyond its limit."""
        if all(map(le, map(abs, self._values(values)), self._most)):
            return None
        place = next(place for place, most in self._all.items() if not abs(values[place]) <= most)
        name = self._names[place]
        return LimitViolation(name, values[place], self._all[place], self._units.get(name, ""))


class Change:
    """Checks how a command differs from the last ones that were written to the rig.

    `step`, `velocity` and `acceleration` name the limits on the change within one `interval` (s), on that over
    the interval, and on the second difference over its square; an empty name stands for none. A rig begins at
    rest in its zero.
    """

    def __init__(
        self,
        limits: Mapping[str, float],
        interval: float,
        *,
        step: str,
        velocity: str = "",
        acceleration: str = "",
    ) -> None:
        self._limits, self._interval = limits, interval
        self._names = {"step": step, "velocity": velocity, "acceleration": acceleration}
        most = {kind: limits.get(name, math.inf) for kind, name in self._names.items()}
        self._reach = min(most["step"], most["velocity"] * interval)
        self._bend = most["acceleration"] * interval**2
        self._last = 0.0
        self._change = 0.0

    def violation(self, command: float) -> LimitViolation | None:
        """The first rate beyond its limit, should this command be written."""
        change = command - self._last
        bend = change - self._change
        if abs(change) <= self._reach and abs(bend) <= self._bend:
            return None
        rates = {
            "step": change,
            "velocity": change / self._interval,
            "acceleration": bend / self._interval**2,
        }
        named = {name: rates[kind] for kind, name in self._names.items() if name}
        return violated(self._limits, **named)

    def written(self, command: float) -> None:
        """The rig was given this command."""
        self._change = command - self._last
        self._last = command


class Lasting:
    """Checks an error that may be beyond the limit of its `name` for a moment, but not for `PATIENCE` intervals."""

    def __init__(self, limits: Mapping[str, float], name: str) -> None:
        self._name, self._most = name, limits.get(name, math.inf)
        self._beyond = 0

    def violation(self, error: float) -> LimitViolation | None:
        """The error of one more interval where it is beyond the limit for too long."""
        if abs(error) <= self._most:
            self._beyond = 0
            return None
        self._beyond += 1
        return LimitViolation(self._name, error, self._most) if self._beyond >= PATIENCE else None


class _Channel:
    """One sensor: the finest step that it has shown, and its present run of equal readings."""

    def __init__(self, name: str, noise: float) -> None:
        self.name, self.noise = name, noise
        self.step = math.inf if noise > 0.0 else -math.inf
        self.begin(math.nan, 0.0)

    def begin(self, reading: float, command: float) -> None:
        self.reading, self.same = reading, 1
        self.low = self.high = command

    def take(self, reading: float, command: float) -> None:
        if reading != self.reading:
            change = abs(reading - self.reading)
            # the change at the first reading is NaN and gives no step
            self.step = min(self.step, change) if change > 0.0 else self.step
            self.begin(reading, command)
            return
        self.same += 1
        self.low, self.high = min(self.low, command), max(self.high, command)

    @property
    def judged(self) -> bool:
        """Whether its steps are known to be finer than its noise, so that it does not repeat itself."""
        return 0.0 < self.step < self.noise


class Frozen:
    """Checks that the readings of one part of a rig go on to differ while its command moves.

    White noise makes each reading another one, wherever the sensor's steps are finer: equal neighbours then have a
    chance below 0.3. A channel without nominal noise, or one that has shown no such step, is not judged, as it may
    repeat itself honestly; nor is any while the command stays within `TRAVEL` times the noise of the channel `moved`,
    which reads what the command is about. `noise` are the nominal rms by channel, `count` is how many equal readings in
    a row are too many.
    """

    def __init__(self, noise: Mapping[str, float], names: tuple[str, ...], moved: str, count: int) -> None:
        self._channels = [_Channel(name, noise[name]) for name in names]
        self._count = count
        self._travel = TRAVEL * noise[moved]
        self._last: Sequence[float] = ()
        self._plain = False  # every channel is known, and none repeats itself

    def violation(self, readings: Sequence[float], command: float) -> Standstill | None:
        """The first channel that is frozen; `command` is the one in force over the interval just over."""
        last, self._last = self._last, readings
        if self._plain and all(map(ne, readings, last)):
            return None
        return self._look(readings, last, command)

    def _look(self, readings: Sequence[float], last: Sequence[float], command: float) -> Standstill | None:
        for channel, reading, before in zip(self._channels, readings, last or readings, strict=True):
            if self._plain:  # no command has moved it since
                channel.begin(before, command)
            channel.take(reading, command)
        self._plain = all(one.same == 1 and (one.judged or one.noise <= 0.0) for one in self._channels)
        for one in self._channels:
            if one.same >= self._count and one.judged and one.high - one.low > self._travel:
                return Standstill(one.name, one.reading, one.same)
        return None
