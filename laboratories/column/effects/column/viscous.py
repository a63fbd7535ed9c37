"""The specimen's force depends on the rate of deformation.

    f = f_column + coefficient·δ̇

With `law` 1 it is a power of the rate, coefficient·v₀·|δ̇/v₀|^exponent with v₀ = 0.1 m/s. With `law` 2 the specimen
itself is such a dashpot behind a spring of `stiffness`, as a fluid damper with its brackets: it takes the place of the
planned specimen, unless another effect does (`models/dashpot.py`). With `law` 3 a dashpot behind such a spring lies
beside the specimen and is linear, as in concrete or rubber that relaxes:

    f = f_column + f_m,    ḟ_m = stiffness·δ̇ − f_m·stiffness/coefficient

With `law` 4 the dashpot of law 1 takes the place of the planned one, as that of a fluid damper that was planned linear.

A linear specimen with the branch of law 3 is also one with a dashpot of coefficient·(1 + k/stiffness) beside it whose
load cell has a lag of coefficient/stiffness: one cause instead of two.

Not to be confused with a lag of the load cell or of the displacement reading, which gives a linear specimen the same
loop; nor with `column.friction`, whose force does not grow with speed.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

EFFECT = sets(
    "column",
    "viscous",
    {
        "viscous": Parameter(
            "coefficient",
            "N·s/m",
            null=0.0,
            least=0.0,
            most=1e9,
            sizes=(3000.0, 10000.0, 40000.0, 150000.0),
        ),
    },
    further={
        "viscous_law": which_law(
            4.0,
            "0 with the rate, 1 with a power of it, 2 that behind a spring, in the specimen's place, "
            "3 linear behind a spring, beside the specimen, 4 as 1 in the planned dashpot's place",
        ),
        "viscous_exponent": Parameter(
            "exponent",
            "",
            null=1.0,
            least=0.1,
            most=2.5,
            sizes=(),
            says="power of the rate of laws 1, 2 and 4",
            shape=True,
        ),
        "viscous_stiffness": Parameter(
            "stiffness",
            "N/m",
            null=1e7,
            least=1.0,
            most=1e13,
            sizes=(),
            says="stiffness of the spring of laws 2 and 3",
            shape=True,
        ),
    },
    laws=(
        Law("with the rate", {}),
        Law("with a power of the rate", {"exponent": 0.6}),
        Law("a dashpot behind a spring in the specimen's place", {"exponent": 0.6, "stiffness": 1e7}),
        Law("a dashpot behind a spring beside the specimen", {"stiffness": 1e7}),
        Law("a power of the rate in the planned dashpot's place", {"exponent": 0.6}),
    ),
    says="force that grows with the rate of deformation",
    reference="f = f_column + coefficient·δ̇",
    timed=True,
)
