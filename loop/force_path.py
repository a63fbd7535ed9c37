"""The measured column force beside that of the plan's specimen at the measured displacement."""

from __future__ import annotations

from common.errors import InputError
from common.plan.plan import Plan
from loop import replay
from models import indicators
from models.indicators import ForcePath
from models.registry import Array
from models.system import System


def force_path(plan: Plan, displacement: Array, force: Array) -> ForcePath | None:
    """Delay (s) and gain of the force (ticks,) N at the displacement (ticks,) m; None where nothing can be said.

    The plan's specimen is played over the measured displacement. So what its model leaves out counts as well: a
    dashpot or hysteresis that it lacks is a lead of the force.
    """
    try:
        return indicators.force_path(replay.column(System(plan), displacement), force, plan.test.interval)
    except InputError:
        return None
