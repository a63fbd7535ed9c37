"""Effects of no catalogue of laboratory A's actuator."""

from __future__ import annotations

import math

from validation.blind.labs.parts.compiled import Array, jit
from validation.blind.labs.unlisted.effect import Unlisted

# what is seen (m, m/s, m, m, m/s, m/s², N, N/m), for the column as well
TIME, STEP, PISTON, PISTON_RATE, ERROR, PLACE, RATE, ACCELERATION, FORCE, STIFFNESS = range(10)
SEEN = 10
# what is added: m to the command, m/s to the piston's speed and a share of it, m between piston and specimen, N to the
# specimen's force
DEMAND, FLOW, SPEED, SHIFT, LOAD = range(5)
ADDED = 5

ENCODER, PULSATION, HOSE, WARM_OIL, WINDUP, LEAK, STICTION, CYLINDER, GIMBAL, SCALE = range(1, 11)
LAST = SCALE  # effects of the column have the codes above

LOADED = 50e3  # N, at which a hose has lost what is stated: near the column's peak in the default test
LEAKED = 10e3  # N, at which a piston's seal leaks what is stated
WORK = 5e3  # J, after which most of the oil's warming is done; a test of 12 s does about twice that
SLOW = 2e-3  # m/s, below which a spool counts as at rest
MIDDLE = 5e-3  # m, at which a scale is off by what is stated

EFFECTS = {
    "x.actuator.encoder_slip": Unlisted(
        ENCODER,
        "the loop's own encoder loses counts: its zero jumps each time that so much way is travelled",
        {"jump": (1.5e-5, 3e-4), "every": (0.03, 0.12)},
    ),
    "x.actuator.pump_pulsation": Unlisted(
        PULSATION,
        "the pump's pressure pulsates, and the flow with it (Merritt 1967, section 5.3: flow ~ root of pressure)",
        {"share": (0.02, 0.5), "frequency": (4.0, 30.0)},
    ),
    "x.actuator.soft_hose": Unlisted(
        HOSE,
        "hoses widen by more than in proportion to the pressure",
        {"loss": (1.5e-5, 3e-4)},
        ("actuator.compliance",),
    ),
    "x.actuator.warm_oil": Unlisted(
        WARM_OIL, "oil warms with the work done and flows faster", {"share": (0.03, 0.8)}
    ),
    "x.actuator.windup": Unlisted(
        WINDUP,
        "an integrator with a clamp against winding up (Astrom, Hagglund, PID Controllers, 1995, section 3.5)",
        {"clamp": (1.5e-5, 4e-4), "rate": (2.0, 15.0)},
    ),
    "x.actuator.leak": Unlisted(
        LEAK,
        "the piston's seal leaks like an orifice: with the root of the pressure",
        {"speed": (3e-4, 8e-3)},
        ("actuator.compliance",),
    ),
    "x.actuator.stiction": Unlisted(
        STICTION,
        "the spool sticks where it stops, until the error breaks it loose",
        {"error": (2e-5, 6e-4)},
        ("actuator.deadband",),
    ),
    "x.actuator.single_rod": Unlisted(
        CYLINDER, "the piston's faces differ: it moves faster one way", {"share": (0.01, 0.2)}
    ),
    "x.actuator.gimbal": Unlisted(
        GIMBAL,
        "a short swivel turns with the motion, which lifts the rod by y²/2L",
        {"curvature": (0.5, 40.0)},
    ),
    "x.actuator.scale": Unlisted(
        SCALE, "the loop's own transducer has a cubic error of scale", {"share": (0.004, 0.15)}
    ),
}


@jit
def at_loop(code: float, sizes: Array, kept: Array, seen: Array, added: Array) -> None:
    """An effect on what the loop wants, or on the way from the piston to the specimen."""
    a, b, h = sizes[0], sizes[1], seen[STEP]
    y, v, force = seen[PISTON], seen[PISTON_RATE], seen[FORCE]
    if code == ENCODER:
        kept[0] += abs(v) * h
        if kept[0] > b:
            kept[0] -= b
            kept[1] += math.copysign(a, v)
        added[DEMAND] = kept[1]
    elif code == HOSE:
        added[DEMAND] = -a * force * abs(force) / LOADED**2
    elif code == WINDUP:
        kept[0] = min(max(kept[0] + b * seen[ERROR] * h, -a), a)
        added[DEMAND] = kept[0]
    elif code == GIMBAL:
        added[SHIFT] = 0.5 * a * y * y
    elif code == SCALE:
        added[DEMAND] = -a * y**3 / MIDDLE**2


@jit
def at_valve(code: float, sizes: Array, kept: Array, seen: Array, added: Array) -> None:
    """An effect on the oil's flow."""
    a, v, force = sizes[0], seen[PISTON_RATE], seen[FORCE]
    if code == PULSATION:
        added[SPEED] = a * math.sin(2.0 * math.pi * sizes[1] * seen[TIME])
    elif code == WARM_OIL:
        kept[0] += abs(force * v) * seen[STEP]
        added[SPEED] = a * (1.0 - math.exp(-kept[0] / WORK))
    elif code == LEAK:
        added[FLOW] = -a * math.copysign(math.sqrt(abs(force) / LEAKED), force)
    elif code == STICTION:
        added[SPEED] = -1.0 if abs(seen[ERROR]) < a and abs(v) < SLOW else 0.0
    elif code == CYLINDER:
        added[SPEED] = math.copysign(a, seen[ERROR])


@jit
def hold(code: float, sizes: Array, kept: Array, seen: Array, added: Array) -> None:
    """Write into `added` what an effect of the actuator adds over the next step."""
    at_loop(code, sizes, kept, seen, added)
    at_valve(code, sizes, kept, seen, added)
