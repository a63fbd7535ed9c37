"""Parameters of effects with their intervals, as the report holds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from diagnosis.report.fields import Ends, Entry, Number, noted


@dataclass(frozen=True, kw_only=True)
class Value(Entry):
    """A parameter of an effect."""

    value: Number = noted("The estimate")
    interval: Ends | None = noted("Its interval of 95 %, null where it is not known")
    unit: str = noted("Unit of all of them")


Parameters = Mapping[str, Mapping[str, Value]]  # by effect, then by parameter
