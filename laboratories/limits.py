"""What a laboratory checks before its rig moves: what it read, and what it is about to write."""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter
from typing import Any, NamedTuple

from common.plan.limits import Change, Frozen, Guard, Lasting, LimitViolation, Standstill
from common.plan.plan import Plan
from common.signals import UNITS_OF_RATES
from laboratories.kind import Kind, Sensed


class SensorPart(NamedTuple):
    """Sensors of one part of a rig: which readings are theirs, and the command that moves them."""

    readings: Callable[[Any], Any]
    drive: int
    frozen: Frozen


def quantities(kind: Kind) -> dict[str, str]:
    """The units of what a kind of laboratory may limit, by name."""
    channels, limited = kind.channels, kind.limited
    found = {signal.name: signal.unit for signal in (*channels.driving, channels.command, *channels.measured)}
    found |= dict(zip(channels.rates, UNITS_OF_RATES, strict=True))
    found |= {limited.step: "m", limited.velocity: "m/s", limited.acceleration: "m/s²"}
    found |= {limited.effort_step: "N", limited.error: "m"}
    return {name: unit for name, unit in found.items() if name}


class LaboratoryLimits:
    """The limits of a kind's laboratory.

    Readings, commands and motion are asked for in every tick; `written` is told of every command that went to the rig.
    """

    def __init__(self, kind: Kind, plan: Plan) -> None:
        limits, channels, interval = kind.limits(plan), kind.channels, plan.test.interval
        limited, self._plan = kind.limited, plan
        noise = dict(zip(channels.names, kind.noise(plan).tolist(), strict=True))
        self._units = quantities(kind)
        self._measurements = Guard(limits, channels.names, units=self._units)
        self._commands = Guard(limits, channels.drives, units=self._units)
        self._changes = [
            Change(
                limits,
                interval,
                step=limited.step,
                velocity=limited.velocity,
                acceleration=limited.acceleration,
            ),
            *([Change(limits, interval, step=limited.effort_step)] if channels.effort else []),
        ]
        self._error = Lasting(limits, limited.error)
        self._position = channels.names.index(channels.position)
        self._parts = [self._part(sensed, channels.names, noise) for sensed in kind.sensed]
        self._wrote: tuple[float, ...] = (0.0,) * len(channels.drives)

    def _part(self, sensed: Sensed, names: tuple[str, ...], noise: dict[str, float]) -> SensorPart:
        first, *rest = (names.index(name) for name in sensed.channels)
        frozen = Frozen(noise, sensed.channels, sensed.moved, self._plan.safety.frozen_readings)
        picked = itemgetter(first, *rest) if rest else lambda measured: (measured[first],)
        return SensorPart(picked, int(sensed.by_effort), frozen)

    def readings(self, measured: tuple[float, ...]) -> LimitViolation | None:
        """The first reading beyond its limit."""
        return self._measurements.violation(measured)

    def commands(self, wanted: tuple[float, ...]) -> LimitViolation | None:
        """The first command beyond its limit."""
        return self._commands.violation(wanted)

    def motion(
        self, measured: tuple[float, ...], wanted: tuple[float, ...], target: float
    ) -> LimitViolation | Standstill | None:
        """The first change of a command beyond its limit, lasting error beside the `target`, or frozen sensor."""
        lasting = self._error.violation(target - measured[self._position])
        found: LimitViolation | Standstill | None = None
        for change, command in zip(self._changes, wanted, strict=True):
            found = found or change.violation(command)
        found = found or lasting
        for part in self._parts:  # each has to see every reading
            frozen = part.frozen.violation(part.readings(measured), self._wrote[part.drive])
            found = found or frozen
        return found._replace(unit=self._units[found.name]) if isinstance(found, LimitViolation) else found

    def written(self, command: tuple[float, ...]) -> None:
        """The rig was given this command."""
        self._wrote = command
        for change, value in zip(self._changes, command, strict=True):
            change.written(value)

    def standing(self, measured: tuple[float, ...]) -> str:
        """Why a rig at rest may not be reset, empty where all it reads is within its limits."""
        return str(self._measurements.violation(measured) or "")


class NoLimits:
    """The limits of a master without a laboratory of its own: nothing is read, and nothing moves."""

    def readings(self, _measured: tuple[float, ...]) -> None:
        """No reading."""

    def commands(self, _wanted: tuple[float, ...]) -> None:
        """No command."""

    def motion(self, _measured: tuple[float, ...], _wanted: tuple[float, ...], _target: float) -> None:
        """No motion."""

    def written(self, command: tuple[float, ...]) -> None:
        """Nothing to compare the next one with."""

    def standing(self, _measured: tuple[float, ...]) -> str:
        """Nothing stands against a reset."""
        return ""


def sent_guard(kind: Kind, plan: Plan) -> Guard:
    """The limits on what a laboratory of a kind is told at a tick: target, motor's force, the target's rates."""
    channels = kind.channels
    effort = channels.effort.name if channels.effort else ""
    return Guard(kind.limits(plan), (channels.target.name, effort, *channels.rates), units=quantities(kind))
