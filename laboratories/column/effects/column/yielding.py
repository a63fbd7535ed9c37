"""The specimen yields: smooth hysteresis of Bouc and Wen, bilinear in the limit of a large exponent.

    f = α·k·δ + (1 − α)·k·δ_y·z,    dz/dδ = (1 − |z|ⁿ·(1 + sgn(z·dδ))/2) / δ_y

with yield displacement δ_y, hardening α and exponent n. The parameter `law` chooses another formula: 1 the bilinear
one, 2 that of Menegotto and Pinto with R₀ as the exponent, 3 the peak-oriented one of Clough and Johnston with the
exponent `unloading` of its unloading stiffness (models/specimens). Not to be confused with
`column.degradation`, which softens without a loop, or `column.friction`, whose loop has the same height at every
amplitude.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Law, Parameter
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
    further={
        "law": Parameter(
            "law",
            "",
            null=0.0,
            least=0.0,
            most=3.0,
            sizes=(),
            says="0 Bouc and Wen, 1 bilinear, 2 Menegotto and Pinto, 3 peak-oriented",
            shape=True,
        ),
        "unloading": Parameter(
            "unloading",
            "",
            null=0.0,
            least=0.0,
            most=1.0,
            sizes=(),
            says="exponent of the unloading stiffness of law 3",
            shape=True,
        ),
    },
    laws=(
        Law("Bouc and Wen", {"hardening": 0.05, "exponent": 2.0}),
        Law("bilinear", {"hardening": 0.05}),
        Law("Menegotto and Pinto", {"hardening": 0.05, "exponent": 15.0}),
        Law("peak-oriented", {"hardening": 0.05, "unloading": 0.3}),
    ),
    says="the specimen yields",
    reference="Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976) 249-263",
)
