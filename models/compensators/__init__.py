"""Compensators of the actuator's delay: one file each, listed here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from common.errors import InputError
from common.schema import nearest
from models.compensators import none, pid, pid_taylor, taylor
from models.compiled import jit
from models.registry import Array, pack

STATE_SIZE = 4


@dataclass(frozen=True)
class Compensator:
    """One method: its code in the dispatch below and its parameters."""

    code: int
    params: type[Any]


COMPENSATORS = {
    "none": Compensator(0, none.Params),
    "pid": Compensator(1, pid.Params),
    "taylor": Compensator(2, taylor.Params),
    "pid_taylor": Compensator(3, pid_taylor.Params),
}


def build(kind: str, parameters: Mapping[str, float]) -> tuple[int, Array]:
    """Code and parameter array of a compensator; raises InputError for an unknown name or parameter."""
    if kind not in COMPENSATORS:
        raise InputError(f"Unknown compensator '{kind}' in [compensator]: {nearest(kind, COMPENSATORS)}")
    method = COMPENSATORS[kind]
    return method.code, pack(method.params, parameters, f"compensator '{kind}' in [compensator]")


@jit
def step(
    code: int,
    p: Array,
    s: Array,
    target: float,
    rate: float,
    acceleration: float,
    error: float,
    interval: float,
) -> float:
    """Command (m) to be reached at the end of the interval.

    `target` (m), `rate` (m/s) and `acceleration` (m/s²) are the target's at the interval's end; `error`
    (m) is target minus measurement at its beginning; `interval` in s. `s` holds the method's memory.
    """
    if code == 1:
        return pid.step(p, s, target, error, interval)
    if code == 2:
        return taylor.step(p, target, rate, acceleration)
    if code == 3:
        return pid_taylor.step(p, s, target, rate, error, interval)
    return none.step(target)
