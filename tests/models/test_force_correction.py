"""The high-pass correction of the measured force against its transfer function."""

from __future__ import annotations

import math

import numpy as np
import pytest

from common.plan import ForceCorrection
from models import force_correction

DT = 0.002


def response(correction: ForceCorrection, frequency: float) -> complex:
    memory, gain = force_correction.coefficients(correction, DT)
    state, omega = np.zeros(2), 2.0 * math.pi * frequency
    t = np.arange(20_000) * DT
    given = np.sin(omega * t)
    out = np.array([force_correction.step(memory, gain, state, float(x)) for x in given])
    turn = np.exp(-1j * omega * t)
    return complex(np.sum((out * turn)[10_000:]) / np.sum((given * turn)[10_000:]))


@pytest.mark.parametrize("frequency", [0.5, 1.0, 2.0, 5.0])
def test_it_is_the_filter_of_its_formula(frequency: float) -> None:
    correction = ForceCorrection(cutoff=0.3, unity=2.0)
    ratio = 0.3 / frequency
    wanted = math.hypot(1.0, 0.15) / complex(1.0, -ratio)
    assert response(correction, frequency) == pytest.approx(wanted, abs=2e-3)


def test_without_cutoff_the_force_is_left_alone() -> None:
    memory, gain = force_correction.coefficients(ForceCorrection(), DT)
    assert force_correction.step(memory, gain, np.zeros(2), 1234.5) == 1234.5


def test_a_constant_force_is_lost() -> None:
    memory, gain = force_correction.coefficients(ForceCorrection(cutoff=0.3), DT)
    state = np.zeros(2)
    out = [force_correction.step(memory, gain, state, 1.0) for _ in range(10_000)]
    assert abs(out[-1]) < 1e-6
