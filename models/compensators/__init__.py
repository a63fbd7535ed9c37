"""Compensators of the actuator's delay: one file each, listed here.

A method is a file with `Params`, `RULES` and `step`; one with a memory adds `state`, the array at rest, and
one with derived numbers adds `pack`, which appends them to the parameters. It is added by its line in
`COMPENSATORS` and one in `fed_forward`, or in `fed_back` where it takes the measurement.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from common.errors import InputError
from common.plan.schema import Rule, nearest
from models import registry
from models.compensators import (
    amb,
    ats,
    horiuchi,
    inverse,
    none,
    pi_lead,
    pid,
    pid_inverse,
    pid_taylor,
    series,
    taylor,
)
from models.compensators.wanted import Wanted
from models.compiled import jit
from models.registry import Array

FEEDBACK = (1, 3, 6, 7, 8, 10)  # codes of methods that take the measurement
WHOLE = ("order",)  # parameters that count something


def as_given(params: Array, _interval: float) -> Array:
    """The parameters of a method that derives nothing from them."""
    return params


def no_memory(_params: Array, _interval: float) -> Array:
    """The memory of a method that keeps nothing."""
    return np.zeros(0)


@dataclass(frozen=True)
class Compensator:
    """One method: its code in `step`, its parameters with their ranges, derived numbers, memory at rest."""

    code: int
    params: type[Any]
    rules: Mapping[str, Rule]
    state: Callable[[Array, float], Array] = no_memory  # of the packed parameters
    pack: Callable[[Array, float], Array] = as_given


COMPENSATORS = {
    "none": Compensator(0, none.NoParams, none.RULES),
    "pid": Compensator(1, pid.PidParams, pid.RULES, pid.state),
    "taylor": Compensator(2, taylor.TaylorParams, taylor.RULES),
    "pid_taylor": Compensator(3, pid_taylor.PidTaylorParams, pid_taylor.RULES, pid.state),
    "horiuchi": Compensator(4, horiuchi.HoriuchiParams, horiuchi.RULES, horiuchi.state, horiuchi.pack),
    "inverse": Compensator(5, inverse.InverseParams, inverse.RULES, pack=inverse.pack),
    "pid_inverse": Compensator(
        6, pid_inverse.PidInverseParams, pid_inverse.RULES, pid.state, pid_inverse.pack
    ),
    "ats": Compensator(7, ats.AtsParams, ats.RULES, ats.state, ats.pack),
    "pi_lead": Compensator(8, pi_lead.PiLeadParams, pi_lead.RULES, pi_lead.state, pi_lead.pack),
    "series": Compensator(9, series.SeriesParams, series.RULES),
    "amb": Compensator(10, amb.AmbParams, amb.RULES, amb.state, amb.pack),
}


class Built(NamedTuple):
    """A compensator with its memory, which `step` moves on."""

    code: int
    params: Array
    state: Array


STILL = Wanted(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def build(kind: str, parameters: Mapping[str, float], interval: float, table: str = "compensator") -> Built:
    """Code, packed parameters and memory at rest of a compensator; `interval` in s, `table` of the plan for errors.

    Raises:
        InputError: the kind or a parameter is unknown, missing, not finite or out of its range.
    """
    if kind not in COMPENSATORS:
        raise InputError(f"Unknown compensator '{kind}' in [{table}]: {nearest(kind, COMPENSATORS)}")
    method = COMPENSATORS[kind]
    what = f"compensator '{kind}' in [{table}]"
    values = registry.pack(method.params, parameters, what)
    for name, value in method.params(*values.tolist())._asdict().items():
        rule = method.rules[name]
        if not rule.admits(value):
            raise InputError(f"{name} of {what} is {value:g}, but must be {rule.allowed()}.")
        if name in WHOLE and not value.is_integer():
            raise InputError(f"{name} of {what} is {value:g}, but must be a whole number.")
    params = method.pack(values, interval)
    return Built(method.code, params, method.state(params, interval))


@jit
def fed_forward(compensator: Built, wanted: Wanted) -> float:
    """Command (m) of a method that does not use the measurement; the target where the code is not one of these."""
    code, p, s = compensator.code, compensator.params, compensator.state
    command = wanted.target
    if code == 2:
        command = taylor.step(p, wanted)
    elif code == 4:
        command = horiuchi.step(p, s, wanted)
    elif code == 5:
        command = inverse.step(p, wanted)
    elif code == 9:
        command = series.step(p, wanted)
    return command


@jit
def fed_back(compensator: Built, wanted: Wanted, interval: float) -> float:
    """Command (m) of a method that takes the measurement."""
    code, p, s = compensator.code, compensator.params, compensator.state
    command = wanted.target
    if code == 1:
        command = pid.step(p, s, wanted, interval)
    elif code == 3:
        command = pid_taylor.step(p, s, wanted, interval)
    elif code == 6:
        command = pid_inverse.step(p, s, wanted, interval)
    elif code == 7:
        command = ats.step(p, s, wanted, interval)
    elif code == 8:
        command = pi_lead.step(p, s, wanted, interval)
    elif code == 10:
        command = amb.step(p, s, wanted, interval)
    return command


@jit
def enter(
    compensator: tuple[Any, ...],
    target: float,
    rate: float,
    acceleration: float,
    jerk: float,
    present: float,
    measured: float,
    interval: float,
) -> float:
    """`step` for a caller outside compiled code, which holds the compensator as `compiled.plain` gives it."""
    wanted = Wanted(target, rate, acceleration, jerk, present, measured)
    return step(Built(*compensator), wanted, interval)


@jit
def step(compensator: Built, wanted: Wanted, interval: float) -> float:
    """Command (m) to be reached at t_{k+1}, the end of the interval (s); the compensator's memory moves on."""
    if compensator.code in FEEDBACK:
        return fed_back(compensator, wanted, interval)
    return fed_forward(compensator, wanted)
