"""No compensation: the command is the target."""

from __future__ import annotations

from typing import NamedTuple

from models.compiled import jit


class Params(NamedTuple):
    """No parameters."""


@jit
def step(target: float) -> float:
    """The target (m) itself."""
    return target
