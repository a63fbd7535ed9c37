"""Smooth laws of yielding against closed forms and each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from models.specimens.fit import forces
from models.system import ColumnEffects
from tests.laboratories.effects.histories import K, cycles, specimen_under


def test_an_endochronic_column_loads_by_an_exponential_and_unloads_more_steeply() -> None:
    """With n = 1 and no hardening z = 1 − exp(−δ/δ_y) on the way out, and back dz/dδ = (1 + z)/δ_y at first."""
    limit = 1e-3
    path = np.concatenate([np.linspace(0.0, 3e-3, 301)[1:], 3e-3 - np.linspace(0.0, 1e-3, 1001)[1:]])
    more = ColumnEffects(yield_displacement=limit, hardening=0.0, exponent=1.0, law=12.0, yield_loop=1.0)
    z = specimen_under(path, more) / (K * limit)
    assert z[:300] == pytest.approx(1.0 - np.exp(-path[:300] / limit), abs=1e-6)
    back = (z[300] - z[299]) / (path[300] - path[299]) * limit
    assert back == pytest.approx(1.0 + z[299], rel=1e-3)
    half = replace(more, yield_loop=0.5)
    assert specimen_under(path, half) == pytest.approx(
        specimen_under(path, replace(half, law=0.0)), rel=1e-12
    )


def test_a_column_that_degrades_and_pinches_is_that_specimen_and_without_loss_the_endochronic_one() -> None:
    _, path = cycles(4e-3, 1.0)
    whole = ColumnEffects(yield_displacement=1e-3, law=13.0, hardening=0.02, exponent=1.5, yield_loop=0.7)
    lost = replace(whole, strength_loss=0.05, stiffness_loss=0.08)
    pinched = replace(
        lost, pinch_depth=0.6, pinch_place=0.2, pinch_rate=0.4, pinch_width=0.4, pinch_spread=0.3
    )
    named = {"n": 1.5, "beta": 0.7, "gamma": 0.3, "delta_nu": 0.05, "delta_eta": 0.08, "delta_psi": 0.0}
    named |= {"zeta_s": 0.6, "q": 0.2, "p": 0.4, "psi": 0.4, "lambda_": 0.3}
    same = {"stiffness": K, "yield_displacement": 1e-3, "hardening": 0.02, **named}
    assert specimen_under(path, pinched) == pytest.approx(
        forces("bwbn", same, np.asarray(path, dtype=np.float64)), rel=1e-12
    )
    assert specimen_under(path, whole) == pytest.approx(
        specimen_under(path, replace(whole, law=12.0)), rel=1e-5, abs=1e-5 * K * 1e-3
    )
