"""The actuator's path: its delay follows the phase from frequency zero, and an unstable path is reported."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from common.plan import read as plans
from common.plan.laboratory_tables import CompensatorTable
from common.plan.plan import Plan
from loop.nominal import partition, preflight
from loop.nominal.path import path_at
from tests.helpers import with_table

# coarse, so that a path is followed in milliseconds; its interval is a fortieth of the first mode's period
COARSE = plans.parse(
    "[test]\ninterval = 0.0125\n[compensator]\nkind = 'none'\n[control]\namd = false\n", Path()
)


def led(plan: Plan, delay: float, lead: float, proportional: float = 0.0) -> Plan:
    """The plan with an actuator of that dead time, and a feedforward beside proportional feedback."""
    gains = {"lead": lead, "proportional": proportional, "integral": 0.0, "derivative": 0.0}
    kind = (
        CompensatorTable("pid_taylor", gains)
        if proportional
        else CompensatorTable("taylor", {"lead": lead, "order": 1.0})
    )
    return replace(with_table(plan, "actuator", delay=delay), compensator=kind)


def swept(delay: float, lead: float, proportional: float, frequency: float, interval: float) -> float:
    """Delay by the closed form `(1 + τs + P)·G/(1 + P·G)`, its phase followed from zero in steps of 0.01 Hz.

    The ramp of a command takes half an interval; the measurement that is fed back is one older than the command's end.
    """
    phase = before = 0.0
    for f in np.arange(0.01, frequency + 0.005, 0.01):
        s = 2j * math.pi * f
        half = (cmath.exp(s * interval / 2) - cmath.exp(-s * interval / 2)) / (s * interval)
        ramp = half**2
        plant = ramp * cmath.exp(-s * delay) / (1.0 + 0.030 * s)
        now = cmath.phase(
            (1.0 + lead * s + proportional * cmath.exp(-s * interval))
            * plant
            / (1.0 + proportional * plant * cmath.exp(-s * interval))
        )
        phase += math.remainder(now - before, 2.0 * math.pi)
        before = now
    return -phase / (2.0 * math.pi * f)


@pytest.mark.parametrize(
    ("delay", "lead", "proportional"),
    [
        (0.2, 0.0, 0.0),
        (0.35, 0.05, 0.0),
        (0.5, 0.1, 0.0),
        (0.9, 0.0, 0.0),
        (0.014, 0.044, 1.93),
        (0.2, 0.03, 0.5),
    ],
)
def test_the_delay_agrees_with_the_phase_of_the_closed_form_followed_from_frequency_zero(
    delay: float, lead: float, proportional: float
) -> None:
    plan = led(with_table(COARSE, "test", interval=0.005), delay, lead, proportional)
    expected = swept(delay, lead, proportional, 2.0, 0.005)
    assert path_at(plan, 2.0).delay == pytest.approx(expected, abs=5e-4)


@pytest.mark.parametrize(
    ("delay", "stable"), [(0.034, True), (0.036, True), (0.039, False), (0.05, False), (0.2, False)]
)
def test_an_actuator_that_is_unstable_under_its_compensator_is_reported(
    default_plan: Plan, delay: float, stable: bool
) -> None:
    """By hand: `|P/(1 + jωT)| = 1` at 55 rad/s, where the phase leaves 38.4 ms for dead time and sampling."""
    found = path_at(with_table(default_plan, "actuator", delay=delay), 2.0)
    assert found.stable is stable
    assert math.isfinite(found.delay) is stable


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    some.tuples(some.floats(0.0, 0.5), some.floats(0.0, 0.5)).map(sorted),
    some.floats(0.0, 0.1),
    some.sampled_from([0.0, 0.0, 0.3, 1.93]),
    some.integers(1, 3),
)
def test_the_expected_delay_does_not_decrease_with_the_actuators_delay(
    delays: list[float], lead: float, proportional: float, storeys: int
) -> None:
    n = storeys
    plan = with_table(COARSE, "structure", mass=[160e3] * n, stiffness=[25e6] * n, damping=[2e5] * n)
    short, long = (
        preflight.expected_delay(plan, partition.assess(led(plan, delay, lead, proportional)))
        for delay in delays
    )
    assert long >= short - 1e-4  # of a path whose compensator weakens the longer delay nearly to the same
    if not proportional:
        assert long - short == pytest.approx(delays[1] - delays[0], abs=2e-3)
