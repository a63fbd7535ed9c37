"""A laboratory of a user's kind: its own kernel, with sensors and effects that are not of the diagnosis' models.

There is no second implementation of such a laboratory, so it moves by the kind's own `step` with the true parameters.
Its sensors, and its effects in no catalogue, are those of the other laboratories of the trial.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from common.plan import read as plans
from common.roles import SLAVE
from common.signals import Channels
from laboratories import effects as catalogue
from laboratories.kinds import kind_of
from models.system import System
from validation.blind.labs import laying, sensors
from validation.blind.labs.laying import PLAIN, KnownEffect, Values
from validation.blind.labs.parts import filters, mechanics

PARTS = 20  # of an interval, in which a filter of a reading moves on: 0.1 ms at the default interval
NONE = {"ripple": 0.0, "ripple_frequency": 10.0, "cam": 0.0, "cam_period": 1.0, "cubic": 0.0}


def ripple(values: Values, *, amplitude: float, frequency: float) -> None:
    """Pulsation of the pump: a vibration of `amplitude` m is added to the command."""
    values |= {"ripple": amplitude, "ripple_frequency": frequency}


def cam(values: Values, *, amplitude: float, period: float) -> None:
    """Error of the displacement sensor in the servo loop that repeats every `period` m of the command."""
    values |= {"cam": amplitude, "cam_period": period}


def hardening(values: Values, *, stiffness: float) -> None:
    """Cubic force `stiffness·x³`, N/m³, added to the device's."""
    values["cubic"] = stiffness


AROUND = {
    "x.device.ripple": KnownEffect(ripple, PLAIN),
    "x.device.cam": KnownEffect(cam, PLAIN),
    "x.device.hardening": KnownEffect(hardening, PLAIN),
}
"""Effects in no catalogue that any device can have."""


def formulas(channels: Channels) -> dict[str, tuple[str, ...]]:
    """Formulas by effect of the catalogue on the readings of a device, where they differ from the catalogue's."""
    found: dict[str, tuple[str, ...]] = {f"sensor.{name}.lag": ("butterworth",) for name in channels.names}
    return found | {f"sensor.{name}.saturation": ("tanh",) for name in channels.names}


def uncatalogued(
    channels: Channels, reached: Mapping[str, float]
) -> dict[str, tuple[str, dict[str, tuple[float, float]]]]:
    """Effects in no catalogue by name: site, and weak and strong value of each parameter.

    Relative to the peaks of the signals they are as large as those of the other laboratories in the default test.
    """
    motion, force = reached[channels.position], reached[channels.force]
    stiffness = force / motion**3
    found = {
        "ripple": {"amplitude": (4e-3 * motion, 6e-2 * motion), "frequency": (6.0, 25.0)},
        "cam": {"amplitude": (1e-3 * motion, 1e-2 * motion), "period": (0.5 * motion, 2.0 * motion)},
        "hardening": {"stiffness": (1.4e-2 * stiffness, 0.18 * stiffness)},
    }
    read = {
        f"x.sensor.{channels.force}.missing": {"probability": (0.01, 0.3)},
    }
    return {f"x.device.{name}": ("device", ranges) for name, ranges in found.items()} | {
        name: (f"sensor.{channels.force}", ranges) for name, ranges in read.items()
    }


class OwnKernelLab:
    """A device of the kind 'file.py:Class'; options are its table of true parameters and noise, and effects.

    An effect is `{name, formula, parameters}`: one of the kind's own, one of `AROUND`, or one on a reading.
    """

    def __init__(
        self,
        interval: float,
        seed: int,
        kind: str,
        device: Mapping[str, Any] | None = None,
        effects: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        tables = {"test": {"interval": interval}, "slave": {"kind": kind}, "device": dict(device or {})}
        plan = plans.from_tables(tables, Path())
        own = kind_of(plan, SLAVE)
        names, levels = own.channels.names, own.noise(plan).tolist()
        values = NONE | sensors.true_values(names, dict(zip(names, levels, strict=True)))
        faults = {effect.name: effect for effect in own.effects}
        given = laying.check(effects)
        beside = [item for item in given if item["name"] not in faults]
        laying.lay(values, beside, {**AROUND, **sensors.known(names)})
        entries = [(item["name"], item["parameters"]) for item in given if item["name"] in faults]
        self._move = own.mover(own.build(catalogue.lay(System(plan), entries, faults)))
        self._values, self._interval = values, interval
        self._position, self._force = names.index(own.channels.position), names.index(own.channels.force)
        self._sensors = sensors.TrueSensors(names, values, interval, seed)
        self._lags = filters.bank(names, self._sensors.lags)
        self._filtered = np.zeros((len(names), 3))
        self._true: tuple[float, ...] = (0.0,) * len(names)
        self._before, self._ticks = self._true, 0

    def arm(self) -> None:
        """An emulated laboratory is always ready."""

    def read(self) -> tuple[float, ...]:
        """Readings at the present tick."""
        return tuple(self._sensors.read(self._true))

    def write(self, command: tuple[float, ...]) -> None:
        """Move on by one interval, with the command that reaches the transfer system."""
        transfer, *motor = command
        self._ticks += 1
        truth = list(self._move(self._told(float(transfer)), *map(float, motor)))
        truth[self._force] += self._values["cubic"] * truth[self._position] ** 3
        self._true = tuple(map(self._behind_filter, range(len(truth)), self._before, truth))
        self._before = tuple(truth)

    def disarm(self) -> None:
        """The device stays where it is."""

    def _told(self, command: float) -> float:
        v = self._values
        if v["cam"] > 0.0:
            command = mechanics.cam(command, v["cam"], v["cam_period"])
        phase = 2.0 * math.pi * v["ripple_frequency"] * self._ticks * self._interval
        return command + v["ripple"] * math.sin(phase)

    def _behind_filter(self, place: int, before: float, now: float) -> float:
        kind, state, value = self._lags[place], self._filtered[place], now
        if kind[filters.ORDER] == 0.0:
            return now
        for part in range(1, PARTS + 1):
            true = before + (now - before) * part / PARTS
            value = filters.step_filter(kind, state, true, self._interval / PARTS)
        return value
