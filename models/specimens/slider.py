"""A slider behind a joint with play: a friction damper, whose displacement is imposed.

The joint carries h(z) at its deformation z: nothing within its play w, and its stiffness k outside. It takes all of an
increment until it carries the friction, which differs by direction; from there on the slider moves:

    h(z) = k·(z − clip(z, ±w/2)),    or, with round corners of length s,
    h(z) = k·s·[ln(1 + exp((z − w/2)/s)) − ln(1 + exp((−z − w/2)/s))]

Round corners stand for bolts and pads that do not all touch at once. Where a motion begins to slide follows from the
inverse of h, so that an increment of any size is exact.

Not to be confused with `bilinear`, whose limits are the same both ways and which has no play, or `pinched`, whose
reloading aims at the largest deformation so far.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from common.plan.schema import Rule
from models.compiled import jit
from models.registry import Array


class SliderParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # k, N/m
    push: float  # F₊, N
    pull: float  # F₋, N
    play: float = 0.0  # w, m
    corner: float = 0.0  # s, m


RULES = {
    "stiffness": Rule("stiffness of the joint outside its play", "N/m", above=0.0),
    "push": Rule("friction while it is pushed", "N", above=0.0),
    "pull": Rule("friction while it is pulled", "N", above=0.0),
    "play": Rule("whole play of the joint", "m", least=0.0),
    "corner": Rule("length over which the joint closes", "m", least=0.0),
}
STIFFNESS, PUSH, PULL, PLAY, CORNER = range(5)

DEFORMATION, JOINT = range(2)  # δ and z of the last call, m
STATE_SIZE = 2
SHARP = 30.0  # deformation beyond the play over `corner` from which on a round corner is left behind: e⁻³⁰ is nothing


@jit
def softplus(x: float) -> float:
    """ln(1 + eˣ) without overflow."""
    return x + math.log1p(math.exp(-x)) if x > 0.0 else math.log1p(math.exp(x))


@jit
def carried(p: Array, z: float) -> float:
    """Force (N) of the joint at its deformation `z` (m)."""
    half, s = 0.5 * p[PLAY], p[CORNER]
    if s <= 0.0:
        return float(p[STIFFNESS] * (z - min(max(z, -half), half)))
    return float(p[STIFFNESS] * s * (softplus((z - half) / s) - softplus((-z - half) / s)))


@jit
def farthest(p: Array, friction: float) -> float:
    """Deformation (m) of the joint at which it carries a friction (N): the inverse of `carried`."""
    half, s, elastic = 0.5 * p[PLAY], p[CORNER], friction / p[STIFFNESS]
    if elastic > SHARP * s:
        return float(half + elastic)
    beyond, opposite = math.expm1(elastic / s), 4.0 * math.exp((elastic - p[PLAY]) / s)
    return float(half + s * math.log(0.5 * (beyond + math.sqrt(beyond * beyond + opposite))))


@jit
def moved(p: Array, s: Array, deformation: float, level: float) -> float:
    """Force (N) at a deformation (m) reached from that of the last call, with the share `level` of the friction."""
    increment = deformation - s[DEFORMATION]
    z = s[JOINT] + increment
    if increment > 0.0:
        z = min(z, farthest(p, level * p[PUSH]))
    elif increment < 0.0:
        z = max(z, -farthest(p, level * p[PULL]))
    s[DEFORMATION], s[JOINT] = deformation, z
    return float(carried(p, z))


@jit
def step(p: Array, s: Array, deformation: float) -> float:
    """Force (N) at a deformation (m) reached from that of the last call; `s` (2,) moves on."""
    return float(moved(p, s, deformation, 1.0))
