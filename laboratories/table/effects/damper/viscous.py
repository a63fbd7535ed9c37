"""The damper's dashpot is stronger or weaker than planned.

    m·(s̈ + ÿ) = −k·s − factor·c·ṡ + u

With `law` 1 its force grows with another power of the speed: factor·c·ṡ·(|ṡ|/0.1 m/s)^(exponent − 1), as that of an
orifice (2) or of a fluid that thins (below 1). Nothing changes where the plan has c = 0. Not to be confused with
`damper.friction`: with a dashpot a free oscillation decays exponentially, with friction linearly.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import factor_on, which_law
from models.system import System


def apply(system: System, factor: float, law: float = 0.0, exponent: float = 1.0) -> System:
    """The dashpot times `factor`, and the exponent of law 1."""
    system = system.scaled("damper", "damping", factor)
    return system.laid("damper", damping_exponent=exponent) if law != 0.0 else system


EFFECT = factor_on(
    "damper",
    "viscous",
    apply,
    says="the damper's dashpot is stronger or weaker",
    reference="c_true = factor·c; Soong, Dargush, Passive Energy Dissipation Systems, Wiley 1997",
    bounds=(0.0, 50.0),
    sizes=(0.4, 0.7, 0.9, 1.15, 1.6, 2.5),
    further=(
        which_law(1.0, "0 with the speed, 1 with a power of the speed"),
        Parameter(
            "exponent",
            "",
            null=1.0,
            least=0.2,
            most=3.0,
            sizes=(0.6, 1.6),
            says="power of the speed under law 1",
            shape=True,
        ),
    ),
    laws=(Law("with the speed", {}), Law("with a power of the speed", {"exponent": 1.2})),
)
