"""Effects of no catalogue of laboratory B's table."""

from __future__ import annotations

import math

from validation.blind.labs.parts.compiled import Array, jit
from validation.blind.labs.unlisted.effect import Unlisted

# what is seen: s, s, m, m, m/s, 1/s² and 1/s (the loop's stiffness and damping), m/s², m, m/s, m/s², N; for the damper
# as well
TIME, STEP, WANTED, PLACE, RATE, SPRING, DASHPOT, ACCELERATION, STROKE, STROKE_RATE, STROKE_ACC, PUSH = range(
    12
)
SEEN = 12
# what is added: m to the command, m/s² to the table, N to the rail and to the motor
DEMAND, KICK, RAIL, MOTOR = range(4)
ADDED = 4

TANK, RATTLE, WAVE, HUM, HARD_LOOP, WARM_OIL, STUTTER, ORIFICE = range(1, 9)
LAST = ORIFICE  # effects of the damper have the codes above

SWING = 20e-3  # m, of the liquid: its frequency falls with its amplitude
SLOSH = 0.02  # damping ratio of a liquid in a tank with baffles
HIT = 2.0 * math.pi * 80.0  # rad/s, of a block on its stop
BOUNCE = 0.2  # damping ratio in contact
AWAY = 1e-3  # m, error at which a loop is stiffer by what is stated
SWIFT = 0.1  # m/s, at which an orifice holds the loop back by what is stated

EFFECTS = {
    "x.table.sloshing": Unlisted(
        TANK,
        "liquid sloshes on the table, slower the further it goes",
        {"share": (0.01, 0.25), "frequency": (0.8, 4.0)},
        ("table.second_mass",),
    ),
    "x.table.rattle": Unlisted(
        RATTLE, "a loose block knocks between two stops", {"share": (0.004, 0.12), "gap": (2e-3, 1.2e-2)}
    ),
    "x.table.wavy_rail": Unlisted(
        WAVE,
        "rolling elements: a force that is periodic in place",
        {"force": (0.03, 0.6), "pitch": (3e-3, 2e-2)},
    ),
    "x.table.hum": Unlisted(
        HUM, "a machine beside the table shakes it", {"acceleration": (0.02, 0.5), "frequency": (6.0, 45.0)}
    ),
    "x.table.hard_loop": Unlisted(
        HARD_LOOP, "the amplifier's gain rises with the loop's error", {"share": (0.01, 0.3)}
    ),
    "x.table.warm_oil": Unlisted(
        WARM_OIL,
        "the loop's damping falls as the oil warms",
        {"share": (0.03, 0.5), "time": (2.0, 6.0)},
        ("table.damping",),
    ),
    "x.table.stutter": Unlisted(
        STUTTER,
        "the table's computer pauses now and then and keeps its command",
        {"pause": (2e-3, 2.5e-2), "every": (0.3, 1.5)},
    ),
    "x.table.orifice": Unlisted(
        ORIFICE, "an orifice holds the table back by the square of its speed", {"lag": (3e-5, 1e-3)}
    ),
}


@jit
def hold(code: float, sizes: Array, kept: Array, seen: Array, added: Array) -> None:
    """Write into `added` what an effect of the table adds over the next step."""
    a, b, h = sizes[0], sizes[1], seen[STEP]
    y, v, wanted = seen[PLACE], seen[RATE], seen[WANTED]
    if code == TANK:
        omega = 2.0 * math.pi * b
        inner = omega * omega * SWING * math.sin(kept[0] / SWING) + 2.0 * SLOSH * omega * kept[1]
        kept[1] -= (inner + seen[ACCELERATION]) * h
        kept[0] += kept[1] * h
        added[KICK] = a * inner
    elif code == RATTLE:
        beyond = kept[0] - min(max(kept[0], -0.5 * b), 0.5 * b)
        push = HIT * HIT * beyond + 2.0 * BOUNCE * HIT * kept[1] if beyond != 0.0 else 0.0
        push = push if push * beyond > 0.0 else 0.0
        kept[1] -= (push + seen[ACCELERATION]) * h
        kept[0] += kept[1] * h
        added[KICK] = a * push
    elif code == WAVE:
        added[KICK] = a * math.sin(2.0 * math.pi * y / b)
    elif code == HUM:
        added[KICK] = a * math.sin(2.0 * math.pi * b * seen[TIME])
    elif code == HARD_LOOP:
        error = min(max((wanted - y) / AWAY, -3.0), 3.0)
        added[KICK] = a * seen[SPRING] * AWAY * error**3
    elif code == WARM_OIL:
        added[KICK] = a * (1.0 - math.exp(-seen[TIME] / b)) * seen[DASHPOT] * v
    elif code == STUTTER:
        if seen[TIME] % b >= a:
            kept[0] = wanted
        added[DEMAND] = kept[0] - wanted
    elif code == ORIFICE:
        added[DEMAND] = -a * v * abs(v) / SWIFT**2
