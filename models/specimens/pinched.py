"""Peak-oriented specimen with a trilinear skeleton, pinched reloading, softer unloading and damage.

    skeleton:   k up to c·δ_y, m·k up to δ_y, α·k beyond, never below zero
    unloading:  k_u = k·(c·δ_y/δ_m)^a, never below the secant to the peak
    reloading:  from where the force is zero, δ_0, straight to the corner (δ_c, f_c), then straight to the peak
                (δ_m, f_m), never stiffer than k_u. The corner is, with the model
                `pinched`          on the way:  δ_c = δ_0 + q·(δ_m − (1 − p)·f_m/k_u − δ_0),  f_c = p·f_m
                `pinched_by_peak`  at a share of the peak:  δ_c = q·δ_m,  f_c = p·f_m
                `pinched_by_rest`  at a share of what is left of the peak without force:  δ_c = q·(δ_m − f_m/k_u), on
                                   the line from δ_0 to (δ_m, p·f_m)
                In the last two there is no corner where δ_0 is beyond it.
    damage:     δ_m grows by the factor 1 + d·L/δ_y at every reversal; L is the path of δ_0 since the last one
    asymmetry:  on the positive side all forces and deformations are those of the symmetric specimen times 1 + e, on
                the negative side times 1 - e, so that both begin with the stiffness k

δ_m is the largest deformation so far on the side to which the motion goes, initially that of the first bend, and f_m
is the skeleton's force there. With p = 1, q = 1 and c = 1 reloading is that of Clough and Johnston. A partial
unloading and reloading has the stiffness k_u until it meets the line that it left.

The rules of `pinched` are those of M. H. Scott and F. C. Filippou's material Hysteretic in OpenSees (as its manual
states them), after M. Saiidi and M. A. Sozen, Simple nonlinear seismic analysis of R/C structures, J. Struct. Div.
ASCE 107 (1981), 937-953. The corner of `pinched_by_peak` is that of the material Pinching4 of L. N. Lowes, N. Mitra and
A. Altoontash, A beam-column joint model for simulating the earthquake response of reinforced concrete frames, report
PEER 2003/10; that of `pinched_by_rest` is from L. F. Ibarra, R. A. Medina and H. Krawinkler, Hysteretic models that
incorporate strength and stiffness deterioration, Earthquake Engng Struct. Dyn. 34 (2005), 1489-1511. Damage by
accumulated plastic deformation is similar to that of Y. J. Park and A. H.-S. Ang, Mechanistic seismic damage model for
reinforced concrete, J. Struct. Eng. ASCE 111 (1985), 722-739. It is computed from the ends of the branches only, so
that an increment of any size is exact.

Not to be confused with `bwbn`, which is smooth, or with `trilinear`, whose reloading does not aim at a peak.
"""

from __future__ import annotations

from typing import NamedTuple

from common.plan.schema import Rule
from models.compiled import jit
from models.registry import Array


class PinchedParams(NamedTuple):
    """Parameters, in the order of the kernel's array."""

    stiffness: float  # k, N/m
    yield_displacement: float  # δ_y, m, deformation where the skeleton's third line begins
    hardening: float = 0.0  # α, stiffness of the third line over the first
    first_bend: float = 1.0  # c, deformation where the second line begins over δ_y
    second_stiffness: float = 0.5  # m, stiffness of the second line over the first
    pinch_force: float = 0.5  # p, force at the corner over that at the peak; 1: no pinching
    pinch_displacement: float = 0.5  # q, place of the corner, from 0 to 1: see above
    unloading: float = 0.0  # a, exponent of the unloading stiffness; 0: it stays k
    damage: float = 0.0  # d, relative growth of δ_m per plastic deformation of δ_y
    asymmetry: float = 0.0  # e, strength of the positive side less that of the negative one over their sum


RULES = {
    "stiffness": Rule("elastic stiffness", "N/m", least=0.0),
    "yield_displacement": Rule("deformation where the skeleton's third line begins", "m", above=0.0),
    "hardening": Rule("stiffness of the third line over the first", above=-1.0, most=1.0),
    "first_bend": Rule(
        "deformation where the second line begins over yield_displacement", above=0.0, most=1.0
    ),
    "second_stiffness": Rule("stiffness of the second line over the first", least=0.0, most=1.0),
    "pinch_force": Rule("force at the corner of reloading over that at the peak", least=0.0, most=1.0),
    "pinch_displacement": Rule(
        "place of the corner of reloading on the way to the peak; with pinched_by_peak over the peak's deformation, "
        "with pinched_by_rest over what is left of it without force",
        least=0.0,
        most=1.0,
    ),
    "unloading": Rule("exponent of the unloading stiffness", least=0.0, most=1.0),
    "damage": Rule("growth of the peak per plastic deformation of yield_displacement", least=0.0, most=10.0),
    "asymmetry": Rule(
        "strength of the positive side less that of the negative one over their sum", least=-0.98, most=0.98
    ),
}
STIFFNESS, YIELD_DISPLACEMENT, HARDENING, FIRST_BEND, SECOND_STIFFNESS = range(5)
PINCH_FORCE, PINCH_DISPLACEMENT, UNLOADING, DAMAGE, ASYMMETRY = range(5, 10)

# Places in the state. Of the last call: δ (m), f (N), and the direction of motion (±1, 0 before any motion). For upward
# motion and, behind it, for downward motion: the peak to which it goes (m, as a magnitude), the deformation where the
# force was zero when the branch began (m, in its direction), and the path of that deformation since the peak last grew
# (m). LAST is the newest deformation of zero force (m).
DEFORMATION, FORCE, WAY, PEAK, ZERO, TRAVELLED, LAST = 0, 1, 2, 3, 5, 7, 9
STATE_SIZE = 10

ON_THE_WAY, BY_PEAK, BY_REST = range(3)  # where the corner of reloading lies


@jit
def skeleton(p: Array, size: float) -> float:
    """Force (N) of the skeleton at a magnitude of deformation (m)."""
    limit = p[YIELD_DISPLACEMENT]
    first = p[FIRST_BEND] * limit
    if size <= first:
        return p[STIFFNESS] * size
    second = min(size, limit) - first
    way = first + p[SECOND_STIFFNESS] * second + p[HARDENING] * max(size - limit, 0.0)
    return p[STIFFNESS] * max(way, 0.0)


@jit
def unloading_stiffness(p: Array, peak: float) -> float:
    """Unloading stiffness (N/m) of the side whose peak (m) is given."""
    first = p[FIRST_BEND] * p[YIELD_DISPLACEMENT]
    if peak <= first:
        return p[STIFFNESS]
    return max(p[STIFFNESS] * (first / peak) ** p[UNLOADING], skeleton(p, peak) / peak)


@jit
def bend(
    p: Array, zero: float, peak: float, aim: float, stiffness: float, corner: int
) -> tuple[float, float]:
    """Place (m) of the corner of reloading from `zero` to the peak (m), and its force over the peak's, `aim` (N)."""
    share, place = p[PINCH_FORCE], p[PINCH_DISPLACEMENT]
    level = peak - (1.0 - share) * aim / stiffness  # where unloading from the peak has the corner's force
    if corner == BY_PEAK:
        there = min(place * peak, level)
        return (there, share) if there > zero else (zero, 0.0)
    if corner == BY_REST:
        there = max(place * (peak - aim / stiffness), zero)
        return there, share * (there - zero) / (peak - zero) if peak > zero else 1.0
    return zero + place * max(level - zero, 0.0), share


@jit
def rise(
    p: Array, force: float, start: float, end: float, zero: float, peak: float, other: float, corner: int
) -> float:
    """Force (N) after the deformation grew from `start` to `end` (m), away from the side with the peak `other` (m)."""
    if start < zero:
        if end < zero:
            return min(force + unloading_stiffness(p, other) * (end - start), 0.0)
        start, force = zero, 0.0
    if end >= peak:
        return skeleton(p, end)
    stiffness = unloading_stiffness(p, peak)
    elastic = force + stiffness * (end - start)
    aim = skeleton(p, peak)
    place, share = bend(p, zero, peak, aim, stiffness, corner)
    if end < place:
        return min(elastic, share * aim * (end - zero) / (place - zero))
    if peak <= place:  # the force is zero beyond the peak, where the skeleton has fallen to zero
        return min(elastic, aim)
    return min(elastic, aim * (share + (1.0 - share) * (end - place) / (peak - place)))


@jit
def turn(p: Array, s: Array, side: int, way: float) -> None:
    """Begin a branch against the force of the last call: where the force will be zero, and the damage until then."""
    first = p[FIRST_BEND] * p[YIELD_DISPLACEMENT]
    size, other = 1.0 + way * p[ASYMMETRY], 1.0 - way * p[ASYMMETRY]
    stiffness = unloading_stiffness(p, max(s[PEAK + 1 - side] / other, first))
    zero = way * s[DEFORMATION] - way * s[FORCE] / stiffness
    s[ZERO + side] = zero
    travelled = abs(way * zero - s[LAST])
    s[LAST] = way * zero
    s[TRAVELLED + 1 - side] += travelled
    if s[PEAK + side] > first * size:
        lost = s[TRAVELLED + side] + travelled
        s[PEAK + side] *= 1.0 + p[DAMAGE] * lost / p[YIELD_DISPLACEMENT]
    s[TRAVELLED + side] = 0.0


@jit
def step(p: Array, s: Array, deformation: float, corner: int) -> float:
    """Force (N) at a deformation (m), reached from that of the last call; `s` (10,) is updated.

    `corner` says where that of reloading is, one of `ON_THE_WAY`, `BY_PEAK` and `BY_REST`.
    """
    moved = deformation - s[DEFORMATION]
    if moved == 0.0:
        return s[FORCE]
    # downward motion is computed as upward motion with all signs reversed
    way, side = (1.0, 0) if moved > 0.0 else (-1.0, 1)
    if way != s[WAY]:
        s[WAY] = way
        if way * s[FORCE] <= 0.0:
            turn(p, s, side, way)
    first = p[FIRST_BEND] * p[YIELD_DISPLACEMENT]
    size = 1.0 + way * p[ASYMMETRY]  # the rules hold for forces and deformations over the size of their side
    peak = max(s[PEAK + side] / size, first)
    other = max(s[PEAK + 1 - side] / (1.0 - way * p[ASYMMETRY]), first)
    begun, ended = way * s[DEFORMATION] / size, way * deformation / size
    force = rise(p, way * s[FORCE] / size, begun, ended, s[ZERO + side] / size, peak, other, corner)
    s[PEAK + side] = size * max(peak, ended)
    s[DEFORMATION] = deformation
    s[FORCE] = way * size * force
    return float(s[FORCE])
