"""A kind of laboratory: a friction damper with play, whose displacement an actuator imposes.

A slider rubs in a clamp and is moved through a joint that has play. The joint's force h(z) at its deformation z is zero
inside the play w and grows with the stiffness k outside; the corners are rounded over a length s, because bolts and
pads do not all touch at once. The slider takes a share of each increment that grows with the force:

    h(z) = k·s·[ln(1 + exp((z − w/2)/s)) − ln(1 + exp((−z − w/2)/s))]
    ż = ẋ·(1 − (h/F)^n)        while the force opposes the motion, ż = ẋ otherwise

where F is F₊ or F₋, by the direction, times 1 − d·(1 − exp(−|ẋ|/v)): friction falls with speed. The measured force
has an offset. The slider's law is Dahl's with an exponent (P. R. Dahl, AIAA Journal 14 (1976) 1675-1682).
"""

from __future__ import annotations

import math

from laboratories.device import Channels, Device, Fault, Limited, Nominal, Signal, kernel
from models.registry import Array

SUBSTEPS = (
    8  # of an interval of 8 ms: 1 ms, in which the sine of 2 Hz and 19 mm moves less than half a `corner`
)
# |h/F| is limited, because it may exceed 1 for a moment when the friction falls; the limit keeps (h/F)^n finite
MOST_RATIO = 1.5

# indices of `parameters`: the interval, then `nominal`, then `faults`
INTERVAL, STIFFNESS, PLAY, CORNER, PUSH, PULL, EXPONENT, DROP, SPEED, OFFSET, WEAR = range(11)
JOINT, IMPOSED = range(2)  # indices of `state`: deformation of the joint and imposed displacement, m


class FrictionDamper(Device):
    """A friction damper whose joint has play; its displacement is the command."""

    name = "friction_damper"
    says = "friction damper with play"
    channels = Channels(
        target=Signal("damper_target", "m", "target displacement"),
        command=Signal("damper_reached", "m", "displacement at the end of the interval"),
        measured=(
            Signal("damper_displacement", "m", "measured displacement"),
            Signal("damper_resistance", "N", "measured force"),
        ),
        position="damper_displacement",
        force="damper_resistance",
    )
    nominal = {
        "stiffness": Nominal(3.5e6, "N/m", "k of the joint outside its play", least=1e5, tolerance=0.5),
        "play": Nominal(0.009, "m", "w, total play of the joint", least=1e-4, most=0.05, tolerance=0.5),
        "corner": Nominal(
            0.0005, "m", "s, length over which the joint closes", least=1e-5, most=0.01, tolerance=0.5
        ),
        "push": Nominal(
            14e3, "N", "F₊, friction of a slow slider that is pushed", least=100.0, tolerance=0.5
        ),
        "pull": Nominal(
            20e3, "N", "F₋, friction of a slow slider that is pulled", least=100.0, tolerance=0.5
        ),
        "exponent": Nominal(
            4.0, "", "n, sharpness of the change to sliding", least=0.5, most=40.0, tolerance=0.5
        ),
        "drop": Nominal(0.1, "", "d, share of the friction that is lost at high speed", least=-1.0, most=0.9),
        "speed": Nominal(0.05, "m/s", "v, speed at which 63 % of d are lost", least=1e-3, tolerance=0.5),
        "offset": Nominal(-300.0, "N", "measured force without load", least=-5e3, most=5e3),
    }
    faults = {"wear": Fault("worn pads: less friction", "share", "", 0.0, 0.0, 0.9, (0.05, 0.1, 0.2, 0.4))}
    states = 2
    rms = {"damper_displacement": 5e-6, "damper_resistance": 100.0}
    limited = Limited(velocity="damper_velocity", error="damper_error")
    most = {
        "damper_displacement": 0.1,
        "damper_reached": 0.1,
        "damper_resistance": 100e3,
        "damper_velocity": 2.0,
        "damper_error": 0.1,
    }

    @staticmethod
    def step(parameters: Array, state: Array, truth: Array, command: float, _effort: float) -> None:
        """Advance joint and slider by one interval."""
        increment = (command - state[IMPOSED]) / SUBSTEPS
        speed = abs(command - state[IMPOSED]) / parameters[INTERVAL]
        lost = parameters[DROP] * -math.expm1(-speed / parameters[SPEED])
        level = (1.0 - parameters[WEAR]) * (1.0 - lost)
        for _ in range(SUBSTEPS):
            state[JOINT] += increment * joint_share(parameters, state[JOINT], increment, level)
        state[IMPOSED] = command
        truth[0] = command
        truth[1] = joint_force(parameters, state[JOINT]) + parameters[OFFSET]


@kernel
def joint_force(parameters: Array, z: float) -> float:
    """Force (N) of the joint at its deformation `z` (m)."""
    s, half = parameters[CORNER], 0.5 * parameters[PLAY]
    return parameters[STIFFNESS] * s * (softplus((z - half) / s) - softplus((-z - half) / s))


@kernel
def softplus(x: float) -> float:
    """ln(1 + eˣ) without overflow."""
    return x + math.log1p(math.exp(-x)) if x > 0.0 else math.log1p(math.exp(x))


@kernel
def joint_share(parameters: Array, z: float, increment: float, level: float) -> float:
    """Share of an increment (m) that the joint takes at its deformation `z` (m); the slider takes the rest.

    `level` is the friction over that of a slow slider without wear.
    """
    friction = parameters[PUSH] if increment > 0.0 else parameters[PULL]
    ratio = math.copysign(1.0, increment) * joint_force(parameters, z) / (level * friction)
    return 1.0 - min(max(ratio, 0.0), MOST_RATIO) ** parameters[EXPONENT]
