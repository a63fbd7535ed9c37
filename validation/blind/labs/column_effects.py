"""The effects that the independent laboratory A knows, on its values by the kernels' names."""

from __future__ import annotations

from validation.blind.labs.laying import PLAIN, KnownEffect, Values
from validation.blind.labs.parts import delay, friction, specimen, valve, yielding
from validation.blind.labs.unlisted import actuator, column, effect


def servo_delay(values: Values, *, delay: float) -> None:
    """Dead time in addition to the plan's; where it is shorter, all that is left is a rational approximation."""
    lengthen(values, delay)


def lengthen(values: Values, more: float) -> None:
    """Change the dead time `delay` by `more` s; the part in `pade` is approximated."""
    total = max(values["delay"] + more, 0.0)
    approximated = more if more > 0.0 else total
    if more != 0.0 and approximated >= delay.SHORTEST:
        values["pade"], values["delay"] = approximated, total - approximated
    else:
        values["delay"] = total


def time_constant(values: Values, *, factor: float) -> None:
    """Slower or faster servo loop, `factor·T`, or a slow valve before it, which makes it as late."""
    values["slower"] = factor


def servo_gain(values: Values, *, factor: float) -> None:
    """Calibration of the servo loop: `factor·K`."""
    values["gain"] *= factor


def velocity_limit(values: Values, *, velocity: float) -> None:
    """Highest speed of the piston."""
    values["velocity_limit"] = velocity


def backlash(values: Values, *, width: float) -> None:
    """Full width of the clevis' backlash."""
    values["backlash"] = width


def compliance(values: Values, *, compliance: float) -> None:
    """Displacement per load, m/N."""
    values["compliance"] = compliance


def deadband(values: Values, *, width: float) -> None:
    """Full width of the valve's dead band, on the loop's error."""
    values["deadband"] = width


def stiffness(values: Values, *, factor: float) -> None:
    """Softer or stiffer: `factor·k`."""
    values["stiffness"] *= factor


def yields(
    values: Values, *, yield_displacement: float, hardening: float = 0.05, exponent: float = 2.0
) -> None:
    """Yielding beyond a deformation; the exponent is the sharpness of smooth formulas."""
    values |= {"yield_displacement": yield_displacement, "hardening": hardening, "sharpness": exponent}


def degradation(values: Values, *, rate: float) -> None:
    """Largest share of the stiffness that is lost."""
    values["degradation"] = rate


def pinching(values: Values, *, factor: float, hardening: float = 0.0, width: float = 1e-3) -> None:
    """Share of the force missing at the origin, share added far from it, and the deformation (m) between the two."""
    values |= {"pinched": factor, "pinched_hardening": hardening, "pinched_width": width}


def rubbing(values: Values, *, force: float, presliding: float = 1e-5) -> None:
    """Coulomb friction, and the deflection of the contact where the formula has bristles."""
    values |= {"friction": force, "presliding": presliding}


def viscous(values: Values, *, coefficient: float) -> None:
    """Coefficient of the rate-dependent force at 20 mm/s, or of the dashpot behind a spring."""
    values["viscous"] = coefficient


def inertia(values: Values, *, mass: float) -> None:
    """Mass between specimen and load cell."""
    values["inertia"] = mass


def slip(values: Values, *, gap: float) -> None:
    """Full width of the gap without force."""
    values["slip"] = gap


def ripple(values: Values, *, amplitude: float, frequency: float) -> None:
    """Pulsation of the pump: the oil flow makes the piston vibrate by `amplitude`."""
    values |= {"ripple": amplitude, "ripple_frequency": frequency}


def droop(values: Values, *, loss: float) -> None:
    """Share of the flow gain that is lost with an empty accumulator."""
    values["droop"] = loss


def valve_hysteresis(values: Values, *, width: float) -> None:
    """Full width of the hysteresis of a spool with friction, on the loop's error."""
    values["hysteresis"] = width


def hardening(values: Values, *, share: float) -> None:
    """Share of the stiffness gained at 2 mm, beside which it grows still faster."""
    values["hardened"] = share


def asymmetry(values: Values, *, share: float) -> None:
    """Stiffness `k·(1 ± share)` against positive and negative deformation."""
    values["asymmetry"] = share


KNOWN = {
    "actuator.delay": KnownEffect(servo_delay, {"pade": 0}),
    "actuator.time_constant": KnownEffect(time_constant, {"valve": 1, "plain": 0}, "slow_valve"),
    "actuator.gain": KnownEffect(servo_gain, PLAIN),
    "actuator.velocity_limit": KnownEffect(
        velocity_limit, {"smooth": valve.SMOOTH, "orifice": valve.ORIFICE}, "limiting"
    ),
    "actuator.backlash": KnownEffect(backlash, {"spring": 0}),
    "actuator.compliance": KnownEffect(compliance, {"oil_column": 0}),
    "actuator.deadband": KnownEffect(deadband, {"smooth": 0}),
    "column.stiffness": KnownEffect(stiffness, PLAIN),
    "column.yielding": KnownEffect(
        yields,
        {
            "menegotto_pinto": yielding.MENEGOTTO_PINTO,
            "takeda": yielding.TAKEDA,
            "ramberg_osgood": yielding.RAMBERG_OSGOOD,
        },
        "yielding",
    ),
    "column.degradation": KnownEffect(
        degradation, {"exponential": specimen.EXPONENTIAL, "linear": specimen.LINEAR}, "degrading"
    ),
    "column.pinching": KnownEffect(
        pinching, {"lorentz": specimen.LORENTZ, "sech": specimen.SECH}, "pinching"
    ),
    "column.friction": KnownEffect(
        rubbing, {"tanh": friction.TANH, "dahl": friction.DAHL, "lugre": friction.LUGRE}, "rubbing"
    ),
    "column.viscous": KnownEffect(
        viscous, {"power": specimen.BY_POWER, "maxwell": specimen.MAXWELL}, "damping"
    ),
    "column.inertia": KnownEffect(inertia, PLAIN),
    "column.slip": KnownEffect(slip, {"smooth": 0}),
    "column.hardening": KnownEffect(hardening, {"sinh": 0}),
    "x.actuator.ripple": KnownEffect(ripple, PLAIN),
    "x.actuator.droop": KnownEffect(droop, PLAIN),
    "x.actuator.valve_hysteresis": KnownEffect(valve_hysteresis, PLAIN),
    "x.column.asymmetry": KnownEffect(asymmetry, PLAIN),
    **effect.known(actuator.EFFECTS),
    **effect.known(column.EFFECTS),
}
