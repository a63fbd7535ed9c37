"""The coupling between the damper's mass and a share of it that lies behind, elastic or with play."""

from __future__ import annotations

import math

from common.plan.laboratory_tables import Damper
from models.compiled import jit
from models.system import DamperEffects


def constants(damper: Damper, effects: DamperEffects) -> tuple[float, float, float, float, float]:
    """The mass behind (kg), its spring (1/s²) and dashpot (1/s), half of the play (m), whole mass over the first."""
    if math.isinf(effects.second_frequency):
        return 0.0, 0.0, 0.0, 0.0, 1.0
    omega, share = 2.0 * math.pi * effects.second_frequency, effects.second_mass
    damped, half = 2.0 * effects.second_damping * omega, 0.5 * effects.second_play
    return share * damper.mass, omega**2, damped, half, 1.0 / (1.0 - share)


@jit
def force(
    ahead: float,
    rate: float,
    length: float,
    mass: float,
    spring: float,
    dashpot: float,
    half: float,
    whole: float,
) -> float:
    """Force (N) on the first mass at the middle of a segment of `length` s; on a flank of the play it only pushes.

    At its beginning the mass behind is `ahead` (m) with a `rate` (m/s); the others are `constants`.
    """
    ahead += 0.5 * length * rate
    # of a strong dashpot as if it acted on the rate at the segment's end, so that it never turns the motion around
    damped = dashpot / (1.0 + 0.5 * length * dashpot * whole)
    if half == 0.0:
        return float(mass * (spring * ahead + damped * rate))
    bent = ahead - min(max(ahead, -half), half)
    if bent == 0.0:
        return 0.0
    pressed = mass * (spring * bent + damped * rate)
    return float(max(pressed, 0.0) if bent > 0.0 else min(pressed, 0.0))
