"""Effects of the catalogue that differ by more than the signal that they falsify: readings share their code."""

from __future__ import annotations

from models.effects import CATALOGUE
from models.effects.effect import Effect


def _distinct() -> dict[str, Effect]:
    """All effects on physics, and each kind of falsified reading on one signal, another one for each kind."""
    physics = {name: effect for name, effect in CATALOGUE.items() if not name.startswith("sensor.")}
    readings = [name for name in CATALOGUE if name.startswith("sensor.")]
    signals = list(dict.fromkeys(name.split(".")[1] for name in readings))
    kinds = list(dict.fromkeys(name.split(".")[2] for name in readings))
    chosen = [f"sensor.{signals[place % len(signals)]}.{kind}" for place, kind in enumerate(kinds)]
    return physics | {name: CATALOGUE[name] for name in chosen}


DISTINCT = _distinct()
