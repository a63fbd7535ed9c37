"""A share of the damper's mass lies behind a coupling that gives way: a belt, a shaft, a payload on its bracket.

    m₁ = (1 − share)·m, m₂ = share·m,    w = how far m₂ is ahead of m₁
    m₂·(s̈ + ÿ + ẅ) = −f,   f = m₂·(ω²·w + 2ζω·ẇ),   ω = 2π·frequency, ζ = damping

with f on m₁ the other way. The parameter `law` chooses another formula:

    1   a coupling with play: no force within it, and beyond it f with w less a half of `play`, which only pushes

The stroke that is read is that of m₁. Not to be confused with `damper.friction`: what the second mass takes it gives
back.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

EFFECT = sets(
    "damper",
    "second_mass",
    {
        "second_frequency": Parameter(
            "frequency",
            "Hz",
            null=math.inf,
            least=1.0,
            most=300.0,
            sizes=(100.0, 50.0, 25.0, 12.0),
            says="of a share of the mass on its coupling",
        ),
        "second_mass": Parameter(
            "share",
            "",
            null=0.2,
            least=0.005,
            most=0.9,
            sizes=(0.05, 0.2, 0.5),
            says="of the mass, behind the coupling",
            shape=True,
        ),
        "second_damping": Parameter(
            "damping",
            "",
            null=0.1,
            least=0.002,
            most=2.0,
            sizes=(0.02, 0.1, 0.5),
            says="ratio of the coupling's dashpot",
            shape=True,
        ),
    },
    further={
        "": which_law(1.0, "0 an elastic coupling, 1 one with play"),
        "second_play": Parameter(
            "play",
            "m",
            null=0.0,
            least=0.0,
            most=0.01,
            sizes=(3e-05, 0.0002, 0.001),
            says="whole play of the coupling of law 1",
            shape=True,
        ),
    },
    laws=(
        Law("elastic", {"damping": 0.1, "share": 0.2}),
        Law("with play", {"damping": 0.3, "share": 0.2, "play": 2e-4}),
    ),
    says="a part of the mass lies behind a coupling",
    reference="Nordin, Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002) 1633-1649",
)
