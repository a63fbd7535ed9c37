"""What every compensator is asked at a tick."""

from __future__ import annotations

from typing import NamedTuple


class Wanted(NamedTuple):
    """What a compensator is asked for at t_k: the target at t_{k+1} with its rates, and where the system is."""

    target: float  # m, at t_{k+1}, as its rates
    rate: float  # m/s
    acceleration: float  # m/s²
    jerk: float  # m/s³
    present: float  # m, target at t_k
    measured: float  # m, displacement at t_k
