"""Play in the table's drive.

    |u_true − u| ≤ width/2, and u_true moves only when the play is used up

`width` is the whole play, from one flank to the other; it acts before the table's own dynamics. With `law` 1 it lies
behind them, between the servo loop and the platform, which vibrates on the flanks and is dragged along by its guide
inside the play:

    ÿ = ω²·(d − clip(d, −width/2, +width/2)) + 2ζω·ḋ    in contact, ω = 2π·contact, ζ = flank,
    ÿ = guide·ḋ                                         inside the play, d = y_loop − y

With `table.oil_column` the flanks are as stiff as the oil.

Not to be confused with `table.friction`, which also distorts reversals, but whose share does not decrease with the
amplitude, or with `table.oil_column`, whose resonance is the same at every amplitude.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

EFFECT = sets(
    "table",
    "backlash",
    {
        "backlash": Parameter(
            "width",
            "m",
            null=0.0,
            least=0.0,
            most=0.02,
            sizes=(3e-05, 0.0001, 0.0004, 0.0015),
            says="whole play",
            swallows=True,
        ),
    },
    further={
        "backlash_law": which_law(1.0, "0 before the servo loop, 1 between it and the platform"),
        "flank_frequency": Parameter(
            "contact",
            "Hz",
            null=100.0,
            least=10.0,
            most=500.0,
            sizes=(),
            says="frequency of the platform on the flanks of law 1",
            shape=True,
        ),
        "flank_damping": Parameter(
            "flank",
            "",
            null=0.5,
            least=0.01,
            most=2.0,
            sizes=(),
            says="damping ratio on these flanks",
            shape=True,
        ),
        "guide": Parameter(
            "guide",
            "1/s",
            null=0.0,
            least=0.0,
            most=5000.0,
            sizes=(100.0, 600.0),
            says="rate at which a guide drags the platform along inside the play of law 1",
            shape=True,
        ),
    },
    laws=(
        Law("before the loop", {}),
        Law("behind the loop", {"contact": 100.0, "flank": 0.5, "guide": 600.0}),
    ),
    says="play in the table's drive",
    reference="Nordin, Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002) 1633-1649",
)
