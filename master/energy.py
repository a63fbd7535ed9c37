"""Energies of the running test, watched at every tick: of the interface's error, and of the integration."""

from __future__ import annotations

import math
import struct
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
LIMITED = ("error_energy", "numerical_drift")  # the limits of both shares, in the order of the kernel's


class EnergyMonitor:
    """The balance of one test, moving on tick by tick, and its limits `error_energy` and `numerical_drift`."""

    def __init__(self, plan: Plan) -> None:
        self._limits, self._motions = vars(plan.limits), 3 * plan.storeys
        ratio, scale, self._felt = interface(kinds.own(plan), plan)
        self._balance = energy_balance.build(
            plan.test.interval,
            ratio,
            scale,
            floor(plan),
            np.array(plan.structure.mass),
            np.array([self._limits[name] for name in LIMITED]),
        )
        self._enter, self._sums = energy_balance.enter, plain(self._balance)
        # displacements, velocities and accelerations, as they stand first in the table of motion
        self._fill, self._motion = struct.Struct(f"{self._motions}d").pack_into, self._balance.motion.data

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
        self._fill(self._motion, 0, *outputs.storeys[: self._motions])
        position, force = self._felt(measured)
        if self._enter(self._sums, outputs.ground_acceleration, outputs.target, position, force):
            return None
        shares = dict(zip(LIMITED, (self.error_energy, self.numerical_drift), strict=True))
        return violated(self._limits, **shares)


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
