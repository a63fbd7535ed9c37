"""Laboratory B, written independently of `models`: the truth that the blind trial diagnoses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from common.errors import InputError
from common.plan import schema
from common.plan.laboratory_tables import Damper, ShakingTable
from common.plan.tables import SensorsTable as Levels
from common.rig import TableCommand, TableMeasurement
from validation.blind.labs import laying, table_kernel
from validation.blind.labs.column_lab import STEP, readings
from validation.blind.labs.parts import delay
from validation.blind.labs.parts.compiled import Array
from validation.blind.labs.table_effects import KNOWN
from validation.blind.labs.table_kernel import TableMemory, TrueTable
from validation.blind.labs.unlisted import table as table_effects
from validation.blind.labs.unlisted.effect import at_rest

SIGNALS = TableMeasurement._fields


class TrueTableLab:
    """Table loop, platform, damper and motor in short steps; options are tables of true parameters, and effects.

    An effect is `{name, formula, parameters}`; without a formula it has its first one.
    """

    def __init__(
        self,
        interval: float,
        seed: int,
        table: Mapping[str, Any] | None = None,
        damper: Mapping[str, Any] | None = None,
        sensors: Mapping[str, Any] | None = None,
        effects: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        values = true_values(
            schema.fill(ShakingTable, table or {}, "table"), schema.fill(Damper, damper or {}, "damper")
        )
        levels = schema.plain(schema.fill(Levels, sensors or {}, "sensors"))
        self._sensors, self._lags = readings(interval, seed, SIGNALS, levels, values, effects, KNOWN)
        steps = math.ceil(interval / STEP - 1e-9)
        values |= {"step": interval / steps, "steps": float(steps)}
        self._bench = TrueTable(**{key: values[key] for key in TrueTable._fields if key in values})
        self._memory = TableMemory(
            np.zeros(table_kernel.STATE),
            delay.ring(self._bench.delay, self._bench.step),
            np.zeros(3),
            np.zeros((6, table_kernel.MOVING)),
            np.zeros((len(SIGNALS), 3)),
            np.zeros((steps, len(SIGNALS))),
            at_rest(values, table_effects.SEEN, table_effects.ADDED),
        )
        self._true: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)

    def arm(self) -> None:
        """An emulated laboratory is always ready."""

    def read(self) -> TableMeasurement:
        """Readings at the present tick."""
        return TableMeasurement(*self._sensors.read(self._true))

    def write(self, command: TableCommand) -> None:
        """Move on by one interval: the table ramps to its command, the motor holds its own."""
        self._true = table_kernel.advance(
            self._bench,
            self._lags,
            self._memory,
            float(command[0]),
            float(command[1]),
        )

    def between(self) -> Array:
        """Readings (steps, signals) at the ends of the short steps of the last interval."""
        return self._sensors.between(self._memory.between)

    def disarm(self) -> None:
        """The table stays where it is; the motor's force is its command's."""


def true_values(table: ShakingTable, damper: Damper) -> laying.Values:
    """The kernel's values without effects; raises InputError where this laboratory has no such part."""
    if math.isinf(table.frequency):
        raise InputError("frequency in [table] must be finite in this laboratory.")
    return {
        "omega": 2.0 * math.pi * table.frequency,
        "damping": table.damping_ratio,
        "delay": table.delay,
        "mass": damper.mass,
        "stiffness": damper.stiffness,
        "dashpot": damper.damping,
        "motor_lag": damper.motor_time_constant,
        "motor_more": 0.0,
        "motor_gain": 1.0,
        "table_gain": 1.0,
        "pade": 0.0,
    }
