"""What a plan's partition can bear: critical delay, sensitivity, and what the actuator's path will cost."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from common.plan import Plan
from models import excitation, indicators
from models.excitation import Programme, join
from models.excitation.pieces import sine
from models.follower import Follower
from models.labs import column_lab
from models.structures import shear_building
from models.structures.partition import damping_lost, drift_direction, experimental_stiffness, matrices

CYCLES = 12


class Partition(NamedTuple):
    """Margins of the column's path, from nominal models."""

    frequency: float  # Hz, of the building's first mode
    critical_delay: float  # s, inf where no delay makes the loop unstable
    sensitivity: float  # predictive stability indicator, log10 of it in ms
    amplitude: float  # of the compensated actuator at that frequency
    delay: float  # s, there
    damping_points: float  # damping ratio that the path costs the first mode


def assess(plan: Plan) -> Partition:
    """The partition of a plan; raises InputError where a model or parameter is unknown."""
    modes = shear_building.modes(*matrices(plan))
    frequency = 1.0 / float(modes.periods[0])
    critical = critical_delay_of(plan)
    path = path_at(plan, frequency)
    return Partition(
        frequency,
        critical,
        indicators.predictive_stability_indicator(critical),
        path.amplitude,
        path.delay,
        damping_lost(plan, path),
    )


def critical_delay_of(plan: Plan) -> float:
    """Smallest delay (s) of the column's force that makes the linear loop unstable."""
    M, C, K = matrices(plan)
    direction, stiffness = drift_direction(plan), experimental_stiffness(plan)
    share = plan.structure.stiffness[plan.column.storey - 1]
    share *= plan.column.represents / plan.column.columns_per_storey
    numerical = K - share * np.outer(direction, direction)
    return float(indicators.critical_delay(M, C, numerical, direction, stiffness))


def path_at(plan: Plan, frequency: float) -> indicators.FrequencyEvaluation:
    """Amplitude and delay of the compensated nominal actuator for a sine of that frequency (Hz)."""
    interval = plan.test.interval
    cycles = max(CYCLES, round(2.0 * frequency))
    piece = sine(interval, frequency, amplitude=1e-3, cycles=cycles)
    target, measured = follow(plan, join([piece], interval))
    return indicators.frequency_evaluation_index(target, measured, interval)


def follow(plan: Plan, programme: Programme) -> tuple[Any, Any]:
    """Target and achieved displacement of the compensated nominal actuator, m."""
    follower = Follower(plan.compensator, programme, plan.test.interval)
    lab = column_lab.build(plan.test.interval, plan.actuator, plan.column)
    target = programme.motion[excitation.POSITION]
    achieved = np.zeros(target.size)
    for tick in range(target.size - 1):
        _, command = follower(tick, float(achieved[tick]))
        achieved[tick + 1] = column_lab.advance(*lab, command)[0]
    return target, achieved
