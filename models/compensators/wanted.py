"""The input of every compensator at a tick."""

from __future__ import annotations

from typing import NamedTuple


class Wanted(NamedTuple):
    """The target at t_{k+1} with its rates, and target and measurement at t_k."""

    target: float  # m, at t_{k+1}, as its rates
    rate: float  # m/s
    acceleration: float  # m/s²
    jerk: float  # m/s³
    present: float  # m, target at t_k
    measured: float  # m, displacement at t_k
