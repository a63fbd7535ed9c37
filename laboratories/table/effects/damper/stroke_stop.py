"""End stops of the damper's guide rail, which it hits beyond a stroke.

    m·(s̈ + ÿ) = −k·s − c·ṡ + u − stiffness·(|s| − stroke)·sgn(s) where |s| > stroke

`stroke` is the distance from the middle to one stop. The parameter `law` chooses another formula:

    1   a contact that becomes stiffer with its depth d and takes energy away, as rubber does (Hunt and Crossley):
        stiffness·d·(d/1 mm)^(exponent − 1)·(1 + damping·ḋ), never pulling; exponent 1.5 is Hertz's contact

Not to be confused with `damper.force_limit`: a stop changes the
force at the largest strokes only.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Contact, Law, Parameter
from laboratories.effects.laws import sets, which_law

STIFF = {"stiffness": 2000.0}

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
    further={
        "": which_law(1.0, "0 a spring, 1 a contact that becomes stiffer with its depth and is damped"),
        "stop_exponent": Parameter(
            "exponent",
            "",
            null=1.0,
            least=1.0,
            most=3.0,
            sizes=(1.0, 1.5),
            says="of the force over the depth under law 1",
            shape=True,
        ),
        "stop_damping": Parameter(
            "damping",
            "s/m",
            null=0.0,
            least=0.0,
            most=10.0,
            sizes=(0.5, 2.0),
            says="share of the force of law 1 that is added for each m/s of approach",
            shape=True,
        ),
    },
    laws=(Law("spring", STIFF), Law("Hunt and Crossley", {**STIFF, "exponent": 1.3, "damping": 1.0})),
    says="the damper hits its end stops",
    reference="Hunt, Crossley, J. Appl. Mech. 42 (1975) 440-445",
    contact=Contact(
        motion="damper_stroke",
        force="damper_force",
        place="stroke",
        stiffness="stiffness",
        starts=(500.0, 5000.0, 50000.0),
    ),
)
