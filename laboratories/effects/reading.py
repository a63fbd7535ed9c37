"""Effects on readings: each exists once per signal and sets one field of `models.system.SensorEffects`.

Their sizes are shares of what a signal typically is on the default test, or multiples of the noise that the
default plan believes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from laboratories.effects.effect import Effect, Parameter
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


def on_each(
    fault: str,
    parameter: Callable[[Signal], Parameter],
    *,
    says: str,
    reference: str,
    in_samples: bool = False,
    random: bool = False,
) -> tuple[Effect, ...]:
    """The effects `sensor.<signal>.<fault>` with one parameter each.

    Args:
        fault: what is wrong with the reading: the field of `SensorEffects` that the parameter sets.
        parameter: the parameter for a signal, with its unit and sizes.
        says: what the effect is, in a few words.
        reference: a source or an equation.
        in_samples: it is told from single samples, no fit looks for it.
        random: it is noise.
    """
    return tuple(
        Effect(
            name=f"sensor.{name}.{fault}",
            site=f"sensor.{name}",
            kind="measurement",
            says=says,
            parameters=(parameter(signal),),
            reference=reference,
            apply=partial(falsified, signal=name, fault=fault),
            signal=name,
            fault=fault,
            in_samples=in_samples,
            random=random,
        )
        for name, signal in SIGNALS.items()
    )


def sized(size: float, *shares: float) -> tuple[float, ...]:
    """Shares of a size, rounded to be read."""
    return tuple(float(f"{share * size:.6g}") for share in shares)


def falsified(system: System, *, signal: str, fault: str, **parameter: float) -> System:
    """The system with the one parameter of an effect on a reading; a true reading leaves no trace."""
    (value,) = parameter.values()
    changed = system.sensed(signal, **{fault: value})
    before = system.effects.sensors.get(signal, SensorEffects())
    return system if changed.effects.sensors[signal] == before else changed
