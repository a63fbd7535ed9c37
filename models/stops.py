"""The force of an end stop on what hits it: a spring, or the contact of Hunt and Crossley.

    F = K·d·(d/d₀)^(n−1)·(1 + λ·ḋ), never pulling

with the depth d beyond the stop and d₀ = 1 mm, at which the force of every exponent is that of the spring K. The
exponent n = 1 without damping λ is a spring; n = 1.5 is Hertz's contact of a sphere (K. H. Hunt, F. R. E. Crossley,
Coefficient of restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975) 440-445).
"""

from __future__ import annotations

from models.compiled import jit

DEPTH = 1e-3  # m, d₀


@jit
def force(
    stroke: float, rate: float, place: float, stiffness: float, exponent: float, damping: float
) -> float:
    """Force (N) on a part at a stroke (m) with a rate (m/s), positive against a positive stroke.

    `place` (m) is the distance from the middle to one stop, `stiffness` K is in N/m, and `damping` λ in s/m.
    """
    depth = abs(stroke) - place
    if depth <= 0.0:
        return 0.0
    pressed = stiffness * depth
    if exponent != 1.0:
        pressed *= (depth / DEPTH) ** (exponent - 1.0)
    side = 1.0 if stroke > 0.0 else -1.0
    return side * pressed * max(1.0 + damping * side * rate, 0.0)
