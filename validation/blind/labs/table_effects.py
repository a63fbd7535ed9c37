"""The effects that the independent laboratory B knows, on its values by the kernels' names."""

from __future__ import annotations

import math

from validation.blind.labs.column_effects import lengthen
from validation.blind.labs.laying import PLAIN, KnownEffect, Values
from validation.blind.labs.parts import friction, mechanics
from validation.blind.labs.unlisted import damper, effect, table


def table_delay(values: Values, *, delay: float) -> None:
    """Dead time in addition to the plan's; where it is shorter, all that is left is a rational approximation."""
    lengthen(values, delay)


def bandwidth(values: Values, *, factor: float) -> None:
    """Slower or faster loop: `factor·ω`."""
    values["omega"] *= factor


def table_damping(values: Values, *, factor: float) -> None:
    """Loop damped more or less: `factor·ζ`."""
    values["damping"] *= factor


def table_gain(values: Values, *, factor: float) -> None:
    """Calibration of the loop: `factor·u`."""
    values["table_gain"] *= factor


def oil_column(values: Values, *, frequency: float, damping: float = 0.1) -> None:
    """Resonance of the platform on the loop, frequency (Hz) and damping ratio."""
    values |= {"oil": 2.0 * math.pi * frequency, "oil_damping": damping}


def payload(values: Values, *, compliance: float) -> None:
    """Force of the damper on the table's compliance: `ÿ = … + ω²·c·F`."""
    values["compliance"] = compliance


def table_backlash(values: Values, *, width: float) -> None:
    """Full width of the backlash between loop and platform."""
    values["play"] = width


def table_friction(values: Values, *, acceleration: float) -> None:
    """Friction of the table's bearings over the moving mass."""
    values["table_friction"] = acceleration


def rail_friction(values: Values, *, force: float) -> None:
    """Coulomb friction of the guide rail."""
    values["friction"] = force


def dashpot(values: Values, *, factor: float) -> None:
    """Stronger or weaker dashpot: `factor·c`."""
    values["dashpot"] *= factor


def spring(values: Values, *, factor: float) -> None:
    """Stiffer or softer spring: `factor·k`."""
    values["stiffness"] *= factor


def mass(values: Values, *, factor: float) -> None:
    """Heavier or lighter mass: `factor·m`."""
    values["mass"] *= factor


def motor_gain(values: Values, *, factor: float) -> None:
    """Motor constant: `factor·command`."""
    values["motor_gain"] *= factor


def motor_lag(values: Values, *, time_constant: float) -> None:
    """Lag of the motor's force in addition to the plan's, or a loop of second order behind it that is as late."""
    values["motor_more"] = time_constant


def force_limit(values: Values, *, force: float) -> None:
    """Largest force of the drive."""
    values["force_limit"] = force


def stroke_stop(values: Values, *, stroke: float, stiffness: float = 2000.0) -> None:
    """Distance of the stops from the centre, and their stiffness (at 2 mm of depth)."""
    values |= {"stop_stroke": stroke, "stop_stiffness": stiffness}


def pitch(values: Values, *, coupling: float, frequency: float) -> None:
    """Rocking of the platform, measured by the accelerometer: `r̈ + 0.1·ω·ṙ + ω²·r = −coupling·ÿ`."""
    values |= {"pitch": coupling, "pitch_omega": 2.0 * math.pi * frequency}


def cam(values: Values, *, amplitude: float, period: float) -> None:
    """Error of the drive's screw: `u + amplitude·sin(2π·u/period)`."""
    values |= {"cam": amplitude, "cam_period": period}


def cable_drag(values: Values, *, coefficient: float) -> None:
    """Drag `coefficient·ṡ·|ṡ|`, N·s²/m²."""
    values["drag"] = coefficient


def motor_constant(values: Values, *, rise: float) -> None:
    """Relative increase of the motor's force at a stroke of 50 mm."""
    values["motor_rise"] = rise


def cubic_spring(values: Values, *, stiffness: float) -> None:
    """Cubic force `stiffness·s³`, N/m³."""
    values["cubic"] = stiffness


def second_mass(values: Values, *, frequency: float, share: float = 0.2, damping: float = 0.1) -> None:
    """A share of the moving mass on a spring of its own: frequency (Hz) and damping ratio there."""
    values |= {
        "appendage": share * values["mass"],
        "mass": (1.0 - share) * values["mass"],
        "appendage_omega": 2.0 * math.pi * frequency,
        "appendage_damping": damping,
    }


KNOWN = {
    "table.delay": KnownEffect(table_delay, {"pade": 0}),
    "table.bandwidth": KnownEffect(bandwidth, PLAIN),
    "table.damping": KnownEffect(table_damping, PLAIN),
    "table.gain": KnownEffect(table_gain, PLAIN),
    "table.oil_column": KnownEffect(oil_column, PLAIN),
    "table.payload": KnownEffect(payload, {"dynamic": 0}),
    "table.backlash": KnownEffect(table_backlash, {"contact": 0}),
    "table.friction": KnownEffect(table_friction, {"tanh": 0}),
    "damper.friction": KnownEffect(
        rail_friction, {"tanh": friction.TANH, "dahl": friction.DAHL, "lugre": friction.LUGRE}, "rubbing"
    ),
    "damper.viscous": KnownEffect(dashpot, PLAIN),
    "damper.stiffness": KnownEffect(spring, PLAIN),
    "damper.mass": KnownEffect(mass, PLAIN),
    "damper.second_mass": KnownEffect(second_mass, PLAIN),
    "damper.gain": KnownEffect(motor_gain, PLAIN),
    "damper.motor_lag": KnownEffect(motor_lag, {"second_order": 2, "first_order": 1}, "motor_order"),
    "damper.force_limit": KnownEffect(force_limit, {"smooth": 0}),
    "damper.stroke_stop": KnownEffect(
        stroke_stop, {"hertz": mechanics.HERTZ, "linear": mechanics.LINEAR}, "stopping"
    ),
    "x.table.pitch": KnownEffect(pitch, PLAIN),
    "x.table.cam": KnownEffect(cam, PLAIN),
    "x.damper.cable_drag": KnownEffect(cable_drag, PLAIN),
    "x.damper.motor_constant": KnownEffect(motor_constant, PLAIN),
    "x.damper.cubic_spring": KnownEffect(cubic_spring, PLAIN),
    **effect.known(table.EFFECTS),
    **effect.known(damper.EFFECTS),
}
