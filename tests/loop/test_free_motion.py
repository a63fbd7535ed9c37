"""The stability of a whole loop, judged from its motion after one pulse."""

from __future__ import annotations

import numpy as np
import pytest

from common.plan.plan import Plan
from loop.nominal import free_motion
from models.indicators.growth import grows
from tests.helpers import with_table
from validation.paper.experiments import delayed


@pytest.mark.parametrize(("delay", "unstable"), [(0.0324, False), (0.0334, True), (0.1, True)])
def test_the_loop_becomes_unstable_at_the_critical_delay(
    default_plan: Plan, delay: float, unstable: bool
) -> None:
    assert free_motion.unstable(delayed(default_plan, delay)) is unstable


def test_an_excessive_gain_of_the_dampers_control_makes_the_loop_unstable(default_plan: Plan) -> None:
    assert free_motion.unstable(with_table(default_plan, "control", gain=3e6))


@pytest.mark.parametrize(("rate", "expected"), [(-0.05, False), (0.0, False), (0.01, True), (0.5, True)])
def test_the_growth_of_a_sine_is_detected(rate: float, expected: bool) -> None:
    t = np.arange(0.0, 20.0, 0.002)
    motion = np.exp(rate * t) * np.sin(12.5 * t)
    assert grows(motion) is expected
    assert grows(np.stack([np.zeros(t.size), motion], axis=1)) is expected


def test_values_that_are_not_finite_count_as_growth_and_rounding_does_not() -> None:
    t = np.arange(0.0, 20.0, 0.002)
    gone = np.exp(-5.0 * t)
    gone[-100:] += 1e-12
    assert not grows(gone)
    assert grows(np.where(t > 19.0, np.nan, gone))
