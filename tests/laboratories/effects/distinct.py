"""Effects of the catalogue that differ in code; effects on readings share their code over signals."""

from __future__ import annotations

from laboratories.effects import CATALOGUE
from laboratories.effects.effect import Effect
from laboratories.effects.reading import SIGNALS


def _distinct() -> dict[str, Effect]:
    """All physical effects, and each kind of falsified reading on one signal, a different one for each kind."""
    physics = {name: effect for name, effect in CATALOGUE.items() if not effect.signal}
    faults = dict.fromkeys(effect.fault for effect in CATALOGUE.values() if effect.signal)
    chosen = []
    for place, fault in enumerate(faults):
        having = [signal for signal in SIGNALS if f"sensor.{signal}.{fault}" in CATALOGUE]
        chosen.append(f"sensor.{having[place % len(having)]}.{fault}")
    return physics | {name: CATALOGUE[name] for name in chosen}


DISTINCT = _distinct()


def null_parameters(effect: Effect) -> dict[str, float]:
    """The parameters with which an effect changes nothing."""
    return {item.name: item.null for item in effect.parameters}
