"""Energies of the running test, watched at every tick: of the interface's error, and of the integration."""

from __future__ import annotations

import math
from collections.abc import Callable
from operator import itemgetter
from typing import Any

import numpy as np

from common.plan.limits import LimitViolation, violated
from common.plan.plan import Plan
from laboratories import kinds
from laboratories.kind import Follows, Kind
from loop.nominal.partition import drifts, felt, storey_stiffness
from master.step import Outputs
from models import energy_balance
from models.compiled import plain
from models.energy_balance import DRIFT_SHARE, ERROR_SHARE

# of the largest displacement allowed: with less motion a share of the ground's energy says nothing
FLOOR_SHARE = 0.01


class EnergyMonitor:
    """The balance of one test, moving on tick by tick, and its limits `error_energy` and `numerical_drift`."""

    def __init__(self, plan: Plan) -> None:
        self._limits, self._motions = vars(plan.limits), 3 * plan.storeys
        ratio, scale, self._felt = interface(kinds.own(plan), plan)
        self._balance = energy_balance.build(
            plan.test.interval, ratio, scale, floor(plan), np.array(plan.structure.mass)
        )
        self._enter, self._sums = energy_balance.enter, plain(self._balance)
        self._motion = self._balance.motion.reshape(-1)[
            : self._motions
        ]  # displacement, velocity, acceleration

    @property
    def error_energy(self) -> float:
        """Energy that the interface's error has put in, over that of the ground."""
        return self._balance.sums.item(ERROR_SHARE)

    @property
    def numerical_drift(self) -> float:
        """Energy that the integration has made, over that of the ground."""
        return self._balance.sums.item(DRIFT_SHARE)

    def violation(self, measured: tuple[float, ...], outputs: Outputs) -> LimitViolation | None:
        """Take one tick into the sums; the first of them beyond its limit."""
        self._motion[:] = outputs.storeys[: self._motions]
        self._enter(self._sums, outputs.ground_acceleration, outputs.target, *self._felt(measured))
        error, drift = self.error_energy, self.numerical_drift
        limits = self._limits
        if abs(error) <= limits["error_energy"] and abs(drift) <= limits["numerical_drift"]:
            return None
        return violated(limits, error_energy=error, numerical_drift=drift)


def interface(own: Kind | None, plan: Plan) -> tuple[float, float, Callable[[Any], tuple[float, float]]]:
    """Deformation over motion and force over force of the master's own laboratory, and its position and force.

    A force that pushes counts as one that resists with the other sign. Without a laboratory there is no error.
    """
    if own is None:
        return 1.0, 0.0, lambda _: (0.0, 0.0)
    coupling, names = own.coupling(plan), own.channels.names
    scale = coupling.scale if coupling.follows is Follows.DRIFT else -coupling.scale
    return (
        coupling.ratio,
        scale,
        itemgetter(names.index(own.channels.position), names.index(own.channels.force)),
    )


def floor(plan: Plan) -> float:
    """Energy (J) below which nothing is judged: strain of the specimen's storey at `FLOOR_SHARE` of the limit.

    It is the storey of the first specimen, without one that below the floor of the first laboratory. Infinite for a
    storey without stiffness, of which no share can be taken.
    """
    role = next(iter(drifts(plan) or plan.kinds))
    stiffness = max(storey_stiffness(plan, role), felt(plan, role).stiffness)
    return 0.5 * stiffness * (FLOOR_SHARE * plan.limits.displacement) ** 2 or math.inf
