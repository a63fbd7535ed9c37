"""Self-centring specimen: a flag-shaped loop on each side of the origin, as a post-tensioned frame has it.

On each side of the origin the force changes with the stiffness k between two lines; for δ > 0 these are

    upper: k·δ up to δ_a, then k·δ_a + α·k·(δ − δ_a)
    lower: k·δ up to (1 − β)·δ_a, then k·(1 − β)·δ_a + α·k·(δ − (1 − β)·δ_a)

C. Christopoulos, R. Tremblay, H.-J. Kim and M. Lacerte, Self-centering energy dissipative bracing system for the
seismic resistance of structures, J. Struct. Eng. ASCE 134 (2008), 96-107, without their slip and bearing. Every branch
is a straight line, so an increment of any size is exact. With β = 0 it is elastic with a bend.

Not to be confused with `bilinear`, which comes to rest away from the origin, or `pinched`, whose loop encloses it.
"""

from __future__ import annotations

from typing import NamedTuple

from common.plan.schema import Rule
from models.compiled import jit
from models.registry import Array


class SelfCentringParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_a, m, deformation where the upper line bends
    hardening: float = 0.0  # α, stiffness beyond the bend over the elastic stiffness
    loop: float = 0.5  # β, by which the lower line bends earlier; the flag is β·(1 − α)·k·δ_a high


RULES = {
    "stiffness": Rule("elastic stiffness", "N/m", least=0.0),
    "yield_displacement": Rule("deformation where the upper line bends", "m", above=0.0),
    "hardening": Rule("stiffness beyond the bend over elastic stiffness", above=-1.0, most=1.0),
    "loop": Rule("share of the upper line's bend by which the lower one bends earlier", least=0.0, most=1.0),
}
STIFFNESS, YIELD_DISPLACEMENT, HARDENING, LOOP = range(4)

DEFORMATION, STRETCHED = range(2)  # δ of the last call and f/k there, m
STATE_SIZE = 2


@jit
def line(p: Array, size: float, bend: float) -> float:
    """Force over k (m) at a deformation (m) of a line that bends."""
    return size if size <= bend else bend + p[HARDENING] * (size - bend)


@jit
def step(p: Array, s: Array, deformation: float) -> float:
    """Force (N) at a deformation (m), reached from that of the last call; `s` (2,) is updated."""
    bend = p[YIELD_DISPLACEMENT]
    # the other side is entered at the origin, because the flag of the side that is left closes there
    crossed = deformation * s[DEFORMATION] <= 0.0
    stretched = deformation if crossed else s[STRETCHED] + deformation - s[DEFORMATION]
    sign, size = (1.0, deformation) if deformation >= 0.0 else (-1.0, -deformation)
    low, high = line(p, size, (1.0 - p[LOOP]) * bend), line(p, size, bend)
    stretched = sign * min(max(sign * stretched, min(low, high)), high)
    s[DEFORMATION] = deformation
    s[STRETCHED] = stretched
    force: float = p[STIFFNESS] * stretched
    return force
