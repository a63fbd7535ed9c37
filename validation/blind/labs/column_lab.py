"""Laboratory A, written independently of `models`: the truth that the blind trial diagnoses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from common.errors import InputError
from common.plan import schema
from common.plan.laboratory_tables import Actuator, Column
from common.plan.tables import SensorsTable as Levels
from common.rig import ColumnCommand, ColumnMeasurement
from validation.blind.labs import column_kernel, laying, sensors
from validation.blind.labs.column_effects import KNOWN
from validation.blind.labs.column_kernel import ColumnMemory, Servo
from validation.blind.labs.parts import delay, filters, specimen
from validation.blind.labs.parts.compiled import Array
from validation.blind.labs.parts.specimen import TrueSpecimen
from validation.blind.labs.unlisted import actuator as actuator_effects
from validation.blind.labs.unlisted.effect import at_rest

STEP = 0.1e-3  # s, longest: a loop of 30 Hz, faster than any here, turns by 0.02 rad in it
SIGNALS = ColumnMeasurement._fields


class TrueColumnLab:
    """Servo loop, clevis and column in short steps; options are tables of true parameters, and effects.

    An effect is `{name, formula, parameters}`; without a formula it has its first one.
    """

    def __init__(
        self,
        interval: float,
        seed: int,
        actuator: Mapping[str, Any] | None = None,
        column: Mapping[str, Any] | None = None,
        sensors: Mapping[str, Any] | None = None,
        effects: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        values = true_values(
            schema.fill(Actuator, actuator or {}, "actuator"), schema.fill(Column, column or {}, "column")
        )
        levels = schema.plain(schema.fill(Levels, sensors or {}, "sensors"))
        self._sensors, self._lags = readings(interval, seed, SIGNALS, levels, values, effects, KNOWN)
        steps = math.ceil(interval / STEP - 1e-9)
        values |= {"step": interval / steps, "steps": float(steps)}
        self._servo = Servo(**{key: values[key] for key in Servo._fields if key in values})
        self._column = TrueSpecimen(**{key: values[key] for key in TrueSpecimen._fields if key in values})
        self._memory = ColumnMemory(
            np.zeros(column_kernel.STATE),
            delay.ring(self._servo.delay, self._servo.step),
            np.zeros(3),
            np.zeros(specimen.SIZE),
            np.zeros((len(SIGNALS), 3)),
            np.zeros((steps, len(SIGNALS))),
            at_rest(values, actuator_effects.SEEN, actuator_effects.ADDED),
        )
        self._true: tuple[float, ...] = (0.0, 0.0)

    def arm(self) -> None:
        """An emulated laboratory is always ready."""

    def read(self) -> ColumnMeasurement:
        """Readings at the present tick."""
        return ColumnMeasurement(*self._sensors.read(self._true))

    def write(self, command: ColumnCommand) -> None:
        """Move on by one interval, ramping to the command."""
        self._true = column_kernel.advance(
            self._servo,
            self._column,
            self._lags,
            self._memory,
            float(command[0]),
        )

    def between(self) -> Array:
        """Readings (steps, signals) at the ends of the short steps of the last interval."""
        return self._sensors.between(self._memory.between)

    def disarm(self) -> None:
        """The actuator stays where it is."""


def true_values(actuator: Actuator, column: Column) -> laying.Values:
    """The kernel's values without effects; raises InputError where this laboratory has no such part."""
    if column.model != "linear":
        raise InputError(
            f"The column of this laboratory is linear, not '{column.model}': give the law as an effect."
        )
    if column.mass or column.damping:
        raise InputError(
            "The column of this laboratory has no mass or damping of its own: give them as effects."
        )
    if actuator.model != "fopdt" or actuator.command != "ramp":
        raise InputError(
            f"This laboratory has the actuator 'fopdt' with a ramped command, not '{actuator.model}' with the command "
            f'\'{actuator.command}\': set model = "fopdt" and command = "ramp" in [actuator].'
        )
    if actuator.time_constant <= 0.0:
        raise InputError("time_constant in [actuator] must be greater than 0 s in this laboratory.")
    return {
        "gain": actuator.gain,
        "delay": actuator.delay,
        "time_constant": actuator.time_constant,
        "stiffness": column.stiffness,
        "pade": 0.0,
    }


def readings(
    interval: float,
    seed: int,
    names: Sequence[str],
    levels: Mapping[str, float],
    values: laying.Values,
    effects: object,
    known: Mapping[str, laying.KnownEffect],
) -> tuple[sensors.TrueSensors, Any]:
    """The sensors of a laboratory and their filters; the effects are applied to `values`, too."""
    values |= sensors.true_values(names, levels)
    laying.lay(values, laying.check(effects), {**known, **sensors.known(names)})
    read = sensors.TrueSensors(names, values, interval, seed)
    return read, filters.bank(names, read.lags)
