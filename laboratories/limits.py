"""The limits of a laboratory at a tick, on its measurements and on the commands that it is about to write."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from common.plan.limits import UNITS, LimitViolation, Standstill
from common.plan.plan import Plan
from common.signals import UNITS_OF_RATES
from laboratories import checks
from laboratories.checks import FINE, NONE, Checks, Numbers
from laboratories.kind import Kind
from models.compiled import bound
from models.registry import Array


class Limit(NamedTuple):
    """The limit of a value, by name."""

    name: str
    most: float  # NONE for none
    unit: str = ""  # of a limit of a user's kind, which the plan's table of limits does not hold


def quantities(kind: Kind) -> dict[str, str]:
    """The units of the quantities that a kind of laboratory may limit, by name."""
    channels, moved = kind.channels, kind.limited
    found = {signal.name: signal.unit for signal in (*channels.driving, channels.command, *channels.measured)}
    found |= dict(zip(channels.rates, UNITS_OF_RATES, strict=True))
    found |= {moved.step: "m", moved.velocity: "m/s", moved.acceleration: "m/s²"}
    found |= {moved.effort_step: "N", moved.error: "m"}
    return {name: unit for name, unit in found.items() if name}


def limited(
    limits: Mapping[str, float], names: Iterable[str], units: Mapping[str, str] = UNITS
) -> list[Limit]:
    """The limits on the values of these names; a value without one is not checked."""
    return [Limit(name, limits.get(name, NONE), units.get(name, "")) for name in names]


def first_beyond(limits: Sequence[Limit], values: Sequence[float]) -> LimitViolation | None:
    """The first value that is beyond its limit, None where none is."""
    for limit, value in zip(limits, values, strict=True):
        if limit.most != NONE and not abs(value) <= limit.most:
            return LimitViolation(limit.name, value, limit.most, limit.unit)
    return None


def of_readings(kind: Kind, plan: Plan) -> list[Limit]:
    """The limits on the measurements of a kind's laboratory."""
    return limited(kind.limits(plan), kind.channels.names, quantities(kind))


def of_commands(kind: Kind, plan: Plan) -> list[Limit]:
    """The limits on the commands written to its rig."""
    return limited(kind.limits(plan), kind.channels.drives, quantities(kind))


def of_sent(kind: Kind, plan: Plan) -> list[Limit]:
    """The limits on the values sent to it at a tick: target, motor's force, the target's rates."""
    channels = kind.channels
    effort = channels.effort.name if channels.effort else ""
    return limited(kind.limits(plan), (channels.target.name, effort, *channels.rates), quantities(kind))


def of_changes(kind: Kind, plan: Plan) -> list[Limit]:
    """The limits on step, velocity and acceleration of each command, and on the lasting error of the position."""
    moved, limits, units = kind.limited, kind.limits(plan), quantities(kind)
    names = [moved.step, moved.velocity, moved.acceleration]
    names += [moved.effort_step, "", ""] if kind.channels.effort else []
    names.append(moved.error)
    return [Limit(name, limits.get(name, math.inf) if name else NONE, units.get(name, "")) for name in names]


class TickLimits:
    """All limits of a laboratory's tick; `kind` is None for a master without a laboratory.

    `values` are the limits on the values that `violation` takes, the measurements first; `commands` is the index of the
    first command among them. `written` must be called with every command that is written to the rig.
    """

    def __init__(self, kind: Kind | None, plan: Plan, values: Sequence[Limit], commands: int) -> None:
        self._limits = [*values, *(of_changes(kind, plan) if kind else [Limit("", NONE)])]
        self._readings = of_readings(kind, plan) if kind else []
        drives = len(kind.channels.drives) if kind else 0
        position = kind.channels.names.index(kind.channels.position) if kind else 0
        places = [commands, len(values), position, plan.safety.frozen_readings]
        watched, sensors, parts = watching(kind, plan)
        self._checks = Checks(
            np.stack([np.zeros(len(self._limits)), [limit.most for limit in self._limits]]),
            np.array(places),
            np.array([plan.test.interval, 0.0, *(0.0 for _ in range(parts))]),
            np.zeros((3, drives + 1)),
            watched,
            sensors,
        )
        self._look = bound(checks.enter, self._checks, 0.0)
        self._values, self._written = self._checks.values.data, self._checks.commands.data
        self._fill = struct.Struct(f"{len(values)}d").pack_into
        self._wrote = struct.Struct(f"{drives + 1}d").pack_into

    def violation(self, target: float, *values: float) -> LimitViolation | Standstill | None:
        """The first violation: of a value, of a command's change, of the lasting error, or a frozen sensor; else None.

        `target` (m) is the target of the position measured at the tick.
        """
        self._fill(self._values, 0, *values)
        place = self._look(target)
        return None if place == FINE else self._found(place)

    def _found(self, place: int) -> LimitViolation | Standstill:
        if place < len(self._limits):
            name, most, unit = self._limits[place]
            return LimitViolation(name, float(self._checks.values[checks.VALUE, place]), most, unit)
        sensor = place - len(self._limits)
        state, read = self._checks.sensors[sensor], self._checks.watched[sensor, checks.READ]
        return Standstill(self._readings[read].name, float(state[checks.READING]), int(state[checks.SAME]))

    def written(self, command: tuple[float, ...]) -> None:
        """Take note of a command that was written to the rig."""
        self._wrote(self._written, 0, *command, 1.0)

    def standing(self, measured: tuple[float, ...]) -> str:
        """Why a rig at rest may not be reset; empty where all measurements are within their limits."""
        return str(first_beyond(self._readings, measured) or "")


def watching(kind: Kind | None, plan: Plan) -> tuple[Numbers, Array, int]:
    """The sensors of a kind that are checked for frozen values, as `Checks` holds them, and the number of parts."""
    if kind is None:
        return np.zeros((0, 3), dtype=np.int64), checks.sensors(np.zeros(0), np.zeros(0)), 0
    names, noise = kind.channels.names, kind.noise(plan)
    watched = [
        (names.index(name), int(sensed.by_effort), part)
        for part, sensed in enumerate(kind.sensed)
        for name in sensed.channels
    ]
    moved = [names.index(sensed.moved) for sensed in kind.sensed for _ in sensed.channels]
    found = checks.sensors(noise[[read for read, *_ in watched]], checks.TRAVEL * noise[moved])
    return np.array(watched, dtype=np.int64).reshape(-1, 3), found, len(kind.sensed)
