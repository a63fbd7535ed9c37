"""What an effect of no catalogue is, and what the laboratories hold for it over each of their short steps.

Such an effect sees the motion at the end of a step, and what it adds holds over the next one, of 0.1 ms or less. That
is shorter than any time constant here, and keeps an effect to a few lines.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from validation.blind.labs.laying import KnownEffect, Values
from validation.blind.labs.parts.compiled import Array

SIZES = ("first", "second")  # values of an effect in the kernels
KEPT = 4  # values that an effect may keep from step to step


class Unlisted(NamedTuple):
    """An effect of no catalogue; its first parameter is its size, and at 0 it is absent."""

    code: int
    text: str
    ranges: Mapping[str, tuple[float, float]]  # from hardly visible to strong, by parameter
    # Effects of the catalogue that are its mechanism, so that their names are right as well.
    alike: tuple[str, ...] = ()


class EffectMemory(NamedTuple):
    """What a laboratory keeps for its effect of no catalogue."""

    sizes: Array  # its parameters
    kept: Array  # from step to step
    seen: Array  # the laboratory's motion at the end of a step
    added: Array  # what holds over the next step


def at_rest(values: Values, seen: int, added: int) -> EffectMemory:
    """Memory at rest for the effect among a laboratory's values, with so many places."""
    sizes = np.array([values.get(f"unlisted.{name}", 0.0) for name in SIZES])
    return EffectMemory(sizes, np.zeros(KEPT), np.zeros(seen), np.zeros(added))


def known(effects: Mapping[str, Unlisted], place: str = "unlisted") -> dict[str, KnownEffect]:
    """The effects as a laboratory knows them: their code in the value `place`, their parameters behind it."""
    return {
        name: KnownEffect(Laying(one, place), {"plain": one.code}, place) for name, one in effects.items()
    }


class Laying:
    """Lays an effect into a laboratory's values, with the effect's own parameters as keywords."""

    def __init__(self, effect: Unlisted, place: str) -> None:
        self._names, self._place = tuple(effect.ranges), place
        kind = inspect.Parameter.KEYWORD_ONLY
        self.__signature__ = inspect.Signature(
            [inspect.Parameter("values", inspect.Parameter.POSITIONAL_ONLY)]
            + [inspect.Parameter(name, kind) for name in self._names]
        )

    def __call__(self, values: Values, **parameters: float) -> None:
        """Set the parameters by their places."""
        for place, name in zip(SIZES, self._names, strict=False):
            values[f"{self._place}.{place}"] = parameters[name]
