"""The specimen stiffens or softens with the deformation along an elastic curve, without a loop.

    f = f_column + share·k·δ·(δ/δ_ref)²,    δ_ref = 2 mm

With `law` 1 the stiffness changes at a bend: f = f_column + share·k·(δ − clip(δ, −bend, +bend)); with `law` 2 it
changes at a second bend as well, by `second_share`; with `law` 3 it follows another power of the deformation,
f = f_column + share·k·δ·|δ/δ_ref|^exponent, as rubber that stretches does. With a negative share the specimen softens.

Not to be confused with `column.yielding`, which dissipates energy, `column.degradation`, which is permanent, or
`column.pinching`, whose stiffness is low around the origin only.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

EFFECT = sets(
    "column",
    "hardening",
    {
        "stiffening": Parameter(
            "share",
            "",
            null=0.0,
            least=-10.0,
            most=10.0,
            sizes=(0.03, 0.08, 0.2, 0.5),
            says="additional stiffness over the elastic one: of the secant at 2 mm (laws 0, 3), beyond a bend (1, 2)",
        ),
    },
    further={
        "stiffening_law": which_law(
            3.0,
            "0 with the square of the deformation, 1 at a bend, 2 at two bends, 3 with a power of the deformation",
        ),
        "stiffening_bend": Parameter(
            "bend",
            "m",
            null=0.001,
            least=1e-05,
            most=0.1,
            sizes=(0.0005, 0.001, 0.002, 0.003),
            says="deformation at the bend of law 1, and at the first one of law 2",
            shape=True,
        ),
        "stiffening_second": Parameter(
            "second_share",
            "",
            null=0.0,
            least=-10.0,
            most=10.0,
            sizes=(),
            says="additional stiffness beyond the second bend of law 2 over the elastic one",
            shape=True,
        ),
        "stiffening_second_bend": Parameter(
            "second_bend",
            "m",
            null=0.002,
            least=1e-05,
            most=0.1,
            sizes=(),
            says="deformation at the second bend of law 2",
            shape=True,
        ),
        "stiffening_exponent": Parameter(
            "exponent",
            "",
            null=2.0,
            least=0.2,
            most=8.0,
            sizes=(1.0, 2.0, 4.0),
            says="power of law 3 by which the stiffness follows the deformation",
            shape=True,
        ),
    },
    laws=(
        Law("cubic", {}),
        Law("with a bend", {"bend": 0.001}),
        Law("with two bends", {"bend": 0.001, "second_share": 0.05, "second_bend": 0.0025}),
        Law("with a power", {"exponent": 2.0}),
    ),
    says="the specimen stiffens or softens with the deformation, without a loop",
    reference="Kerschen, Worden, Vakakis, Golinval, Mech. Syst. Signal Process. 20 (2006) 505-592",
)
