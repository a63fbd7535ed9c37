"""The servo valve between the loop's error and the oil flow, and the supply of the oil."""

from __future__ import annotations

import math

from validation.blind.labs.parts.compiled import jit

SMOOTH, ORIFICE = 1, 2
# N, supply pressure times piston area: a usual actuator, stronger than the default test's column.
CAPACITY = 100e3
USED_AT = 0.02  # m of travel that half empties the accumulator: a few strokes of the trial's columns
# s, time constant of the pump's refilling: longer than a cycle of the building, shorter than a test.
REFILL = 3.0


@jit
def overlap(error: float, width: float) -> float:
    """Error behind a rounded dead band of full width w: `e − w/2·tanh(2e/w)`.

    H. E. Merritt, Hydraulic Control Systems, Wiley 1967, section 5.4 (the band's edges rounded by leakage).
    """
    if width <= 0.0:
        return error
    return error - 0.5 * width * math.tanh(2.0 * error / width)


@jit
def spool(held: float, error: float, width: float) -> float:
    """Position of a spool with friction: it follows the error with a hysteresis of `width`.

    H. E. Merritt, Hydraulic Control Systems, Wiley 1967 (threshold and hysteresis of a servo valve).
    """
    return min(max(held, error - 0.5 * width), error + 0.5 * width)


@jit
def supplied(loss: float, used: float) -> float:
    """Share of the flow gain left after `used` m of travel: `1 − loss·q/(q + q0)`, an accumulator's droop."""
    return 1.0 - loss * used / (used + USED_AT)


@jit
def flow(formula: float, velocity: float, most: float, force: float) -> float:
    """Velocity of the piston where the valve is fully open at `most` m/s.

        smooth:    v_max·tanh(v/v_max)
        orifice:   v within ±v_max·√(1 − sgn(v)·f/F_max), f the load against +x

    H. E. Merritt, Hydraulic Control Systems, Wiley 1967, section 5.3.
    """
    if formula == SMOOTH:
        return most * math.tanh(velocity / most)
    if formula == ORIFICE:
        pressure = math.sqrt(max(1.0 - math.copysign(1.0, velocity) * force / CAPACITY, 0.0))
        return min(max(velocity, -most * pressure), most * pressure)
    return velocity
