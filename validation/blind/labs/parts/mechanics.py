"""Mechanics of laboratory B that nominal models leave out: guide rail, stops, motor and drive."""

from __future__ import annotations

import math

from validation.blind.labs.parts.compiled import jit

LINEAR, HERTZ = 1, 2  # formulas of the end stop
REFERENCE = 2e-3  # m, depth at which both formulas have the same force: that of a moderate impact
RESTITUTION = 1.5  # s/m, damping of the contact over its force, as of rubber
CONTACT_FREQUENCY = 200.0  # Hz, of the platform on the flanks of its backlash: far above a table's bandwidth
FLANK, GUIDE = (
    0.7,
    0.25,
)  # damping ratios in contact (it does not bounce) and inside the backlash (guides slow it down)


@jit
def stop(formula: float, stroke: float, velocity: float, limit: float, stiffness: float) -> float:
    """Force (N) of the end stops, never pulling: `K·d^a·(1 + λ·ḋ)`, d beyond the limit.

    linear: a = 1; hertz: a = 1.5, as stiff in force at 2 mm. K. H. Hunt, F. R. E. Crossley, Coefficient of
    restitution interpreted as damping in vibroimpact, J. Appl. Mech. 42 (1975) 440-445.
    """
    depth = abs(stroke) - limit
    if formula == 0.0 or depth <= 0.0:
        return 0.0
    side = math.copysign(1.0, stroke)
    force = stiffness * depth
    if formula == HERTZ:
        force *= math.sqrt(depth / REFERENCE)
    return side * force * max(1.0 + RESTITUTION * side * velocity, 0.0)


@jit
def saturated(wanted: float, most: float) -> float:
    """Drive that saturates smoothly: `F·tanh(u/F)`."""
    return most * math.tanh(wanted / most)


@jit
def motor_constant(rise: float, stroke: float) -> float:
    """Motor force off centre over that at the centre: `1 + rise·(s/50 mm)²`, at most 2.

    A constant that decreases off centre would push the mass outwards against a weak spring: the test would diverge.
    """
    return min(1.0 + rise * (stroke / 0.05) ** 2, 2.0)


@jit
def oil_column(omega: float, damping: float, base: float, place: float, rate: float) -> float:
    """Acceleration (m/s²) of a platform on an oil spring that is moved by the loop.

    H. E. Merritt, Hydraulic Control Systems, Wiley 1967.
    """
    return omega * omega * (base - place) - 2.0 * damping * omega * rate


@jit
def played(width: float, base: float, base_rate: float, place: float, rate: float) -> float:
    """Acceleration (m/s²) of a platform that the loop moves through a backlash of `width` with stiff flanks.

    M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002)
    1633-1649.
    """
    omega = 2.0 * math.pi * CONTACT_FREQUENCY
    way = base - place
    beyond = way - min(max(way, -0.5 * width), 0.5 * width)
    damping = GUIDE if beyond == 0.0 else FLANK
    return omega * omega * beyond + 2.0 * damping * omega * (base_rate - rate)


@jit
def cam(wanted: float, amplitude: float, period: float) -> float:
    """Position of a drive whose screw has a periodic error: `u + A·sin(2π·u/p)`."""
    return wanted + amplitude * math.sin(2.0 * math.pi * wanted / period)
