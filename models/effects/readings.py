"""The readings that effects can falsify, and their sizes on the default test.

Effects on a reading exist once per signal; their sizes are shares of what the signal typically is, or
multiples of the noise that the plan believes.
"""

from __future__ import annotations

from dataclasses import dataclass

from models.system import SensorEffects, System


@dataclass(frozen=True)
class Signal:
    """One reading of a laboratory."""

    unit: str
    typical: float  # magnitude on the default test
    noise: float  # rms, of the default plan


SIGNALS = {
    "column_displacement": Signal("m", 2e-3, 5e-6),
    "column_force": Signal("N", 30e3, 100.0),
    "table_displacement": Signal("m", 20e-3, 10e-6),
    "table_acceleration": Signal("m/s²", 1.0, 0.01),
    "damper_stroke": Signal("m", 50e-3, 2e-6),
    "damper_force": Signal("N", 80.0, 0.2),
}


def sized(size: float, *shares: float) -> tuple[float, ...]:
    """Shares of a size, rounded to be read."""
    return tuple(float(f"{share * size:.6g}") for share in shares)


def falsified(system: System, signal: str, **values: float) -> System:
    """The system with effects on one reading replaced; a true reading leaves no trace."""
    changed = system.sensed(signal, **values)
    before = system.effects.sensors.get(signal, SensorEffects())
    return system if changed.effects.sensors[signal] == before else changed
