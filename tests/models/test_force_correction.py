"""The high-pass correction of the measured force against its transfer function."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from common.plan import read as plans
from common.plan.laboratory_tables import ForceCorrection
from common.terminal import cli
from models import force_correction
from validation.paper.experiments import free_damping, without_amd

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
def test_the_force_correction_has_the_transfer_function_of_its_formula(frequency: float) -> None:
    correction = ForceCorrection(cutoff=0.3, unity=2.0)
    ratio = 0.3 / frequency
    wanted = math.hypot(1.0, 0.15) / complex(1.0, -ratio)
    assert response(correction, frequency) == pytest.approx(wanted, abs=2e-3)


def test_without_a_cutoff_the_force_is_unchanged() -> None:
    memory, gain = force_correction.coefficients(ForceCorrection(), DT)
    assert force_correction.step(memory, gain, np.zeros(2), 1234.5) == 1234.5


def test_a_constant_force_is_filtered_out() -> None:
    memory, gain = force_correction.coefficients(ForceCorrection(cutoff=0.3), DT)
    state = np.zeros(2)
    out = [force_correction.step(memory, gain, state, 1.0) for _ in range(10_000)]
    assert abs(out[-1]) < 1e-6


@pytest.mark.parametrize(("cutoff", "percent"), [(0.0, 3.1), (0.3, 5.0)])
def test_in_the_closed_loop_the_filters_lead_restores_the_damping_lost_by_the_papers_delay(
    cutoff: float, percent: float
) -> None:
    """0.3 Hz leads by atan(0.15)/12.5 = 11.9 ms at 2 Hz, against the paper's residual 12 ms."""
    plan = without_amd(plans.load(cli.plan_path("paper")))
    correction = ForceCorrection(cutoff=cutoff, unity=2.0)
    plan = replace(plan, compensator=replace(plan.compensator, force=correction))
    assert 100.0 * free_damping(plan)[1] == pytest.approx(percent, abs=0.1)
