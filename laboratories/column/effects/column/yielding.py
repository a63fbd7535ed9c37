"""The specimen yields: smooth hysteresis of Bouc and Wen, bilinear in the limit of a large exponent.

    f = α·k·δ + (1 − α)·k·δ_y·z,    dz/dδ = (1 − |z|ⁿ·(1 + sgn(z·dδ))/2) / δ_y

with yield displacement δ_y, hardening α and exponent n. Not to be confused with `column.degradation`,
which softens without a loop, or `column.friction`, whose loop has the same height at every amplitude.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "column",
    "yielding",
    {
        "yield_displacement": Parameter(
            "yield_displacement",
            "m",
            null=math.inf,
            least=1e-05,
            most=0.1,
            sizes=(0.004, 0.0025, 0.0015, 0.0008),
        ),
        "hardening": Parameter(
            "hardening",
            "",
            null=0.05,
            least=-0.2,
            most=1.0,
            sizes=(0.0, 0.05, 0.2),
            says="stiffness after yielding over elastic",
            shape=True,
        ),
        "exponent": Parameter(
            "exponent",
            "",
            null=2.0,
            least=1.0,
            most=20.0,
            sizes=(1.0, 2.0, 5.0),
            says="sharpness of the transition",
            shape=True,
        ),
    },
    says="the specimen yields",
    reference="Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976) 249-263",
)
