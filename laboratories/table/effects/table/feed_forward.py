"""Feed-forward of velocity and acceleration: three-variable control adds them to what the table's loop follows.

    u_loop = u + velocity·(2ζ/ω)·v + acceleration·(1/ω²)·v̇,    lag·v̇ + v = u̇

so that without dead time, with the lag λ,

    Y(s) = (1 + (velocity·2ζ/ω·s + acceleration·s²/ω²)/(1 + λ·s))·ω²/(s² + 2ζω·s + ω²)·U(s)

which is a servo-hydraulic loop of third order. Of what makes a loop without lag follow its command at once `velocity`
and `acceleration` are shares. Where velocity is negative, the loop has a lag more. A controller computes both
derivatives from tick to tick. The parameter `law` says which of them it has:

    0   velocity alone
    1   both

Not to be confused with `table.delay` or `table.damping`: at low frequency all three change a delay, here by
−velocity·2ζ/ω.
"""

from __future__ import annotations

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

EFFECT = sets(
    "table",
    "feed_forward",
    {
        "feed_velocity": Parameter(
            "velocity",
            "",
            null=0.0,
            least=-3.0,
            most=3.0,
            sizes=(0.1, 0.2, 0.4, 0.8),
            says="share of what makes up for the loop's damping",
        ),
    },
    further={
        "": which_law(1.0, "0 of velocity, 1 of velocity and acceleration"),
        "feed_acceleration": Parameter(
            "acceleration",
            "",
            null=0.0,
            least=-3.0,
            most=3.0,
            sizes=(0.3, 0.9),
            says="share of what makes up for the loop's inertia, of law 1",
            shape=True,
        ),
        "feed_lag": Parameter(
            "lag",
            "s",
            null=0.001,
            least=0.0002,
            most=0.05,
            sizes=(),
            says="of the filter behind which both are computed",
            shape=True,
        ),
    },
    laws=(
        Law("of velocity", {}),
        Law("of velocity and acceleration", {"acceleration": 0.7, "lag": 0.002}),
    ),
    says="velocity and acceleration of the command are fed forward to the table's loop",
    reference="Conte, Trombetti, Earthquake Engng Struct. Dyn. 29 (2000) 1375-1404",
    of_loop=True,
)
