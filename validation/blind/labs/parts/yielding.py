"""Hysteresis of a column that yields: force over deformation, with memory.

Every formula has stiffness k (N/m), yield deformation δ_y (m), hardening b and, where it is smooth,
a sharpness n; a reversal is recognised when the motion has returned by a thousandth of δ_y.
"""

from __future__ import annotations

import math

from validation.blind.labs.parts.compiled import Array, jit

NONE, MENEGOTTO_PINTO, TAKEDA, RAMBERG_OSGOOD = range(4)
BAND = 1e-3  # of δ_y: smaller turns are no reversals; their force is below 0.1 % of the yield force
# Loss of sharpness with the plastic excursion; usual for steel (OpenSees' Steel02).
CURVATURE, CURVATURE_AT = 0.925, 0.15
UNLOADING = 0.4  # exponent of the unloading stiffness, as measured by Takeda, Sozen and Nielsen
PLASTIC = 0.3  # plastic over elastic deformation at the yield force; Ramberg and Osgood define theirs by 3/7

# places in `memory`
DIRECTION, TURN, TURN_FORCE, START, START_FORCE, AIM, AIM_FORCE, SHARPNESS, TOP, BOTTOM, LAST, FORCE = range(
    12
)
SIZE = 12


@jit
def turned(memory: Array, x: float, band: float) -> bool:
    """Whether the motion has just reversed; the farthest point is stored, and the next branch begins there."""
    if memory[DIRECTION] == 0.0:
        memory[DIRECTION] = math.copysign(1.0, x)
    way = memory[DIRECTION]
    if (x - memory[TURN]) * way >= 0.0:
        memory[TURN] = x
        return False
    if (memory[TURN] - x) * way <= band:
        return False
    memory[START] = memory[TURN]
    memory[START_FORCE] = memory[TURN_FORCE]
    memory[DIRECTION] = -way
    memory[TURN] = x
    return True


@jit
def aim(memory: Array, k: float, limit: float, b: float) -> None:
    """Where the elastic line from the reversal meets the line of hardening, and the sharpness on the way."""
    way = memory[DIRECTION]
    start, force = memory[START], memory[START_FORCE]
    meet = (way * (1.0 - b) * k * limit - force + k * start) / (k * (1.0 - b))
    if (meet - start) * way < BAND * limit:
        meet = start + way * BAND * limit
    memory[AIM] = meet
    memory[AIM_FORCE] = force + k * (meet - start)
    far = max(memory[TOP], limit) if way > 0.0 else -max(memory[BOTTOM], limit)
    excursion = abs(far - meet) / limit
    memory[SHARPNESS] = 1.0 - CURVATURE * excursion / (CURVATURE_AT + excursion)


@jit
def menegotto_pinto(memory: Array, k: float, limit: float, b: float, n: float, x: float) -> float:
    """Curved branches between two straight lines; the textbook's R = 20 is n = 2.

        f* = b·δ* + (1 − b)·δ*/(1 + |δ*|^R)^(1/R),   R = R0·(1 − 0.925·ξ/(0.15 + ξ))

    M. Menegotto, P. E. Pinto, Method of analysis for cyclically loaded R.C. plane frames, IABSE Symposium
    Lisbon 1973, 15-22.
    """
    first = memory[DIRECTION] == 0.0
    if turned(memory, x, BAND * limit) or first:
        aim(memory, k, limit, b)
    memory[TOP] = max(memory[TOP], x)
    memory[BOTTOM] = max(memory[BOTTOM], -x)
    share = (x - memory[START]) / (memory[AIM] - memory[START])
    exponent = 10.0 * n * memory[SHARPNESS]
    bent = share / (1.0 + abs(share) ** exponent) ** (1.0 / exponent)
    force = memory[START_FORCE] + (b * share + (1.0 - b) * bent) * (memory[AIM_FORCE] - memory[START_FORCE])
    if memory[TURN] == x:
        memory[TURN_FORCE] = force
    return float(force)


@jit
def takeda(memory: Array, k: float, limit: float, b: float, x: float) -> float:
    """Bilinear skeleton, unloading that softens with the peak, reloading towards the former peak.

        k_unloading = k·(δ_y/δ_max)^0.4

    T. Takeda, M. A. Sozen, N. N. Nielsen, Reinforced concrete response to simulated earthquakes, J. Struct.
    Div. ASCE 96 (1970) 2557-2573, with the bilinear skeleton of S. Otani, Inelastic analysis of R/C frame
    structures, J. Struct. Div. ASCE 100 (1974) 1433-1449.
    """
    moved = x - memory[LAST]
    way = math.copysign(1.0, moved)
    force = way * memory[FORCE]  # seen in the direction of the motion
    ahead, behind = memory[TOP], memory[BOTTOM]
    if way < 0.0:
        ahead, behind = behind, ahead
    ahead, behind = max(ahead, limit), max(behind, limit)
    left = abs(moved)
    here = way * memory[LAST]
    if force < 0.0:
        unloading = k * (limit / behind) ** UNLOADING
        part = min(left, -force / unloading)
        force += unloading * part
        left -= part
        here += part
    if left > 0.0:
        peak = k * (limit + b * (ahead - limit))
        slope = (peak - force) / (ahead - here) if here < ahead else b * k
        envelope = k * (limit + b * (here + left - limit))
        force = min(force + min(slope, k) * left, max(envelope, 0.0))
    memory[TOP] = max(memory[TOP], x)
    memory[BOTTOM] = max(memory[BOTTOM], -x)
    memory[LAST] = x
    memory[FORCE] = way * force
    return float(memory[FORCE])


@jit
def softened(k: float, limit: float, n: float, x: float) -> float:
    """Force of the skeleton `δ = f/k·(1 + 0.3·|f/(k·δ_y)|^(2n))`, by Newton's method from above."""
    power = 2.0 * n
    size = abs(x) / limit
    g = min(size, (size / PLASTIC) ** (1.0 / (power + 1.0)))  # both are at least the root
    for _ in range(12):
        bent = PLASTIC * g**power
        miss = g * (1.0 + bent) - size
        if abs(miss) < 1e-12 * size:
            break
        g -= miss / (1.0 + (power + 1.0) * bent)
    return math.copysign(g * k * limit, x)


@jit
def ramberg_osgood(memory: Array, k: float, limit: float, b: float, n: float, x: float) -> float:
    """Smooth skeleton whose branches are the skeleton doubled (Masing), never outside it; b·k beside it.

        δ = f/k·(1 + 0.3·|f/f_y|^(2n));   branch: (δ − δ_r)/2 and (f − f_r)/2 on the skeleton

    W. Ramberg, W. R. Osgood, Description of stress-strain curves by three parameters, NACA TN 902, 1943;
    P. C. Jennings, Periodic response of a general yielding structure, J. Eng. Mech. Div. ASCE 90 (1964) 131-166.
    """
    turned(memory, x, BAND * limit)
    outer = softened(k, limit, n, x)
    largest = max(memory[TOP], abs(x))
    memory[TOP] = largest
    force = outer
    if memory[START] != 0.0 and abs(x) < largest:
        force = memory[START_FORCE] + 2.0 * softened(k, limit, n, 0.5 * (x - memory[START]))
        most = abs(softened(k, limit, n, largest))
        force = min(max(force, -most), most)
    if memory[TURN] == x:
        memory[TURN_FORCE] = force
    return (1.0 - b) * force + b * k * x


@jit
def force(formula: float, memory: Array, k: float, limit: float, b: float, n: float, x: float) -> float:
    """Force (N) at a deformation (m) under a formula; elastic where there is none."""
    if formula == MENEGOTTO_PINTO:
        return menegotto_pinto(memory, k, limit, b, n, x)
    if formula == TAKEDA:
        return takeda(memory, k, limit, b, x)
    if formula == RAMBERG_OSGOOD:
        return ramberg_osgood(memory, k, limit, b, n, x)
    return k * x
