"""Peak-oriented specimen of Clough and Johnston, as reinforced concrete after cracking and yielding.

    f = c·k·clip(δ, ±δ_c) + h(δ)
    skeleton of h: (1 − c)·k·δ up to δ_y, beyond it (1 − c)·k·δ_y + α·k·(δ − δ_y)
    unloading:     k_u = (1 − c)·k·(δ_y/δ_m)^a, never below the secant h_m/δ_m

R. W. Clough and S. B. Johnston, Effect of stiffness degradation on earthquake ductility requirements, Proc.
Japan Earthquake Engineering Symposium (1966), 227-232; the exponent a of T. Takeda, M. A. Sozen and
N. N. Nielsen, Reinforced concrete response to simulated earthquakes, J. Struct. Div. ASCE 96 (1970),
2557-2573. δ_m and h_m are the largest deformation so far on the side the force points to, and its force,
at first those of yielding. From zero force, and on every reversal back, h runs on a straight line to that
point of the side it moves to.

With c > 0 the skeleton of the force has a third line: a part c of the stiffness is lost at the crack
deformation δ_c and comes back when the crack closes, as under an axial load. That part stores work and
dissipates none. Every branch is a straight line, so a monotonic increment of any size is exact.

Not to be confused with Takeda's model, which has inner loops and a cracking branch that dissipates, nor with
the bilinear one, whose unloading and reloading stiffness never changes; and nothing here loses strength.
"""

from __future__ import annotations

from typing import NamedTuple

from common.plan.schema import Rule
from models.compiled import jit
from models.registry import Array


class CloughParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_y, m
    hardening: float = 0.0  # α, stiffness after yielding over elastic stiffness
    unloading: float = 0.0  # a, 0: unloading stays elastic
    crack_displacement: float = 0.0  # δ_c, m
    closing: float = 0.0  # c, share of the stiffness lost while cracks are open


RULES = {
    "stiffness": Rule("elastic stiffness", "N/m", least=0.0),
    "yield_displacement": Rule("deformation at first yield", "m", above=0.0),
    "hardening": Rule("stiffness after yielding over elastic stiffness", least=0.0, most=1.0),
    "unloading": Rule("exponent of the unloading stiffness", least=0.0, most=1.0),
    "crack_displacement": Rule("deformation at which cracks open", "m", least=0.0),
    "closing": Rule("share of the stiffness lost while cracks are open", least=0.0, most=0.99),
}
STIFFNESS, YIELD_DISPLACEMENT, HARDENING, UNLOADING, CRACK_DISPLACEMENT, CLOSING = range(6)

DEFORMATION, HYSTERETIC, TOP, BOTTOM = range(4)  # δ (m), h (N) and both peaks (m, as sizes) of the last call
STATE_SIZE = 4


def fault(p: CloughParams) -> str:
    """What is wrong with a combination of parameters that are each in their range; empty where nothing is."""
    if p.closing > 0.0 and p.crack_displacement <= 0.0:
        return "closing is above 0, so crack_displacement must be, too"
    if p.hardening + p.closing > 1.0:
        return (
            f"hardening + closing is {p.hardening + p.closing:g}, but must be at most 1, "
            f"or yielding stiffens the column"
        )
    return ""


@jit
def skeleton(p: Array, size: float) -> float:
    """Force (N) of the hysteretic part at a deformation (m) of at least the yield deformation."""
    limit = p[YIELD_DISPLACEMENT]
    force: float = p[STIFFNESS] * ((1.0 - p[CLOSING]) * limit + p[HARDENING] * (size - limit))
    return force


@jit
def unloading_stiffness(p: Array, peak: float) -> float:
    """Stiffness (N/m) at which the force leaves the side whose largest deformation is `peak` (m)."""
    elastic = (1.0 - p[CLOSING]) * p[STIFFNESS]
    degraded = elastic * (p[YIELD_DISPLACEMENT] / peak) ** p[UNLOADING]
    return max(degraded, skeleton(p, peak) / peak)


@jit
def rise(p: Array, force: float, start: float, end: float, top: float, bottom: float) -> float:
    """Force (N) of the hysteretic part after the deformation grew from `start` to `end` (m)."""
    if force < 0.0:
        stiffness = unloading_stiffness(p, bottom)
        zero = start - force / stiffness
        if end <= zero:
            return min(force + stiffness * (end - start), 0.0)
        start, force = zero, 0.0
    if end < top:
        return force + (skeleton(p, top) - force) * ((end - start) / (top - start))
    return skeleton(p, end)


@jit
def step(p: Array, s: Array, deformation: float) -> float:
    """Force (N) at a deformation (m) reached from that of the last call; `s` (4,) moves on."""
    last = s[DEFORMATION]
    force = s[HYSTERETIC]
    top = max(s[TOP], p[YIELD_DISPLACEMENT])
    bottom = max(s[BOTTOM], p[YIELD_DISPLACEMENT])
    # a deformation that shrinks is one that grows, seen in the mirror
    if deformation >= last:
        force = rise(p, force, last, deformation, top, bottom)
    else:
        force = -rise(p, -force, -last, -deformation, bottom, top)
    s[DEFORMATION] = deformation
    s[HYSTERETIC] = force
    s[TOP] = max(top, deformation)
    s[BOTTOM] = max(bottom, -deformation)
    limit = p[CRACK_DISPLACEMENT]
    closing: float = p[CLOSING] * p[STIFFNESS] * min(max(deformation, -limit), limit)
    return closing + force
