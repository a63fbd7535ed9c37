"""Compares the measured column force with that of the plan's specimen at the measured displacement."""

from __future__ import annotations

from common.errors import InputError
from common.plan.plan import Plan
from loop import replay
from models import indicators
from models.indicators import ForcePath
from models.registry import Array
from models.system import System


def force_path(plan: Plan, displacement: Array, force: Array) -> ForcePath | None:
    """Delay (s) and gain of the force (ticks,) N at the displacement (ticks,) m; None where they cannot be determined.

    The plan's specimen is simulated for the measured displacement, so what its model lacks counts too: a missing
    dashpot or hysteresis appears as a lead of the force.
    """
    try:
        return indicators.force_path(replay.column(System(plan), displacement), force, plan.test.interval)
    except InputError:
        return None
