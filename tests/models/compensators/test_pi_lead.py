"""The feedback controller of the benchmark problem against SciPy's transfer functions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from models import compensators
from models.compensators.wanted import Wanted
from models.registry import Array
from tests.models.compensators.rig import DT

FAST = 1.0 / 4096.0  # s, of the benchmark


def expected(target: Array, measured: Array, interval: float, numbers: list[float]) -> Array:
    """The output of both transfer functions in series, by Tustin's rule."""
    P, I, gain, zero, pole = numbers  # noqa: E741
    lead, bottom, _ = signal.cont2discrete(([gain, gain * zero], [1.0, pole]), interval, "bilinear")
    error = signal.lfilter(lead.ravel(), bottom, target) - measured
    loop, below, _ = signal.cont2discrete(([P, I], [1.0, 0.0]), interval, "bilinear")
    result: Array = signal.lfilter(loop.ravel(), below, error)
    return result


@pytest.mark.parametrize("interval", [DT, FAST])
@pytest.mark.parametrize("numbers", [[2.0, 95.0, 50.8, 168.6, 8570.0], [0.5, 3.0, 2.0, 20.0, 90.0]])
def test_the_command_agrees_with_the_transfer_functions(interval: float, numbers: list[float]) -> None:
    names = ("proportional", "integral", "lead_gain", "lead_zero", "lead_pole")
    built = compensators.build("pi_lead", dict(zip(names, numbers, strict=True)), interval)
    target, measured, other = np.random.default_rng(2).normal(size=(3, 600))
    got = [
        compensators.step(built, Wanted(o, o, o, o, r, y), interval)
        for r, y, o in zip(target.tolist(), measured.tolist(), other.tolist(), strict=True)
    ]
    assert got == pytest.approx(expected(target, measured, interval, numbers), rel=1e-10, abs=1e-10)


def test_the_default_parameters_of_pi_lead_are_those_of_the_benchmark() -> None:
    built = compensators.build("pi_lead", {}, DT)
    assert built.params[:5].tolist() == [2.0, 95.0, 50.8, 168.6, 8570.0]
