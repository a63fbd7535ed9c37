"""Limits of a plan on commands and measurements: beyond one of them a laboratory stops its rig."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from operator import itemgetter, le
from typing import Any

from common.tables import Limits


class Guard:
    """Checks the values of one kind of record, by the names they have in it.

    `several` are the names that hold one value per storey or laboratory.
    """

    def __init__(self, limits: Limits, names: tuple[str, ...], several: tuple[str, ...] = ()) -> None:
        known = {field.name: getattr(limits, field.name) for field in dataclasses.fields(limits)}
        limited = [place for place, name in enumerate(names) if name in known]
        self._single = [place for place in limited if names[place] not in several]
        self._several = [place for place in limited if names[place] in several]
        self._all = {place: known[names[place]] for place in limited}
        twice = (*self._single, *self._single[:1])  # the first again: the getter of one place gives no tuple
        self._values: Callable[[Any], Any] = itemgetter(*twice) if twice else lambda _: ()
        self._most = [self._all[place] for place in twice]
        self._names = names

    def violation(self, values: tuple[Any, ...]) -> str:
        """A sentence on the first value beyond its limit, empty where there is none. NaN is beyond any limit."""
        if all(map(le, map(abs, self._values(values)), self._most)) and not self._several:
            return ""
        for place in self._single:
            if not abs(values[place]) <= self._all[place]:
                return self._sentence(place, values[place])
        for place in self._several:
            for value in values[place]:
                if not abs(value) <= self._all[place]:
                    return self._sentence(place, value)
        return ""

    def _sentence(self, place: int, value: float) -> str:
        return f"{self._names[place]} is {value:.6g}, beyond its limit of {self._all[place]:g}."
