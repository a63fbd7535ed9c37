"""A damper whose dashpot or spring is not linear, against another solver."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from common.plan.laboratory_tables import Damper
from models.system import DamperEffects
from tests.laboratories.effects.histories import FORCE, SHORT, STROKE, Array, run_b


@pytest.mark.parametrize(
    "effects",
    [
        DamperEffects(damping_exponent=0.5),
        DamperEffects(damping_exponent=2.0),
        DamperEffects(stiffening=60.0),
        DamperEffects(stiffening=-20.0, damping_exponent=1.5, asymmetry=0.2),
    ],
)
def test_a_dashpot_and_a_spring_that_are_not_linear_move_the_mass_as_another_solver_says(
    effects: DamperEffects,
) -> None:
    damper, pace = Damper(motor_time_constant=0.0), 2.0 * math.pi * 0.6

    def resistance(s: float, v: float) -> float:
        powered = v * (abs(v) / 0.1) ** (effects.damping_exponent - 1.0) if v else 0.0
        dashpot = damper.damping * (powered + effects.asymmetry * abs(v))
        return damper.stiffness * s * (1.0 + effects.stiffening * s**2) + dashpot

    def rates(t: float, x: Array) -> list[float]:
        push = 20.0 * math.sin(pace * SHORT * math.floor(t / SHORT + 1.0))  # held from tick to tick
        return [x[1], (push - resistance(x[0], x[1])) / damper.mass]

    t = np.arange(1, 6001) * SHORT
    push = 20.0 * np.sin(pace * t)
    got = run_b(np.zeros(t.size), push, damper=damper, damper_effects=effects, interval=SHORT)
    found = solve_ivp(rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, max_step=2e-4, rtol=1e-9, atol=1e-12)
    assert np.max(np.abs(got[:, STROKE] - found.y[0])) < 2e-3 * np.max(np.abs(found.y[0]))
    felt = np.array([resistance(s, v) for s, v in found.y.T]) - push
    assert np.max(np.abs(got[:, FORCE] - felt)) < 5e-3 * np.max(np.abs(felt))
