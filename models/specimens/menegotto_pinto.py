"""Steel of Menegotto and Pinto with the asymptotes of Filippou, Popov and Bertero: curved branches between two lines.

    f* = b·δ* + (1 − b)·δ*/(1 + |δ*|^R)^(1/R),    δ* = (δ − δ_r)/(δ_0 − δ_r),  f* = (f − f_r)/(f_0 − f_r)
    R = R₀·(1 − c₁·ξ/(c₂ + ξ)),  ξ = |δ_far − δ_0|/δ_y

(δ_r, f_r) is the last reversal, (δ_0, f_0) where the elastic line from there meets the line of hardening, δ_far the
largest deformation so far on the side that the motion goes to.

M. Menegotto and P. E. Pinto, IABSE Symposium Lisbon (1973), 15-22; F. C. Filippou, E. P. Popov and V. V. Bertero,
Effects of bond deterioration on hysteretic behavior of reinforced concrete joints, UCB/EERC-83/19 (1983).

A branch begins at every reversal, however small, as the authors have it: a small unloading and reloading forgets the
branch before and overshoots it. With a least turn the branch goes on through smaller reversals, back and forth, as
noise in a motion makes them. Not to be confused with the smooth law of Bouc and Wen, whose loop is not sharper
after the first yielding than later.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.plan.schema import Rule
from models.compiled import jit
from models.registry import Array


class MenegottoPintoParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_y, m
    hardening: float = 0.0  # b, stiffness after yielding over elastic stiffness
    sharpness: float = 20.0  # R₀
    loss: float = 0.925  # c₁, share of the sharpness that large excursions take
    loss_at: float = 0.15  # c₂, excursion over δ_y at which half of that is lost
    least_turn: float = 0.0  # reversal over δ_y below which the branch goes on


RULES = {
    "stiffness": Rule("elastic stiffness", "N/m", least=0.0),
    "yield_displacement": Rule("deformation at first yield", "m", above=0.0),
    "hardening": Rule("stiffness after yielding over elastic stiffness", above=-1.0, most=0.99),
    "sharpness": Rule("sharpness of the first yielding", least=1.0, most=100.0),
    "loss": Rule("share of the sharpness that large excursions take", least=0.0, most=0.99),
    "loss_at": Rule("excursion over the yield deformation at which half of that is lost", above=0.0),
    "least_turn": Rule(
        "reversal over the yield deformation below which a branch goes on", least=0.0, most=0.1
    ),
}
STIFFNESS, YIELD_DISPLACEMENT, HARDENING, SHARPNESS, LOSS, LOSS_AT, LEAST_TURN = range(7)

# farthest on the branch: δ (m), f (N), way (±1, 0 before any motion); start and aim of the branch, R; both peaks (m)
DEFORMATION, FORCE, WAY, START, START_FORCE, AIM, AIM_FORCE, BENT, TOP, BOTTOM = range(10)
STATE_SIZE = 10


@jit
def turn(p: Array, s: Array, way: float) -> None:
    """Begin a branch at the farthest deformation and force of the one before, towards `way`."""
    k, limit, b = p[STIFFNESS], p[YIELD_DISPLACEMENT], p[HARDENING]
    s[START] = s[DEFORMATION]
    s[START_FORCE] = s[FORCE]
    s[TOP] = max(s[TOP], s[DEFORMATION], limit)
    s[BOTTOM] = min(s[BOTTOM], s[DEFORMATION], -limit)
    s[AIM] = (way * (1.0 - b) * k * limit - s[FORCE] + k * s[DEFORMATION]) / (k * (1.0 - b))
    s[AIM_FORCE] = s[FORCE] + k * (s[AIM] - s[DEFORMATION])
    far = s[TOP] if way > 0.0 else s[BOTTOM]
    excursion = abs(far - s[AIM]) / limit
    s[BENT] = p[SHARPNESS] * (1.0 - p[LOSS] * excursion / (p[LOSS_AT] + excursion))
    s[WAY] = way


@jit
def bent(share: float, sharpness: float) -> tuple[float, float]:
    """`δ*/(1 + |δ*|^R)^(1/R)` and its derivative, without a power that could overflow."""
    size = abs(share)
    if size <= 1.0:
        power = size**sharpness
        divisor = (1.0 + power) ** (1.0 / sharpness)
        return share / divisor, 1.0 / (divisor * (1.0 + power))
    power = size ** (-sharpness)
    curved = (1.0 + power) ** (-1.0 / sharpness)
    return float(np.copysign(curved, share)), curved * power / (size * (1.0 + power))


@jit
def on_branch(p: Array, s: Array, deformation: float) -> tuple[float, float]:
    """Force (N) and stiffness (N/m) at a deformation (m) on the branch of the state."""
    length = s[AIM] - s[START]
    if length * s[WAY] <= 0.0:  # the reversal lies beyond the line of hardening already
        slope = p[HARDENING] * p[STIFFNESS]
        return s[START_FORCE] + slope * (deformation - s[START]), slope
    share = (deformation - s[START]) / length
    curved, steep = bent(share, s[BENT])
    height = s[AIM_FORCE] - s[START_FORCE]
    force = s[START_FORCE] + (p[HARDENING] * share + (1.0 - p[HARDENING]) * curved) * height
    return force, (p[HARDENING] + (1.0 - p[HARDENING]) * steep) * height / length


@jit
def step(p: Array, s: Array, deformation: float) -> float:
    """Force (N) at a deformation (m) reached from those of the calls before; `s` (10,) moves on."""
    moved = deformation - s[DEFORMATION]
    if moved == 0.0:
        return s[FORCE]
    way = 1.0 if moved > 0.0 else -1.0
    if way != s[WAY] and (s[WAY] == 0.0 or abs(moved) > p[LEAST_TURN] * p[YIELD_DISPLACEMENT]):
        turn(p, s, way)
    force = on_branch(p, s, deformation)[0]
    if way == s[WAY]:
        s[DEFORMATION] = deformation
        s[FORCE] = force
    return force


@jit
def looked_at(p: Array, s: Array, deformation: float, spare: Array) -> tuple[float, float]:
    """Force (N) and stiffness (N/m) that `step` would reach at a deformation (m); `spare` (10,) is written over.

    The least turn is taken as 0.
    """
    moved = deformation - s[DEFORMATION]
    if moved == 0.0 and s[WAY] == 0.0:
        return 0.0, p[STIFFNESS]
    if moved * s[WAY] >= 0.0 and s[WAY] != 0.0:
        return on_branch(p, s, deformation)
    for place in range(STATE_SIZE):
        spare[place] = s[place]
    turn(p, spare, 1.0 if moved > 0.0 else -1.0)
    return on_branch(p, spare, deformation)
