"""Resonance of the table's oil column: the platform vibrates relative to the servo loop's motion.

    Y(s) = ω_o²/(s² + 2ζ_o·ω_o·s + ω_o²)·Y_loop(s),    ω_o = 2π·frequency, ζ_o = damping

A loop that measures the platform itself, or its pressure, leaves a part of the resonance only; so do a specimen that
swings on the platform, and the foundation. A platform that its loop moves through a spring and a dashpot, as a soft
fixture, is late by no 2ζ_o/ω_o. The parameter `law` chooses these formulas:

    1   Y(s) = (1 − share + share·ω_o²/(s² + 2ζ_o·ω_o·s + ω_o²))·Y_loop(s)
    2   Y(s) = (2ζ_o·ω_o·s + ω_o²)/(s² + 2ζ_o·ω_o·s + ω_o²)·Y_loop(s)

Not to be confused with `table.bandwidth`: the resonance raises amplitudes near its own frequency.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

EFFECT = sets(
    "table",
    "oil_column",
    {
        "oil_frequency": Parameter(
            "frequency", "Hz", null=math.inf, least=1.0, most=500.0, sizes=(40.0, 25.0, 16.0, 10.0)
        ),
        "oil_damping": Parameter(
            "damping",
            "",
            null=0.1,
            least=0.005,
            most=1.0,
            sizes=(0.03, 0.1, 0.3),
            says="damping ratio",
            shape=True,
        ),
    },
    further={
        "oil_law": which_law(
            2.0,
            "0 the whole motion passes through the resonance, 1 a share of it, 2 its dashpot moves with the loop",
        ),
        "oil_share": Parameter(
            "share",
            "",
            null=1.0,
            least=0.001,
            most=1.0,
            sizes=(0.03, 0.1, 0.3),
            says="of the motion that passes through the resonance of law 1",
            shape=True,
        ),
    },
    laws=(
        Law("whole", {"damping": 0.1}),
        Law("in part", {"damping": 0.05, "share": 0.1}),
        Law("on a spring and a dashpot", {"damping": 0.1}),
    ),
    says="a resonance on top of the table's loop",
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
    of_loop=True,
)
