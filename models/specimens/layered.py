"""A column of reinforced concrete: its foot is a section of layers of concrete and bars, the rest an elastic shaft.

    strain      ε = ε₀ + φ·y of a layer at y, over the strain at which bars yield; the section is 1 deep
    balance     N = Σ σ, the axial force, gives ε₀;  M = Σ σ·y
    deformation δ = a·φ + h·f₁/k₁,   f₁ = g·M,   k₁ = (1 − α)·k
    force       f = (1 − r/c)·f₁ + α·k·δ + r/c·k·z + e·k·δ_y,   z = z + Δδ clipped to ±c·δ_y,   c = 0.1

Bars: three layers at ±0.38 and 0, a quarter of them in the middle, each with the law of Menegotto and Pinto
(`menegotto_pinto`, hardening 0.01). Concrete: ten layers of the stiffness ρ times that of all bars together, without
tension. It is compressed along a parabola to the strength σ_c at twice the strain σ_c. Beyond, the outer layer on
either side spals: it loses the share s of its strength per strain, down to a fifth. The core loses the share κ·s, which
is little within many hoops and nearly s within few. A layer unloads and reloads along a line from the farthest point of
its parabola to the common point (ε_f, ε_f) of all such lines in tension, and is open beyond where that line has no
stress. a and g are such that the column begins with the stiffness k, of whose flexibility the shaft has the share h,
and that the outer bars of a linear column would yield at δ_y. All stresses are over the bars' yield stress, those of
the concrete over ρ times it. Cracks rub: r is their friction over k·δ_y. An axial force off the centre, or a load cell
whose zero is not the column's, is the constant force e over k·δ_y.

Crack closing, pinching, the return to the origin under the axial force, and strength that is lost while the cover spals
and the core crushes, follow from the balance. That lines of unloading meet in a point is from I. D. Karsan and J. O.
Jirsa, Behavior of concrete under compressive loadings, J. Struct. Div. ASCE 95 (1969), 2543-2563, in the form of E.
Yassin, Nonlinear analysis of prestressed concrete structures under monotonic and cyclic loads, PhD thesis, University
of California, Berkeley (1994); the layers of a section are those of E. Spacone, F. C. Filippou and F. F. Taucer, Fibre
beam-column model for non-linear analysis of R/C frames, Earthquake Engng Struct. Dyn. 25 (1996), 711-725.

An increment is divided so that strains follow it; what is left of its size is a share of 10⁻³ of the strength.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from common.plan.schema import Rule
from models.compiled import jit, jit_apart
from models.registry import Array
from models.specimens import menegotto_pinto


class LayeredParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_y, m, deformation where the outer bars of a linear column would yield
    hardening: float = (
        0.0  # α, stiffness beside the section over k; negative: the axial force leans on the column
    )
    concrete: float = 5.0  # ρ, axial stiffness of the concrete over that of the bars
    axial: float = 0.4  # N, axial force over that at which all bars yield
    strength: float = 0.5  # σ_c, strength of the concrete over its stiffness times the bars' yield strain
    spalling: float = 0.15  # s, share of the strength of the outer layers lost per strain
    sharpness: float = 18.0  # R₀ of the bars
    shaft: float = 0.6  # h, share of the flexibility that the shaft has
    focus: float = 2.0  # ε_f, strain in tension to which concrete unloads
    core: float = 0.1  # κ, share of the spalling that the core has
    friction: float = 0.0  # r, friction over k·δ_y
    eccentricity: float = 0.0  # e, constant force over k·δ_y


RULES = {
    "stiffness": Rule("elastic stiffness", "N/m", least=0.0),
    "yield_displacement": Rule(
        "deformation where the outer bars of a linear column would yield", "m", above=0.0
    ),
    "hardening": Rule("stiffness beside the section over the elastic one", above=-1.0, most=0.95),
    "concrete": Rule("axial stiffness of the concrete over that of the bars", least=0.3, most=100.0),
    "axial": Rule("axial force over that at which all bars yield", least=0.0, most=10.0),
    "strength": Rule(
        "strength of the concrete over its stiffness times the bars' yield strain", least=0.05, most=10.0
    ),
    "spalling": Rule(
        "share of their strength that outer layers lose per strain at which bars yield", least=0.0, most=1.0
    ),
    "sharpness": Rule("sharpness of the first yielding of the bars", least=1.0, most=100.0),
    "shaft": Rule("share of the elastic flexibility outside the section", least=0.05, most=0.98),
    "focus": Rule("strain in tension over that at which bars yield to which concrete unloads", least=0.1),
    "core": Rule("share of the outer layers' loss of strength that the core has", least=0.0, most=1.0),
    "friction": Rule("friction over stiffness times yield_displacement", least=0.0, most=0.09),
    "eccentricity": Rule("constant force over stiffness times yield_displacement", least=-1.0, most=1.0),
}
STIFFNESS, YIELD_DISPLACEMENT, HARDENING, CONCRETE, AXIAL, STRENGTH, SPALLING, SHARPNESS, SHAFT, FOCUS = (
    range(10)
)
CORE, FRICTION, ECCENTRICITY = range(10, 13)

HALF = 5  # layers of concrete on either side of the middle; the outer one is the cover
BAR, MIDDLE = 0.38, 0.25  # place of the outer bars over the depth, share of those in the middle
LEFT = 0.2  # strength that spalled concrete keeps
CONTACT = 0.1  # c, over the yield displacement: deformation at which friction slides
BARS_HARDEN, LOSS, LOSS_AT = 0.01, 0.925, 0.15  # of the bars' law
SLOPE = 1e-4  # least stiffness of concrete over its first, so that the balance can be solved
FINEST = 0.25  # over the yield displacement, of the parts of an increment
PARTS, ROUNDS = 100, 30  # of an increment, and of the search for a balance
NEAR, FAR = (
    1e-9,
    1.0,
)  # of the balance over the bars' yield force, from where on one more step ends at it; of a strain

# Places in the state: δ (m) and f (N) of the last call, ε₀ and φ; of the layers of either side the farthest compression
# and its stress; of the layers of bars their memories; z of the friction (m); then room for a step, and the sums of the
# section at the last balance.
DEFORMATION, FORCE, STRAIN, CURVATURE, FARTHEST, STRESS, STEEL = 0, 1, 2, 3, 4, 4 + 2 * HALF, 4 + 4 * HALF
MEMORY = menegotto_pinto.STATE_SIZE
SLIDER = STEEL + 3 * MEMORY
BARS = SLIDER + 1  # room for the parameters of the bars, and for a branch that is looked at
SPARE = BARS + len(menegotto_pinto.MenegottoPintoParams._fields)
SUMS = SPARE + MEMORY
STATE_SIZE = SUMS + 5


@jit
def envelope(p: Array, size: float, spalling: float) -> tuple[float, float]:
    """Stress and stiffness of concrete that is compressed for the first time, at a strain as a magnitude."""
    strength = p[STRENGTH]
    share = 0.5 * size / strength
    if share < 1.0:
        return strength * share * (2.0 - share), 1.0 - share
    left = 1.0 - spalling * (size - 2.0 * strength)
    return (strength * left, -spalling * strength) if left > LEFT else (strength * LEFT, 0.0)


@jit
def pressed(p: Array, size: float, farthest: float, stress: float, spalling: float) -> tuple[float, float]:
    """Stress and stiffness of concrete at a compression, after it reached the farthest one with its stress."""
    if size >= farthest and size > 0.0:
        force, slope = envelope(p, size, spalling)
        return force, max(slope, SLOPE)
    slope = (stress + p[FOCUS]) / (farthest + p[FOCUS])
    force = stress - slope * (farthest - size)
    return (force, slope) if force > 0.0 else (0.0, 0.0)


@jit
def spals(p: Array, layer: int) -> float:
    """Share of its strength that a layer of concrete loses per strain."""
    return p[SPALLING] if layer == HALF - 1 else p[CORE] * p[SPALLING]


@jit
def section(p: Array, s: Array, strain: float, curvature: float) -> None:
    """Write Σσ, Σσ·y and the derivatives of the first by ε₀ and φ and of the second by φ into the state's room."""
    bar, spare, sums = s[BARS:SPARE], s[SPARE:SUMS], s[SUMS:]
    force, stiffness = menegotto_pinto.looked_at(bar, s[STEEL : STEEL + MEMORY], strain, spare)
    total, axial = MIDDLE * force, MIDDLE * stiffness
    moment = coupled = bending = 0.0
    for place in range(HALF + 1):
        # both sides at once, so that a mirrored motion gives the mirrored force to the last bit
        if place == HALF:
            y, part = BAR, 0.5 * (1.0 - MIDDLE)
            up, above = menegotto_pinto.looked_at(
                bar, s[STEEL + MEMORY : STEEL + 2 * MEMORY], strain + curvature * y, spare
            )
            down, below = menegotto_pinto.looked_at(
                bar, s[STEEL + 2 * MEMORY : STEEL + 3 * MEMORY], strain - curvature * y, spare
            )
        else:
            y, part, loss = 0.5 * (place + 0.5) / HALF, 0.5 * p[CONCRETE] / HALF, spals(p, place)
            first, second = FARTHEST + place, FARTHEST + HALF + place
            up, above = pressed(p, -strain - curvature * y, s[first], s[first + 2 * HALF], loss)
            down, below = pressed(p, -strain + curvature * y, s[second], s[second + 2 * HALF], loss)
            up, down = -up, -down
        total += part * (up + down)
        moment += part * y * (up - down)
        axial += part * (above + below)
        coupled += part * y * (above - below)
        bending += part * y * y * (above + below)
    sums[0], sums[1], sums[2], sums[3], sums[4] = total, moment, axial, coupled, bending


@jit
def at_rest(p: Array) -> tuple[float, float]:
    """Compression of the straight column under its axial force, and the section's stiffness against curvature then."""
    strength, whole = p[STRENGTH], 1.0 + p[CONCRETE]
    curved = 0.25 * p[CONCRETE] / strength  # N = whole·c − curved·c² along the parabola
    size = 2.0 * p[AXIAL] / (whole + np.sqrt(max(whole * whole - 4.0 * curved * p[AXIAL], 0.0)))
    slope = max(1.0 - 0.5 * size / strength, SLOPE)
    bending = (1.0 - MIDDLE) * BAR * BAR
    for place in range(HALF):
        bending += p[CONCRETE] / HALF * slope * (0.5 * (place + 0.5) / HALF) ** 2
    return size, bending


@jit
def balanced(p: Array, s: Array, along: float, stiff: float) -> None:
    """Move ε₀ and φ of the state to where axial force and moment are in balance.

    The shaft has the moment `along` − `stiff`·φ. By Newton's method, in limited steps, of which the first has the
    stiffness of the last balance.
    """
    sums = s[SUMS:]
    if sums[2] == 0.0:  # no section is without stiffness, so that this one has not moved yet
        section(p, s, s[STRAIN], s[CURVATURE])
    for tried in range(ROUNDS):
        force, moment = sums[0] + p[AXIAL], sums[1] + stiff * s[CURVATURE] - along
        near = tried > 0 and abs(force) < NEAR and abs(moment) < NEAR
        axial, coupled, bending = max(sums[2], SLOPE), sums[3], sums[4] + stiff
        whole = axial * bending - coupled * coupled
        strain = (coupled * moment - bending * force) / whole
        curvature = (coupled * force - axial * moment) / whole
        most = FAR * 0.5 ** (tried // 8)  # where a step leads to and fro, shorter ones end between
        shorter = min(1.0, most / max(abs(strain), 0.5 * abs(curvature), most))
        s[STRAIN] += shorter * strain
        s[CURVATURE] += shorter * curvature
        if near:
            sums[0], sums[1] = -p[AXIAL], along - stiff * s[CURVATURE]
            return
        section(p, s, s[STRAIN], s[CURVATURE])


@jit
def kept(p: Array, s: Array) -> None:
    """Keep in the memories of all layers what they have reached at ε₀ and φ."""
    bar = s[BARS:SPARE]
    strain, curvature = s[STRAIN], s[CURVATURE]
    for side in range(2):
        way = 1.0 - 2.0 * side
        for place in range(HALF):
            size, at = -strain - way * curvature * 0.5 * (place + 0.5) / HALF, FARTHEST + side * HALF + place
            if size > s[at]:
                s[at] = size
                s[at + 2 * HALF] = envelope(p, size, spals(p, place))[0]
        menegotto_pinto.step(
            bar, s[STEEL + (1 + side) * MEMORY : STEEL + (2 + side) * MEMORY], strain + way * curvature * BAR
        )
    menegotto_pinto.step(bar, s[STEEL : STEEL + MEMORY], strain)


@jit_apart
def step(p: Array, s: Array, deformation: float) -> float:
    """Force (N) at a deformation (m) reached from that of the last call; `s` (STATE_SIZE,) is updated."""
    moved, constant = deformation - s[DEFORMATION], p[ECCENTRICITY] * p[STIFFNESS] * p[YIELD_DISPLACEMENT]
    if moved == 0.0:
        return s[FORCE] if s[CURVATURE] != 0.0 else constant
    size, bending = at_rest(p)
    if s[FORCE] == 0.0 and s[STRAIN] == 0.0:
        s[STRAIN] = -size
    bar = s[BARS:SPARE]
    bar[0], bar[1], bar[2], bar[3], bar[4], bar[5] = 1.0, 1.0, BARS_HARDEN, p[SHARPNESS], LOSS, LOSS_AT
    shaft, first = p[SHAFT], (1.0 - p[HARDENING]) * p[STIFFNESS]
    lever = (1.0 - shaft) * p[YIELD_DISPLACEMENT] * BAR  # a, m of deformation per curvature of the section
    stiff = bending * (1.0 - shaft) / shaft
    parts = min(int(np.ceil(abs(moved) / (FINEST * p[YIELD_DISPLACEMENT]))), PARTS)
    for part in range(1, parts + 1):
        place = deformation if part == parts else s[DEFORMATION] + moved * part / parts
        balanced(p, s, stiff * place / lever, stiff)
        kept(p, s)
    s[DEFORMATION] = deformation
    most, rubbing = CONTACT * p[YIELD_DISPLACEMENT], p[FRICTION] / CONTACT
    s[SLIDER] = min(max(s[SLIDER] + moved, -most), most)
    beside = p[STIFFNESS] * (p[HARDENING] * deformation + rubbing * s[SLIDER]) + constant
    # by the shaft, whose force is the section's
    s[FORCE] = (1.0 - rubbing) * first / shaft * (deformation - lever * s[CURVATURE]) + beside
    return float(s[FORCE])
