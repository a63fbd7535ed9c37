"""The linear part of a shaking table as a transfer function from its command to the platform's displacement.

Friction, play, a valve's limit and the damper's force are left out.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from common.plan.laboratory_tables import ShakingTable
from laboratories.table.linear import ADDED, BETWEEN, FLOW
from models.system import TableEffects

Spectrum = npt.NDArray[np.complex128]


def displacement(s: Spectrum, interval: float, table: ShakingTable, effects: TableEffects) -> Spectrum:
    """Displacement (m) at the end of an interval (s) over the command (m) that it is ramped to until then.

    `s` (n,) are 2πi times frequencies, 1/s. What lies between the samples of a command is a straight line.
    """
    omega = 2.0 * math.pi * table.frequency
    loop = s**2 + 2.0 * table.damping_ratio * omega * s + omega**2
    behind = behind_loop(s, effects)
    if not math.isinf(effects.second_frequency):
        loop = loop - pulled(s, omega, effects) * behind - lacking(effects) * s**2
    ramps = np.sinc(s.imag * interval / (2.0 * math.pi)) ** 2
    late = np.exp(-table.delay * s)
    return np.asarray(
        effects.gain
        * fed_forward(s, interval, omega, table, effects)
        * late
        * ramps
        * omega**2
        * behind
        / loop
    )


def behind_loop(s: Spectrum, effects: TableEffects) -> Spectrum:
    """The platform's motion over that of the loop below it."""
    if math.isinf(effects.oil_frequency):
        return np.ones_like(s)
    oil = 2.0 * math.pi * effects.oil_frequency
    damped, share = 2.0 * effects.oil_damping * oil * s, effects.oil_share
    moved = oil**2 + damped if effects.oil_law == BETWEEN else oil**2
    return np.asarray(1.0 - share + share * moved / (s**2 + damped + oil**2))


def pulled(s: Spectrum, omega: float, effects: TableEffects) -> Spectrum:
    """Acceleration (m/s²) by which a mass that swings on the platform pulls at the loop, over the platform's place."""
    second, share = 2.0 * math.pi * effects.second_frequency, effects.second_share
    damped = 2.0 * effects.second_damping * second
    ahead = -(s**2) / (s**2 + damped * s + second**2)
    if effects.second_law == FLOW:
        return np.asarray(share / (1.0 - share) * second**2 / omega * s * ahead)
    ratio = share / (1.0 - share) if effects.second_law == ADDED else share
    return np.asarray(ratio * (damped * s + second**2) * ahead)


def lacking(effects: TableEffects) -> float:
    """The share of the mass that its loop was tuned to move, and does not move as it swings by itself."""
    return 0.0 if effects.second_law in (FLOW, ADDED) else effects.second_share


def fed_forward(
    s: Spectrum, interval: float, omega: float, table: ShakingTable, effects: TableEffects
) -> Spectrum:
    """The command with what is fed forward of its velocity and acceleration, over the command."""
    if effects.feed_velocity == 0.0:
        return np.ones_like(s)
    before = np.exp(-s * interval)
    kept = math.exp(-interval / effects.feed_lag)
    change = (1.0 - before) / interval
    rate = (1.0 - kept) * change / (1.0 - kept * before)
    velocity = effects.feed_velocity * 2.0 * table.damping_ratio / omega
    return np.asarray(1.0 + velocity * rate + effects.feed_acceleration / omega**2 * rate * change)
