"""A constant force on the active mass damper, whose reaction acts on the table or elsewhere, against statics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.plan.laboratory_tables import Damper
from models.system import DamperEffects, TableEffects
from tests.laboratories.effects.histories import FORCE, STROKE, Y, run_b


@given(force=st.floats(-50.0, 50.0))
@settings(max_examples=10)
def test_a_constant_force_deflects_the_damper_as_in_statics(force: float) -> None:
    damper = Damper(damping=60.0)
    got = run_b(np.zeros(6000), damper=damper, damper_effects=DamperEffects(offset=force))
    assert got[-1, STROKE] == pytest.approx(force / 56.8, rel=1e-4, abs=1e-9)
    assert abs(got[-1, FORCE]) < 1e-4 * abs(force) + 1e-9  # nothing is accelerated any more
    assert got[0, FORCE] == pytest.approx(-force, rel=0.01, abs=1e-9)  # at first all of it is
    # on a table that yields to it too, it is what a motor without lag would give
    quick, table = Damper(motor_time_constant=0.0), TableEffects(compliance=2.5e-5)
    driven = run_b(np.zeros(200), np.full(200, force), damper=quick, table_effects=table)
    more = DamperEffects(offset=force)
    pushed = run_b(np.zeros(200), damper=quick, table_effects=table, damper_effects=more)
    assert np.allclose(pushed, driven, rtol=1e-12, atol=1e-12)


@given(force=st.floats(-50.0, 50.0))
@settings(max_examples=10)
def test_a_constant_force_from_outside_goes_through_the_spring_into_the_table(force: float) -> None:
    damper, table = Damper(damping=60.0), TableEffects(compliance=2.5e-5)
    more = DamperEffects(offset=force, offset_outside=1.0)
    got = run_b(np.zeros(6000), damper=damper, table_effects=table, damper_effects=more)
    assert got[-1, STROKE] == pytest.approx(force / 56.8, rel=1e-3, abs=1e-9)
    assert got[-1, FORCE] == pytest.approx(force, rel=1e-3, abs=1e-9)
    assert got[-1, Y] == pytest.approx(2.5e-5 * force, rel=1e-3, abs=1e-12)
    assert abs(got[0, FORCE]) < 0.01 * abs(force) + 1e-9  # at first none of it is there
