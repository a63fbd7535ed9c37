"""Limits of a plan on commands and measurements: beyond one of them a laboratory stops its rig.

A limit trips the test and never clamps a value. NaN is beyond every limit, also beyond an infinite one.
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
    unit: str = ""  # of a limit of a user's kind, which the plan's table of limits does not hold

    @property
    def values(self) -> dict[str, float]:
        """The value and the limit, as the event records them."""
        return {self.name: self.value, "limit": self.limit}

    @property
    def sentence(self) -> str:
        """The value and the limit in a sentence."""
        limit = f"{self.limit:g} {UNITS.get(self.name, self.unit)}".rstrip()
        return f"{self.name} is {self.value:.6g}, beyond its limit of {limit}."

    def __str__(self) -> str:
        return self.sentence


class Standstill(NamedTuple):
    """A frozen sensor: it has given the same value `times` times in a row."""

    channel: str
    value: float
    times: int
    name: str = "frozen"

    @property
    def values(self) -> dict[str, float]:
        """The value and the number of readings, as the event records them."""
        return {self.channel: self.value, "readings": float(self.times)}

    def __str__(self) -> str:
        return (
            f"{self.channel} is frozen: {self.times} readings in a row of {self.value:.6g} while its rig moved; check "
            "its cable and its driver, or set its noise in [sensors] to 0."
        )


def violated(limits: Mapping[str, float], **values: float) -> LimitViolation | None:
    """The first value that is beyond its limit; None where none is. `values` go by the names of their limits."""
    for name, value in values.items():
        most = limits.get(name, math.inf)
        if not abs(value) <= most:
            return LimitViolation(name, value, most)
    return None
