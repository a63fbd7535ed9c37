"""How large the recorded values are, for bars beside their limits: at present, lately, and at most so far."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from common.plan.plan import Plan
from common.recording.run import Values
from common.roles import MASTER
from common.signals import OF_STOREYS
from report.facts.laboratories import LaboratoryFacts
from report.facts.limits import limits as known

LATELY_S = (
    1.0  # s: two cycles of a building of 2 Hz, so that a bar stands still while a motion goes to and fro
)
NOT_LIMITED = frozenset({"seq", "t"})


class Level(NamedTuple):
    """Magnitudes of a value: the newest, the largest of the last `LATELY_S` and of the whole test; t of the newest."""

    now: float
    lately: float
    most: float
    t: float


class Levels:
    """The levels of all numbers that a recording holds, by role and name."""

    def __init__(self) -> None:
        self.units: dict[tuple[str, str], str] = {}
        self._found: dict[tuple[str, str], Level] = {}
        self._tops: dict[tuple[str, str], deque[tuple[float, float]]] = {}

    def take(self, role: str, columns: Mapping[str, Values], units: Mapping[str, str]) -> None:
        """Take in some ticks of a role."""
        t = float(columns["t"][-1])
        for name, values in columns.items():
            if name in NOT_LIMITED or values.dtype.kind != "f" or not values.size:
                continue
            sizes = np.abs(values).reshape(values.shape[0], -1)
            self.units[role, name] = units.get(name, "")
            self._add((role, name), t, sizes, columns["t"] > t - LATELY_S)

    def _add(self, key: tuple[str, str], t: float, sizes: Values, late: Values) -> None:
        """Take in the magnitudes (ticks, n) of a value up to a time; `late` (ticks,) tells those of the last time."""
        tops = self._tops.setdefault(key, deque())
        tops.append((t, largest(sizes[late])))
        while tops[0][0] < t - LATELY_S:
            tops.popleft()
        most = max(largest(sizes), self._found[key].most if key in self._found else 0.0)
        self._found[key] = Level(largest(sizes[-1]), max(each for _, each in tops), most, t)

    def of(self, role: str, name: str) -> Level | None:
        """The level of a value, None before the first."""
        return self._found.get((role, name))


def largest(sizes: Values) -> float:
    """The largest of some magnitudes, 0 of none."""
    return float(np.nanmax(sizes, initial=0.0))


def limits(plan: Plan, lab: LaboratoryFacts) -> dict[str, float]:
    """The limits of a laboratory's values that are recorded, and of the building's beside the master's, by name."""
    names = [*OF_STOREYS] if lab.topic == MASTER and not plan.served else []
    names += [*lab.channels.names, *lab.channels.drives, *(one.name for one in lab.channels.driving)]
    given = known(plan, lab)
    return {name: given[name] for name in dict.fromkeys(names) if math.isfinite(given.get(name, math.inf))}
