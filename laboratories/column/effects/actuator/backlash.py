"""Play in the clevis between piston and specimen.

    |y_piston − y| ≤ width/2, and y moves only when the play is used up

`width` is the whole play, from one flank to the other. With `law` 1 it lies before the servo loop, in the linkage or
the converter by which the loop receives its command:

    T·ẏ = K·r − y,    |u(t − L) − r| ≤ width/2, and r moves only when the play is used up

The loop then approaches a target that stands still; behind the loop the specimen stands still at once at a reversal.
With `law` 2 the play behind the loop is greased rather than dry: the specimen's force f moves it through the play

    τ·k·(ẏ_piston − ẏ) = f(y)    inside the play,    τ = spring_back, k the specimen's planned stiffness

Not to be confused with `column.slip`, where the specimen moves but gives no force, or with `actuator.deadband`, which
acts on the loop's error and has no memory.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

EFFECT = sets(
    "actuator",
    "backlash",
    {
        "backlash": Parameter(
            "width",
            "m",
            null=0.0,
            least=0.0,
            most=0.005,
            sizes=(2e-05, 6e-05, 0.0002, 0.0006),
            says="whole play",
            swallows=True,
        ),
    },
    further={
        "backlash_law": which_law(
            2.0, "0 between piston and specimen, behind the servo loop, 1 before it, 2 behind it and greased"
        ),
        "spring_back": Parameter(
            "spring_back",
            "s",
            null=0.01,
            least=1e-4,
            most=1.0,
            sizes=(0.01,),
            says="time in which the specimen springs back through the play of law 2",
            shape=True,
        ),
    },
    laws=(Law("behind the loop", {}), Law("before the loop", {}), Law("greased", {"spring_back": 0.01})),
    says="play between piston and specimen, or before the servo loop",
    reference="Nordin, Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002) 1633-1649",
    actuators=("fopdt",),
)
