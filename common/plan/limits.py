"""Limits of a plan on commands and measurements: beyond one of them a laboratory stops its rig.

A limit trips, it never clamps. NaN is beyond any limit, and nothing else is beyond an infinite one.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import NamedTuple

from common.plan.tables import Limits

UNITS: dict[str, str] = {field.name: field.metadata["rule"].unit for field in dataclasses.fields(Limits)}


class LimitViolation(NamedTuple):
    """A value beyond the limit of that name."""

    name: str
    value: float
    limit: float
    unit: str = ""  # of a limit that is none of the plan's own

    @property
    def values(self) -> dict[str, float]:
        """What is recorded with it."""
        return {self.name: self.value, "limit": self.limit}

    @property
    def sentence(self) -> str:
        """What was violated, by how much, in a sentence."""
        limit = f"{self.limit:g} {UNITS.get(self.name, self.unit)}".rstrip()
        return f"{self.name} is {self.value:.6g}, beyond its limit of {limit}."

    def __str__(self) -> str:
        return self.sentence


class Standstill(NamedTuple):
    """A sensor that has given one value so many times in a row."""

    channel: str
    value: float
    times: int
    name: str = "frozen"

    @property
    def values(self) -> dict[str, float]:
        """What is recorded with it."""
        return {self.channel: self.value, "readings": float(self.times)}

    def __str__(self) -> str:
        return (
            f"{self.channel} is frozen: {self.times} readings in a row of {self.value:.6g} while its rig moved; look "
            "at its cable and its driver, or set its noise in [sensors] to 0."
        )


def violated(limits: Mapping[str, float], **values: float) -> LimitViolation | None:
    """The first of some values, by the names of their limits, that is beyond its own."""
    for name, value in values.items():
        most = limits.get(name, math.inf)
        if not abs(value) <= most:
            return LimitViolation(name, value, most)
    return None
