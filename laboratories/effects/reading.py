"""Effects on readings: each exists once per signal and sets fields of `models.system.SensorEffects`.

Their sizes are shares of a signal's typical magnitude on the default test, or multiples of the default plan's noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

from laboratories.effects.effect import Effect, Law, Parameter
from models.system import SensorEffects, System


@dataclass(frozen=True)
class SensorSignal:
    """One reading of a laboratory."""

    unit: str
    typical: float  # magnitude on the default test
    noise: float  # rms, of the default plan


SIGNALS = {
    "column_displacement": SensorSignal("m", 2e-3, 5e-6),
    "column_force": SensorSignal("N", 30e3, 100.0),
    "table_displacement": SensorSignal("m", 20e-3, 10e-6),
    "table_acceleration": SensorSignal("m/s²", 1.0, 0.01),
    "damper_stroke": SensorSignal("m", 50e-3, 2e-6),
    "damper_force": SensorSignal("N", 80.0, 0.2),
}
# typical magnitude of a reading without a limit, by its unit: the order of the signals above
TYPICAL = {"m": 20e-3, "m/s": 0.1, "m/s²": 1.0, "N": 10e3}
QUIET = (
    1e-3  # noise over typical magnitude of a reading without nominal noise: the order of the signals above
)


@dataclass(frozen=True)
class ReadingFault:
    """An error that any reading can have: the effects `sensor.<signal>.<name>` with one parameter of strength each."""

    name: str  # the field of `SensorEffects` that the parameter sets
    parameter: Callable[[SensorSignal], Parameter]  # the parameter for a signal, with its unit and sizes
    says: str  # a short description of the effect
    reference: str  # a source or an equation
    in_samples: bool = False  # as in `Effect`
    random: bool = False  # as in `Effect`
    motionless: bool = False  # as in `Effect`
    timed: bool = False  # as in `Effect`
    units: tuple[str, ...] = ()  # of the readings that can have it, empty for any
    # parameters of shape, by the field of `SensorEffects` that each sets
    shapes: Mapping[str, Parameter] = field(default_factory=dict)
    # optional parameters, by the field that each sets, and the formulas that they choose, as in `Effect`
    further: Mapping[str, Parameter] = field(default_factory=dict)
    laws: tuple[Law, ...] = ()

    def can_be_on(self, signal: SensorSignal) -> bool:
        """Whether a reading of that unit can have it."""
        return not self.units or signal.unit in self.units

    def on(self, name: str, signal: SensorSignal) -> Effect:
        """The effect on the reading of that name."""
        strength = self.parameter(signal)
        shapes = {item.name: place for place, item in (*self.shapes.items(), *self.further.items()) if place}
        fields = {strength.name: self.name} | shapes
        return Effect(
            name=f"sensor.{name}.{self.name}",
            site=f"sensor.{name}",
            kind="measurement",
            says=self.says,
            parameters=(strength, *self.shapes.values()),
            reference=self.reference,
            apply=partial(falsified, signal=name, fields=fields),
            signal=name,
            fault=self.name,
            in_samples=self.in_samples,
            random=self.random,
            timed=self.timed,
            motionless=self.motionless,
            further=tuple(self.further.values()),
            laws=self.laws,
        )


def channel(name: str, unit: str, limit: float, noise: float) -> SensorSignal:
    """The reading of a user's kind, whose magnitude follows from its limit, or from its unit where `limit` is 0."""
    usable = limit if 0.0 < limit < math.inf else 0.0
    typical = usable or TYPICAL.get(unit, 1.0)
    return SIGNALS.get(name) or SensorSignal(unit, typical, noise or QUIET * typical)


def sized(size: float, *shares: float) -> tuple[float, ...]:
    """Shares of a size, rounded to six digits for the reader."""
    return tuple(float(f"{share * size:.6g}") for share in shares)


def falsified(system: System, *, signal: str, fields: Mapping[str, str], **given: float) -> System:
    """The system with an effect on a reading set; unchanged at the null value of its first parameter.

    `fields` are those of `SensorEffects` that the parameters set, by their names, the first parameter's first.
    """
    untouched = SensorEffects()
    values = {place: given.get(name, getattr(untouched, place)) for name, place in fields.items()}
    fault = next(iter(values))
    if values[fault] == getattr(untouched, fault):
        values = {place: getattr(untouched, place) for place in values}
    changed = system.sensed(signal, **values)
    before = system.effects.sensors.get(signal, untouched)
    return system if changed.effects.sensors[signal] == before else changed
