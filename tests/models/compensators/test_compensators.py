"""Compensators against what their papers say they do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from common.errors import InputError
from common.plan import Actuator, Column
from models import compensators
from models.compensators import COMPENSATORS
from models.labs import column_lab

DT = 0.002
GAINS = {"proportional": 1.93, "integral": 0.047, "derivative": 0.0}


def residual_delay(kind: str, parameters: dict[str, float], frequency: float = 1.0) -> float:
    """Delay (s) of the nominal actuator behind a compensator for a sine target, from the phase of steady state."""
    code, p = compensators.build(kind, parameters)
    memory = np.zeros(compensators.STATE_SIZE)
    lab = column_lab.build(DT, Actuator(), Column())
    omega, ticks, measured = 2.0 * math.pi * frequency, 6000, 0.0
    targets, readings = np.zeros(ticks), np.zeros(ticks)
    for tick in range(ticks):
        now, end = math.sin(omega * tick * DT), omega * (tick + 1) * DT
        targets[tick], readings[tick] = now, measured
        slope = omega * math.cos(end), -(omega**2) * math.sin(end)
        command = compensators.step(code, p, memory, math.sin(end), *slope, now - measured, DT)
        measured, _ = column_lab.advance(*lab, command)
    tail = slice(ticks // 2, None)
    turn = np.exp(-1j * omega * DT * np.arange(ticks))[tail]
    return float(-np.angle(np.sum(readings[tail] * turn) / np.sum(targets[tail] * turn)) / omega)


@pytest.mark.parametrize(
    ("kind", "parameters", "expected", "tolerance"),
    [
        ("none", {}, 0.044, 0.0005),
        ("taylor", {"lead": 0.044, "order": 1}, 0.0, 0.001),
        ("taylor", {"lead": 0.044, "order": 2}, 0.0, 0.0015),
        ("pid", GAINS, 0.044 / 2.93, 0.0015),
        ("pid_taylor", {**GAINS, "lead": 0.0088}, 0.012, 0.001),
        ("pid_taylor", {**GAINS, "lead": 0.044}, 0.0, 0.0015),
    ],
)
def test_the_residual_delay_is_the_one_of_theory(
    kind: str, parameters: dict[str, float], expected: float, tolerance: float
) -> None:
    assert residual_delay(kind, parameters) == pytest.approx(expected, abs=tolerance)


@pytest.mark.parametrize("kind", COMPENSATORS)
def test_a_still_target_is_left_alone(kind: str) -> None:
    names = COMPENSATORS[kind].params._fields
    code, p = compensators.build(kind, dict.fromkeys(names, 1.0))
    assert compensators.step(code, p, np.zeros(compensators.STATE_SIZE), 0.5, 0.0, 0.0, 0.0, DT) == 0.5


def test_the_pid_terms_are_those_of_equation_3() -> None:
    code, p = compensators.build("pid", {"proportional": 2.0, "integral": 3.0, "derivative": 0.5})
    memory = np.zeros(compensators.STATE_SIZE)
    errors = [0.0, 0.1, 0.3, 0.2]
    got = [compensators.step(code, p, memory, 1.0, 0.0, 0.0, error, DT) for error in errors]
    integral = np.concatenate([[0.0], np.cumsum(DT * 0.5 * np.add(errors[1:], errors[:-1]))])
    slopes = np.diff(errors, prepend=0.0) / DT
    assert got == pytest.approx(1.0 + 2.0 * np.array(errors) + 3.0 * integral + 0.5 * slopes)


def test_unknown_names_are_refused_with_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean taylor"):
        compensators.build("tailor", {})
    with pytest.raises(
        InputError, match="Unknown parameter 'led' of compensator 'taylor'.*did you mean lead"
    ):
        compensators.build("taylor", {"led": 0.1, "order": 1})
    with pytest.raises(InputError, match="Parameter 'order' of compensator 'taylor'.* is missing"):
        compensators.build("taylor", {"lead": 0.1})
