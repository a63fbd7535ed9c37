"""Follows a programme of motion tick by tick through a compensator, in bench tests and before a test."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from models import compensators
from models.compiled import bound
from models.excitation import ACCELERATION, JERK, POSITION, RATE, Programme


class ChosenCompensator(Protocol):
    """A compensator that a plan chooses."""

    @property
    def kind(self) -> str:
        """Its name."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """Its parameters by name."""


class Follower:
    """A programme with its compensator; `table` is the plan's table that holds the compensator, for errors."""

    def __init__(
        self,
        chosen: ChosenCompensator,
        programme: Programme,
        interval: float,
        table: str = "compensator",
    ) -> None:
        self._motion = programme.motion
        self._interval = interval
        built = compensators.build(chosen.kind, chosen.parameters, interval, table)
        self._command = bound(compensators.enter, built, *compensators.STILL, interval)

    def wanted(self, tick: int) -> float:
        """The programme's value at a tick."""
        return float(self._motion[POSITION, tick])

    def __call__(self, tick: int, measured: float) -> tuple[float, float]:
        """The target at t_k and the command for the interval's end, m, from the measurement (m) at t_k."""
        ahead, present = self._motion[:, tick + 1], self.wanted(tick)
        rates = float(ahead[RATE]), float(ahead[ACCELERATION]), float(ahead[JERK])
        wanted = float(ahead[POSITION]), *rates, present, measured
        return present, float(self._command(*wanted, self._interval))
