"""Effects of no catalogue of laboratory B's damper and motor; what is seen and added is that of `table`."""

from __future__ import annotations

import math

from validation.blind.labs.parts.compiled import Array, jit
from validation.blind.labs.unlisted.effect import Unlisted
from validation.blind.labs.unlisted.table import (
    LAST,
    MOTOR,
    PUSH,
    RAIL,
    STEP,
    STROKE,
    STROKE_ACC,
    STROKE_RATE,
)

COGGING, CHAIN, EDDY, INERTER, HOT, CROSSOVER, MAGNET, BELT, BUMPER, AIR = range(LAST + 1, LAST + 11)
HEAT = 5e3  # N²·s, of the motor's squared force, after which most of its warming is done
SLACK = 0.1  # damping ratio of a belt

EFFECTS = {
    "x.damper.cogging": Unlisted(
        COGGING,
        "the motor's magnets pull at its teeth: a force periodic in place",
        {"force": (0.01, 4.0), "pitch": (5e-3, 2e-2)},
    ),
    "x.damper.cable_chain": Unlisted(
        CHAIN,
        "a cable chain drags with a hysteresis of its own (Dahl, over millimetres)",
        {"force": (0.01, 6.0), "bend": (3e-3, 1.5e-2)},
        ("damper.friction",),
    ),
    "x.damper.eddy_current": Unlisted(
        EDDY,
        "an eddy-current brake, weaker beyond its critical speed (Wouterse, IEE Proc. B 138, 1991)",
        {"coefficient": (0.03, 12.0), "speed": (0.05, 0.25)},
        ("damper.viscous",),
    ),
    "x.damper.inerter": Unlisted(
        INERTER,
        "a flywheel between mass and table (Smith, IEEE Trans. Autom. Control 47, 2002)",
        {"mass": (5e-3, 2.0)},
        ("damper.mass",),
    ),
    "x.damper.hot_motor": Unlisted(HOT, "the motor's constant falls as it warms", {"share": (1e-3, 0.3)}),
    "x.damper.crossover": Unlisted(
        CROSSOVER, "the amplifier's crossover swallows small currents", {"force": (0.01, 4.0)}
    ),
    "x.damper.magnet_memory": Unlisted(
        MAGNET, "the motor's iron keeps a part of its magnetisation", {"force": (0.02, 8.0)}
    ),
    "x.damper.belt": Unlisted(
        BELT,
        "a part of the motor's force comes through a belt that resonates",
        {"share": (0.03, 1.0), "frequency": (8.0, 40.0)},
        ("damper.motor_lag", "damper.second_mass"),
    ),
    "x.damper.bumper": Unlisted(
        BUMPER,
        "a soft bumper on one side",
        {"stiffness": (0.05, 60.0), "gap": (2e-3, 1.5e-2)},
        ("damper.stroke_stop",),
    ),
    "x.damper.air_cushion": Unlisted(
        AIR,
        "air is squeezed out at both ends: damping that grows with the stroke",
        {"coefficient": (20.0, 1.2e4)},
    ),
}


@jit
def at_rail(code: float, sizes: Array, kept: Array, seen: Array, added: Array) -> None:
    """An effect on the force between mass and table."""
    a, b, h = sizes[0], sizes[1], seen[STEP]
    s, w = seen[STROKE], seen[STROKE_RATE]
    if code == COGGING:
        added[RAIL] = a * math.sin(2.0 * math.pi * s / b)
    elif code == CHAIN:
        end = math.copysign(1.0, w)
        kept[0] = end + (kept[0] - end) * math.exp(-abs(w) * h / b)
        added[RAIL] = a * kept[0]
    elif code == EDDY:
        added[RAIL] = a * w / (1.0 + (w / b) ** 2)
    elif code == INERTER:
        added[RAIL] = a * seen[STROKE_ACC]
    elif code == BUMPER:
        added[RAIL] = a * max(s - b, 0.0)
    elif code == AIR:
        added[RAIL] = a * s * s * w


@jit
def at_motor(code: float, sizes: Array, kept: Array, seen: Array, added: Array) -> None:
    """An effect on the motor's force."""
    a, b, h, u = sizes[0], sizes[1], seen[STEP], seen[PUSH]
    if code == HOT:
        kept[0] += u * u * h
        added[MOTOR] = -a * u * (1.0 - math.exp(-kept[0] / HEAT))
    elif code == CROSSOVER:
        added[MOTOR] = -a * math.tanh(u / a) if a > 0.0 else 0.0
    elif code == MAGNET:
        kept[0] = min(max(kept[0], u - 0.5 * a), u + 0.5 * a)
        added[MOTOR] = kept[0] - u
    elif code == BELT:
        omega = 2.0 * math.pi * b
        kept[1] += (omega * omega * (u - kept[0]) - 2.0 * SLACK * omega * kept[1]) * h
        kept[0] += kept[1] * h
        added[MOTOR] = a * (kept[0] - u)


@jit
def hold(code: float, sizes: Array, kept: Array, seen: Array, added: Array) -> None:
    """Write into `added` what an effect of the damper or its motor adds over the next step."""
    at_rail(code, sizes, kept, seen, added)
    at_motor(code, sizes, kept, seen, added)
