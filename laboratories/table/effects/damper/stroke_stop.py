"""End stops of the damper's guide rail: springs that it hits beyond a stroke.

    m·(s̈ + ÿ) = −k·s − c·ṡ + u − stiffness·(|s| − stroke)·sgn(s) where |s| > stroke

`stroke` is the distance from the middle to one stop. Not to be confused with `damper.force_limit`: a stop changes the
force at the largest strokes only.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Contact, Parameter
from laboratories.effects.laws import sets

EFFECT = sets(
    "damper",
    "stroke_stop",
    {
        "stop_stroke": Parameter(
            "stroke",
            "m",
            null=math.inf,
            least=0.001,
            most=1.0,
            sizes=(0.046, 0.04, 0.03, 0.02),
            says="from the middle to one stop",
        ),
        "stop_stiffness": Parameter(
            "stiffness",
            "N/m",
            null=2000.0,
            least=200.0,
            most=1000000.0,
            sizes=(500.0, 2000.0, 20000.0),
            says="of the stop",
            shape=True,
        ),
    },
    says="the damper hits its end stops",
    reference="contact spring: stiffness·(|s| − stroke) beyond the stop",
    contact=Contact(
        motion="damper_stroke",
        force="damper_force",
        place="stroke",
        stiffness="stiffness",
        starts=(500.0, 5000.0, 50000.0),
    ),
)
