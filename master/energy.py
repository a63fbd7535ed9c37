"""Energies of the running test, watched at every tick: of the interface's error, and of the integration."""

from __future__ import annotations

import math

import numpy as np

from common.plan.limits import Violation, violated
from common.plan.plan import Plan
from common.rig import ColumnMeasurement
from loop.nominal.partition import felt, storey_stiffness
from master.step import Outputs
from models import energy_balance
from models.compiled import plain
from models.energy_balance import ACCELERATION, DISPLACEMENT, DRIFT_SHARE, ERROR_SHARE, VELOCITY

# of the largest displacement allowed: with less motion a share of the ground's energy says nothing
FLOOR_SHARE = 0.01


class EnergyMonitor:
    """The balance of one test, moving on tick by tick, and its limits `error_energy` and `numerical_drift`."""

    def __init__(self, plan: Plan) -> None:
        column = plan.column
        self._limits, self._plain = plan.limits, plan.storeys == 1
        self._balance = energy_balance.build(
            plan.test.interval,
            column.deformation_ratio,
            float(column.represents),
            floor(plan),
            np.array(plan.structure.mass),
        )
        self._enter, self._sums = energy_balance.enter, plain(self._balance)

    @property
    def error_energy(self) -> float:
        """Energy that the interface's error has put in, over that of the ground."""
        return self._balance.sums.item(ERROR_SHARE)

    @property
    def numerical_drift(self) -> float:
        """Energy that the integration has made, over that of the ground."""
        return self._balance.sums.item(DRIFT_SHARE)

    def violation(self, measured: ColumnMeasurement, outputs: Outputs) -> Violation | None:
        """Take one tick into the sums; the first of them beyond its limit."""
        balance = self._balance
        motion = balance.motion
        if self._plain:
            motion[DISPLACEMENT, 0] = outputs.displacement
            motion[VELOCITY, 0] = outputs.velocity
            motion[ACCELERATION, 0] = outputs.acceleration
        else:
            motion[: ACCELERATION + 1] = outputs[5:8]
        self._enter(self._sums, outputs.ground_acceleration, outputs.target, *measured)
        error, drift = self.error_energy, self.numerical_drift
        if abs(error) <= self._limits.error_energy and abs(drift) <= self._limits.numerical_drift:
            return None
        return violated(self._limits, error_energy=error, numerical_drift=drift)


def floor(plan: Plan) -> float:
    """Energy (J) below which nothing is judged: strain of the specimen's storey at `FLOOR_SHARE` of the limit.

    Infinite for a storey without stiffness, of which no share can be taken.
    """
    stiffness = max(storey_stiffness(plan), felt(plan).stiffness)
    return 0.5 * stiffness * (FLOOR_SHARE * plan.limits.displacement) ** 2 or math.inf
