"""The trial's laboratories under given commands, with and without effects."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from common.rig import ColumnCommand, TableCommand
from validation.blind.labs import (
    SIGNALS,
    column_effects,
    sensors,
    table_effects,
)
from validation.blind.labs.column_lab import TrueColumnLab
from validation.blind.labs.table_lab import TrueTableLab

DT = 0.002
Trace = NDArray[np.float64]
SILENT = dict.fromkeys(SIGNALS, 0.0)
SIGNALS_A, SIGNALS_B = SIGNALS[:2], SIGNALS[2:]
KNOWN_A = {**column_effects.KNOWN, **sensors.known(SIGNALS_A)}
KNOWN_B = {**table_effects.KNOWN, **sensors.known(SIGNALS_B)}
# a command of several frequencies that begins at rest, with about the amplitudes of the default test
TIMES = np.arange(2500) * DT
RISE = np.minimum(TIMES / 2.0, 1.0) ** 2
COLUMN = RISE * (2.2e-3 * np.sin(12.5 * TIMES) + 0.1e-3 * np.sin(40.0 * TIMES))
TABLE = RISE * (4.5e-3 * np.sin(12.5 * TIMES) + 0.2e-3 * np.sin(40.0 * TIMES))
MOTOR = RISE * (60.0 * np.cos(12.5 * TIMES) + 4.0 * np.sin(31.0 * TIMES))


def effect(name: str, formula: str = "", /, **parameters: float) -> dict[str, Any]:
    return {"name": name, "formula": formula, "parameters": parameters}


def play_a(*effects: dict[str, Any], command: Trace = COLUMN, **options: Any) -> dict[str, Trace]:
    lab = TrueColumnLab(DT, 3, **{"sensors": SILENT, "effects": list(effects)} | options)
    rows = []
    for value in command.tolist():
        rows.append(lab.read())
        lab.write(ColumnCommand(value))
    return dict(zip(SIGNALS_A, np.array(rows).T, strict=True))


def play_b(
    *effects: dict[str, Any], command: Trace = TABLE, motor: Trace = MOTOR, **options: Any
) -> dict[str, Trace]:
    lab = TrueTableLab(DT, 3, **{"sensors": SILENT, "effects": list(effects)} | options)
    rows = []
    for pair in zip(command.tolist(), motor.tolist(), strict=True):
        rows.append(lab.read())
        lab.write(TableCommand(*pair))
    return dict(zip(SIGNALS_B, np.array(rows).T, strict=True))


def play(*effects: dict[str, Any]) -> dict[str, Trace]:
    names = {item["name"] for item in effects}
    return play_a(*effects) if names <= set(KNOWN_A) else play_b(*effects)


CLEAN = {**play_a(), **play_b()}


def changes(found: dict[str, Trace]) -> dict[str, float]:
    """Rms of the change of each signal over the clean one's."""
    return {
        name: float(np.sqrt(np.mean((values - CLEAN[name]) ** 2) / np.mean(CLEAN[name] ** 2)))
        for name, values in found.items()
    }


def near(found: Trace, wanted: Trace, tolerance: float = 1e-4) -> bool:
    return float(np.max(np.abs(found - wanted))) < tolerance * float(np.max(np.abs(wanted)))


def ramped(command: Trace, t: float) -> float:
    """The command ramped so that value k arrives at t = (k + 1)·dt, as a rig does that is written at tick k."""
    return float(np.interp(t, np.arange(command.size + 1) * DT, np.concatenate([[0.0], command])))
