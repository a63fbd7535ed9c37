"""Limits of a plan on commands and measurements: beyond one of them a laboratory stops its rig."""

from __future__ import annotations

import dataclasses
from typing import Any

from common.plan import Limits


class Guard:
    """Checks the values of one kind of record, by the names they have in it."""

    def __init__(self, limits: Limits, names: tuple[str, ...]) -> None:
        known = {field.name: getattr(limits, field.name) for field in dataclasses.fields(limits)}
        self._checks = tuple((place, name, known[name]) for place, name in enumerate(names) if name in known)

    def violation(self, values: tuple[Any, ...]) -> str:
        """A sentence on the first value beyond its limit, empty where there is none. NaN is beyond any limit."""
        for place, name, most in self._checks:
            value = values[place]
            if isinstance(value, list):
                value = max(value, key=abs)
            if not abs(value) <= most:
                return f"{name} is {value:.6g}, beyond its limit of {most:g}."
        return ""
