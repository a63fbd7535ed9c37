"""Overlap of the servo valve: small errors of the loop cause no flow.

    T·ẏ = e − clip(e, −width/2, +width/2),    e = K·u(t − L) − y

`width` is the whole band, both signs together. With `law` 1 the edges of the overlap leak, so that the band is round:

    T·ẏ = e − width/2·tanh(2·e/width)

With `law` 2 the lands of the valve leak all over the overlap, where they let a share of the flow through, the flow gain
at null over that outside:

    T·ẏ = e − (1 − null_gain)·clip(e, −width/2, +width/2)

It is a fifth at most: with more of it and a wide overlap the loop is as good as slower.

Not to be confused with `actuator.backlash`, a play with
memory behind the piston: the dead band leaves a slow creep short of the target.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

EFFECT = sets(
    "actuator",
    "deadband",
    {
        "deadband": Parameter(
            "width",
            "m",
            null=0.0,
            least=0.0,
            most=0.005,
            sizes=(5e-05, 0.00015, 0.0004, 0.001),
            says="whole band of the error",
            swallows=True,
        ),
    },
    further={
        "deadband_law": which_law(
            2.0, "0 with sharp edges, 1 with edges that leak, 2 with lands that leak all over the overlap"
        ),
        "null_gain": Parameter(
            "null_gain",
            "",
            null=0.1,
            least=0.0,
            most=0.2,
            sizes=(0.1,),
            says="flow gain at null over that outside the overlap, of law 2",
            shape=True,
        ),
    },
    laws=(Law("sharp", {}), Law("leaking", {}), Law("open at null", {"null_gain": 0.1})),
    says="small errors of the loop cause no flow",
    reference="Merritt, Hydraulic Control Systems, Wiley 1967",
)
