"""Masing's hysteresis over a skeleton of three straight lines: a spring beside two springs with sliders.

    f = α·k·δ + (1 − m)·k·z₁ + (m − α)·k·z₂,    zᵢ = z + Δδ clipped to ±c·δ_y and ±δ_y

The skeleton has the stiffness k up to c·δ_y, m·k up to δ_y and α·k beyond. Every branch after a reversal is the
skeleton at twice its size; a branch that meets the one before continues along it. Both sliders are exact for an
increment of any size.

W. D. Iwan, A distributed-element model for hysteresis and its steady-state dynamic response, J. Appl. Mech. 33 (1966),
893-900, with two elements. Not to be confused with `pinched`, whose reloading aims at the largest deformation so far.
"""

from __future__ import annotations

from typing import NamedTuple

from common.plan.schema import Rule
from models.compiled import jit
from models.registry import Array


class TrilinearParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_y, m, deformation where the third line begins
    hardening: float = 0.0  # α, stiffness of the third line over the first
    first_bend: float = 0.5  # c, deformation where the second line begins over δ_y
    second_stiffness: float = 0.5  # m, stiffness of the second line over the first


RULES = {
    "stiffness": Rule("elastic stiffness", "N/m", least=0.0),
    "yield_displacement": Rule("deformation where the third line begins", "m", above=0.0),
    "hardening": Rule("stiffness of the third line over the first", above=-1.0, most=1.0),
    "first_bend": Rule(
        "deformation where the second line begins over yield_displacement", least=0.0, most=1.0
    ),
    "second_stiffness": Rule("stiffness of the second line over the first", least=0.0, most=1.0),
}
STIFFNESS, YIELD_DISPLACEMENT, HARDENING, FIRST_BEND, SECOND_STIFFNESS = range(5)

DEFORMATION, FIRST, SECOND = range(3)  # δ, z₁ and z₂ of the last call, m
STATE_SIZE = 3


def fault(p: TrilinearParams) -> str:
    """A sentence if parameters that are each within their range do not fit together, otherwise empty."""
    if p.second_stiffness < p.hardening:
        return (
            f"second_stiffness is {p.second_stiffness:g}, but must be at least hardening ({p.hardening:g}), because a "
            "slider cannot have a negative stiffness"
        )
    return ""


@jit
def step(p: Array, s: Array, deformation: float) -> float:
    """Force (N) at a deformation (m), reached from that of the last call; `s` (3,) is updated."""
    moved = deformation - s[DEFORMATION]
    limit = p[YIELD_DISPLACEMENT]
    bend = p[FIRST_BEND] * limit
    first = min(max(s[FIRST] + moved, -bend), bend)
    second = min(max(s[SECOND] + moved, -limit), limit)
    s[DEFORMATION] = deformation
    s[FIRST] = first
    s[SECOND] = second
    sliding = (1.0 - p[SECOND_STIFFNESS]) * first + (p[SECOND_STIFFNESS] - p[HARDENING]) * second
    force: float = p[STIFFNESS] * (p[HARDENING] * deformation + sliding)
    return force
