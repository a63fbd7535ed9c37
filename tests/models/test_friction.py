"""The size of a friction force at a speed, and how far bristles have bent after a short way."""

from __future__ import annotations

import math

import numpy as np
import pytest

from diagnosis.learned.equations import bristles_of
from models import friction
from models.system import DamperEffects


@pytest.mark.parametrize("share", [0.0, 1e-9, 1e-3, 0.5, 3.0, 19.0, 25.0])
def test_a_friction_decreases_towards_rest_as_a_hyperbolic_tangent(share: float) -> None:
    velocity = 0.02
    found = friction.left(-share * velocity, velocity, 0.0, 0.0)
    assert found == pytest.approx(math.tanh(share), rel=1e-15, abs=2e-16)


@pytest.mark.parametrize("step", [0.0, 9e-5, -9e-5, 1e-3, 0.5])
def test_bristles_fade_over_a_short_step_as_they_do_over_the_whole_way(step: float) -> None:
    far = 0.7
    assert friction.faded(math.exp(step - far), far, step) == pytest.approx(
        math.exp(-far), rel=5e-16, abs=0.0
    )


def test_a_rail_with_presliding_nears_its_friction_and_turns_round_by_an_exponential() -> None:
    rail = DamperEffects(friction=4.0, friction_asymmetry=0.25, presliding=2e-3)
    stroke = np.concatenate([np.linspace(0.0, 3e-3, 31), np.linspace(3e-3, 1e-3, 21)[1:]])
    there = 5.0 * (1.0 - math.exp(-1.5))
    back = -3.0 + (there + 3.0) * math.exp(-1.0)
    assert bristles_of(rail, stroke)[[30, -1]] == pytest.approx([there, back])
