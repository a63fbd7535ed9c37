"""A mass that swings on the platform pulls at the table's loop: a specimen, or a frame that is bolted to it.

    (1 − share)·ÿ = ω²·(u − y) − 2ζω·ẏ + share·(ω₂²·w + 2ζ₂ω₂·ẇ),    ω₂ = 2π·frequency, ζ₂ = damping
    ẅ + ÿ + 2ζ₂ω₂·ẇ + ω₂²·w = 0,    w = how far it is ahead of the platform

The loop of the plan moves all of the mass. The parameter `law` chooses what a loop opposes to a force:

    0   its stiffness, as above
    1   its flow, as a valve does or a motor's loop of speed: ÿ = ω²·(u − y) − 2ζω·ẏ + share/(1 − share)·(ω₂²/ω)·ẇ
    2   its stiffness, which moved the platform alone when the plan's loop was found:
        ÿ = ω²·(u − y) − 2ζω·ẏ + share/(1 − share)·(ω₂²·w + 2ζ₂ω₂·ẇ)

The motion has a notch at the frequency of the mass under all, and a peak beside it. Not to be confused with
`table.oil_column`, which has the peak first, or with `table.payload`: that is the force of the active mass damper.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

# Hz: of liquid in a tank; frequencies from which a search starts are a sixth apart, as the peak and the notch of a
# specimen are a few per cent wide
SLOW = (1.7, 1.4, 1.2, 1.0, 0.84, 0.7, 0.6, 0.5)

EFFECT = sets(
    "table",
    "second_mass",
    {
        "second_frequency": Parameter(
            "frequency",
            "Hz",
            null=math.inf,
            least=0.3,
            most=100.0,
            sizes=(12.0, 10.0, 8.4, 7.0, 5.9, 4.9, 4.0, 3.4, 2.8, 2.4, 2.0, *SLOW),
            says="at which it swings on a platform that stands",
        ),
        "second_share": Parameter(
            "share",
            "",
            null=0.1,
            least=0.001,
            most=0.9,
            sizes=(0.03, 0.1, 0.3),
            says="of the mass that the loop moves",
            shape=True,
        ),
        "second_damping": Parameter(
            "damping",
            "",
            null=0.03,
            least=0.001,
            most=0.5,
            sizes=(0.01, 0.03, 0.1),
            says="ratio there",
            shape=True,
        ),
    },
    further={
        "second_law": which_law(
            2.0, "0 the loop opposes its stiffness, 1 its flow, 2 its stiffness, found without the mass"
        ),
    },
    laws=(
        Law("against a stiffness", {"share": 0.1, "damping": 0.08}),
        Law("against a flow", {"share": 0.1, "damping": 0.08}),
        Law("on a platform by itself", {"share": 0.1, "damping": 0.08}),
    ),
    says="a mass that swings on the platform pulls at the table's loop",
    reference="Conte, Trombetti, Earthquake Engng Struct. Dyn. 29 (2000) 1375-1404",
    of_loop=True,
)
