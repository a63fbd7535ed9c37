"""The specimen centres itself: a flag-shaped loop that closes before the origin.

Loading follows f = k·δ up to `displacement`, and the stiffness hardening·k beyond. Unloading has the stiffness k down
to the line that bends at (1 − loop)·displacement, and then follows that line (`models/specimens/self_centring.py`).
Post-tensioned frames, rocking walls and shape memory alloys behave in this way.

Not to be confused with `column.yielding`, which comes to rest away from the origin, or `column.hardening`, which has no
loop.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "column",
    "self_centring",
    {
        "centring": Parameter(
            "displacement",
            "m",
            null=math.inf,
            least=1e-05,
            most=0.1,
            sizes=(0.004, 0.0025, 0.0015, 0.0008),
            says="deformation at the bend",
        ),
        "centring_hardening": Parameter(
            "hardening",
            "",
            null=0.1,
            least=-0.2,
            most=1.0,
            sizes=(0.02, 0.1, 0.3),
            says="stiffness beyond the bend over the elastic stiffness",
            shape=True,
        ),
        "centring_loop": Parameter(
            "loop",
            "",
            null=0.6,
            least=0.1,  # with a lower loop it can hardly be told from `column.hardening`, which has none
            most=1.0,
            sizes=(0.3, 0.6, 0.9),
            says="height of the loop over the force at the bend",
            shape=True,
            defining=True,
        ),
    },
    says="the specimen centres itself: its loop closes before the origin",
    reference="Christopoulos, Tremblay, Kim, Lacerte, J. Struct. Eng. ASCE 134 (2008) 96-107",
)
