"""Limits of a plan on commands and measurements: beyond one of them a laboratory stops its rig."""

from __future__ import annotations

import dataclasses
from typing import Any

from common.plan import Limits


class Guard:
    """Checks the values of one kind of record, by the names they have in it.

    `several` are the names that hold one value per storey.
    """

    def __init__(self, limits: Limits, names: tuple[str, ...], several: tuple[str, ...] = ()) -> None:
        known = {field.name: getattr(limits, field.name) for field in dataclasses.fields(limits)}
        limited = [(place, name) for place, name in enumerate(names) if name in known]
        self._single = tuple(place for place, name in limited if name not in several)
        self._several = tuple(place for place, name in limited if name in several)
        self._most = [known.get(name, 0.0) for name in names]
        self._names = names

    def violation(self, values: tuple[Any, ...]) -> str:
        """A sentence on the first value beyond its limit, empty where there is none. NaN is beyond any limit."""
        most = self._most
        for place in self._single:
            if not -most[place] <= values[place] <= most[place]:
                return self._sentence(place, values[place])
        for place in self._several:
            for value in values[place]:
                if not -most[place] <= value <= most[place]:
                    return self._sentence(place, value)
        return ""

    def _sentence(self, place: int, value: float) -> str:
        return f"{self._names[place]} is {value:.6g}, beyond its limit of {self._most[place]:g}."
