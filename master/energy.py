"""The energy balance of the running test, checked at every tick: error energy of interface and of integration."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from common.plan.limits import LimitViolation, violated
from common.plan.plan import Plan
from laboratories import kinds
from laboratories.kind import Follows, Kind
from loop.nominal.partition import drifts, felt, storey_stiffness
from master.building import Outputs
from models import energy_balance
from models.compiled import bound
from models.energy_balance import DRIFT_SHARE, ERROR, ERROR_SHARE, LARGEST_INPUT

# Share of the limit of displacement at which the floor of the energy input is reached: with less motion than 1 % of it,
# 1.5 mm by default, sensor noise would dominate the shares.
FLOOR_SHARE = 0.01
LIMITED = (
    "error_energy",
    "numerical_drift",
)  # the limits of both shares, in the order of the kernel's `most`


class Energies(NamedTuple):
    """Energies of a running test, J."""

    given: float  # put in by the ground, with the floor by which errors are divided
    spare: float  # of errors, which the limit `error_energy` allows at present


UNKNOWN = Energies(math.inf, math.inf)  # of a building that the master does not compute


class EnergyMonitor:
    """The energy balance of one test, and its limits `error_energy` and `numerical_drift`."""

    def __init__(self, plan: Plan) -> None:
        self._plan, self._limits, self._motions = plan, vars(plan.limits), 3 * plan.storeys
        ratio, scale, self._felt = interface(kinds.own(plan), plan)
        self._balance = energy_balance.build(
            plan.test.interval,
            ratio,
            scale,
            floor(plan),
            np.array(plan.structure.mass),
            np.array([self._limits[name] for name in LIMITED]),
        )
        self._interval, self._rate = plan.test.interval, 1.0
        self._take = bound(energy_balance.enter, self._balance, 0.0, 0.0, 0.0, 0.0)
        # displacements, velocities and accelerations are the first rows of `motion`
        self._fill, self._motion = struct.Struct(f"{self._motions}d").pack_into, self._balance.motion.data

    @property
    def error_energy(self) -> float:
        """Energy input by the error of the interface, over that of the ground."""
        return self._balance.sums.item(ERROR_SHARE)

    @property
    def energies(self) -> Energies:
        """The energy put in so far, and the energy of errors that the plan allows beyond that so far."""
        given = floor(self._plan) + self._balance.sums.item(LARGEST_INPUT)
        most = self._plan.limits.error_energy * given
        return Energies(float(given), float(most - abs(self._balance.sums.item(ERROR))))

    @property
    def numerical_drift(self) -> float:
        """Energy made by the integration, over that of the ground."""
        return self._balance.sums.item(DRIFT_SHARE)

    def violation(self, measured: tuple[float, ...], outputs: Outputs) -> LimitViolation | None:
        """Update the sums by one tick; returns the first of them beyond its limit, or None."""
        if outputs.rate != self._rate:
            self._rate = outputs.rate
            self._balance.fixed[energy_balance.INTERVAL] = self._interval * outputs.rate
        self._fill(self._motion, 0, *outputs.storeys[: self._motions])
        position, force = self._felt(measured)
        if self._take(outputs.ground_acceleration, outputs.target, position, force):
            return None
        shares = dict(zip(LIMITED, (self.error_energy, self.numerical_drift), strict=True))
        return violated(self._limits, **shares)


def interface(own: Kind | None, plan: Plan) -> tuple[float, float, Callable[[Any], tuple[float, float]]]:
    """Ratio and force scale of the master's own laboratory, and a function for its position (m) and force (N).

    A force that pushes counts as a resisting one with the other sign. Without a laboratory there is no error.
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
    """Floor (J) of the energy input: strain energy of the specimen's storey at `FLOOR_SHARE` of the limit.

    The storey is that of the first specimen, or without one that below the floor of the first laboratory. The floor is
    infinite for a storey without stiffness, so that nothing is judged.
    """
    role = next(iter(drifts(plan) or plan.kinds))
    stiffness = max(storey_stiffness(plan, role), felt(plan, role).stiffness)
    return 0.5 * stiffness * (FLOOR_SHARE * plan.limits.displacement) ** 2 or math.inf
