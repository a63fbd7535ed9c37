"""Effects of no catalogue of laboratory A's column; what is seen and added is that of `actuator`."""

from __future__ import annotations

import math

from validation.blind.labs.parts.compiled import Array, jit
from validation.blind.labs.unlisted.actuator import ACCELERATION, LAST, LOAD, PLACE, RATE, STEP, STIFFNESS
from validation.blind.labs.unlisted.effect import Unlisted

UPLIFT, CRACK, CREEP, WEAR, MULLINS, WEDGE, CLUTCH, APPENDAGE = range(LAST + 1, LAST + 9)
REST = 1e-3  # m/s, over which friction turns round
ON_STEEL = 0.05  # damping ratio of a part that is bolted on

EFFECTS = {
    "x.column.loose_anchor": Unlisted(
        UPLIFT,
        "a loose anchor bolt: softer one way beyond a lift",
        {"share": (0.01, 0.3), "lift": (2e-4, 2e-3)},
    ),
    "x.column.closing_crack": Unlisted(
        CRACK,
        "a crack that is open at rest and closes one way",
        {"share": (0.02, 0.4), "width": (2e-4, 1e-3)},
    ),
    "x.column.creep": Unlisted(
        CREEP,
        "a standard linear solid (Zener): a share of the force relaxes",
        {"share": (0.01, 0.4), "time": (0.3, 4.0)},
        ("column.viscous",),
    ),
    "x.column.wear": Unlisted(
        WEAR,
        "stiffness is lost with the way travelled, not with the largest deformation",
        {"share": (0.01, 0.25), "way": (0.1, 0.8)},
        ("column.degradation",),
    ),
    "x.column.mullins": Unlisted(
        MULLINS,
        "filled rubber: softer below its largest deformation so far (Mullins, Rubber Chem. Tech. 42, 1969)",
        {"share": (0.01, 0.25)},
        ("column.degradation",),
    ),
    "x.column.wedge": Unlisted(
        WEDGE,
        "friction that a wedge makes grow with the deformation (ring springs)",
        {"share": (0.004, 0.1)},
        ("column.friction",),
    ),
    "x.column.clutched_inerter": Unlisted(
        CLUTCH,
        "a flywheel behind a freewheel: inertia while speeding up only (Makris, Kampas, JEM 142, 2016)",
        {"mass": (100.0, 2500.0)},
    ),
    "x.column.swinging_fixture": Unlisted(
        APPENDAGE,
        "a part of the fixture swings on the piston",
        {"mass": (100.0, 2500.0), "frequency": (4.0, 25.0)},
        ("column.inertia",),
    ),
}


@jit
def hold(code: float, sizes: Array, kept: Array, seen: Array, added: Array) -> None:
    """Write into `added` what an effect of the column adds over the next step."""
    a, b, h, k = sizes[0], sizes[1], seen[STEP], seen[STIFFNESS]
    x, w, acceleration = seen[PLACE], seen[RATE], seen[ACCELERATION]
    if code == UPLIFT:
        added[LOAD] = -a * k * max(x - b, 0.0)
    elif code == CRACK:
        added[LOAD] = -a * k * min(max(x, 0.0), b)
    elif code == CREEP:
        kept[0] += (a * x - kept[0]) * h / b
        added[LOAD] = -k * kept[0]
    elif code == WEAR:
        kept[0] += abs(w) * h
        added[LOAD] = -a * k * x * (1.0 - math.exp(-kept[0] / b))
    elif code == MULLINS:
        kept[0] = max(kept[0], abs(x))
        added[LOAD] = -a * k * x * (1.0 - abs(x) / kept[0]) if kept[0] > 0.0 else 0.0
    elif code == WEDGE:
        added[LOAD] = a * k * abs(x) * math.tanh(w / REST)
    elif code == CLUTCH:
        added[LOAD] = a * acceleration if acceleration * w > 0.0 else 0.0
    elif code == APPENDAGE:
        omega = 2.0 * math.pi * b
        inner = omega * omega * kept[0] + 2.0 * ON_STEEL * omega * kept[1]
        kept[1] -= (inner + acceleration) * h
        kept[0] += kept[1] * h
        added[LOAD] = -a * inner
