"""A dashpot whose force is a power of the rate, by itself or behind a spring.

    f = c·v₀·|v/v₀|ᵃ·sgn(v),    v₀ = 0.1 m/s

so that c is the secant coefficient at v₀, whatever the exponent a. Behind a spring (Maxwell's element) v is the rate of
the dashpot alone, v = δ̇ − ḟ/k. Its force is computed by the implicit Euler method, which is stable for any stiffness.

D. P. Taylor and M. C. Constantinou, Fluid dampers for applications of seismic energy dissipation and seismic
isolation (1996): a between 0.3 and 1 for fluid dampers.
"""

from __future__ import annotations

import math

from models.compiled import jit
from models.registry import Array

REFERENCE = 0.1  # m/s, v₀: usual in a test of dampers
ITERATIONS = 12  # of Newton's method, which gains half of the digits or more with each one
CLOSE = 1e-10  # relative change below which it ends


@jit
def force(rate: float, coefficient: float, exponent: float) -> float:
    """Force (N) at a rate (m/s) of a dashpot with c = `coefficient` (N·s/m)."""
    size = coefficient * REFERENCE * (abs(rate) / REFERENCE) ** exponent
    return math.copysign(size, rate)


@jit
def add_forces(rates: Array, coefficient: float, exponent: float, result: Array) -> None:
    """Add `force` at each of several rates (n,) m/s to `result` (n,) N."""
    for place in range(rates.size):
        result[place] += force(rates[place], coefficient, exponent)


@jit
def relaxed(held: float, stiffness: float, coefficient: float, exponent: float) -> float:
    """Force (N) behind a spring at the end of a step in which the dashpot gives way.

    `held` (N) is the force if the dashpot did not move, `stiffness` (N·s/m) that of the spring times the step.
    """
    if held == 0.0:
        return 0.0
    size, power = abs(held), 1.0 / exponent
    scale = coefficient * REFERENCE
    lost = stiffness * REFERENCE  # N that the spring loses in the step at the rate v₀
    y = most = min(size, scale * (size / lost) ** exponent)  # neither term exceeds the whole
    for _ in range(ITERATIONS):
        part = lost * (y / scale) ** power
        slope = 1.0 + power * part / y
        moved = (y + part - size) / slope
        y = min(max(y - moved, 1e-3 * y), most)
        if abs(moved) < CLOSE * y:
            break
    return math.copysign(y, held)
