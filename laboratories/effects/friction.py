"""The parameters that all friction in the catalogue shares: how its force depends on speed, direction and way."""

from __future__ import annotations

from collections.abc import Mapping

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import which_law

VELOCITY = Parameter(
    "velocity",
    "m/s",
    null=1e-06,
    least=1e-06,
    most=0.05,
    sizes=(0.0003, 0.001, 0.003),
    says="velocity below which the force decreases, F·tanh(|v|/velocity); at its least value it is Coulomb friction",
    shape=True,
    # of the peak velocity: a fit then has a gradient, and the force is still constant for most of a cycle
    smoothing=0.03,
)

FURTHER = {
    "": which_law(1.0, "0 the same in both directions and at all speeds, 1 by direction and speed"),
    "friction_asymmetry": Parameter(
        "asymmetry",
        "",
        null=0.0,
        least=-0.95,
        most=0.95,
        sizes=(),
        says="share by which the force is larger in the positive direction, and smaller in the negative one",
        shape=True,
    ),
    "friction_drop": Parameter(
        "drop",
        "",
        null=0.0,
        least=-3.0,
        most=0.95,
        sizes=(),
        says="share by which the force decreases at high speed",
        shape=True,
    ),
    "friction_speed": Parameter(
        "speed",
        "m/s",
        null=0.02,
        least=1e-4,
        most=1.0,
        sizes=(),
        says="speed at which two thirds of that decrease are reached",
        shape=True,
    ),
}
"""Parameters of the second law, by the field that each sets; the number of the law itself sets no field."""


def laws(shapes: Mapping[str, float]) -> tuple[Law, ...]:
    """The two laws of a friction with these parameters of shape: Coulomb's, and one by direction and speed."""
    sided = {"velocity": 3e-4, "asymmetry": 0.0, "drop": 0.1, "speed": 0.02}
    return Law("Coulomb", shapes), Law("by direction and speed", {**shapes, **sided})


COULOMB = {"velocity": 1e-6}
BRISTLED = FURTHER | {
    "": which_law(
        3.0,
        "0 the same in both directions and at all speeds, 1 by direction and speed, 2 by direction and with "
        "presliding, 3 all of it",
    ),
    "presliding": Parameter(
        "presliding",
        "m",
        null=0.0,
        least=1e-6,
        most=0.02,
        sizes=(3e-05, 0.0005),
        says="distance over which the force of laws 2 and 3 approaches its size after a reversal",
        shape=True,
    ),
}
"""The same of a friction that may have bristles, with two laws more."""


def bristled() -> tuple[Law, ...]:
    """The four laws of a friction that may have bristles."""
    return (
        *laws(COULOMB),
        Law("with presliding", {"presliding": 1e-4, "asymmetry": 0.0}, fixed=COULOMB),
        Law(
            "by direction and speed, with presliding",
            {"presliding": 1e-4, "asymmetry": 0.0, "drop": 0.1, "speed": 0.02},
            fixed=COULOMB,
        ),
    )
