"""The specimen yields: smooth hysteresis of Bouc and Wen, bilinear in the limit of a large exponent.

    f = α·k·δ + (1 − α)·k·δ_y·z,    dz/dδ = (1 − |z|ⁿ·(1 + sgn(z·dδ))/2) / δ_y

with yield displacement δ_y, hardening α and exponent n. The parameter `law` chooses another formula, which
`models/specimens` holds:

    1   bilinear
    2   Menegotto and Pinto, with R₀ as the exponent; reversals below `turn` times yield_displacement begin no branch
    3   peak-oriented (Clough and Johnston); `unloading` is the exponent of its unloading stiffness
    4   trilinear
    5   pinched; its reloading stiffness decreases with every cycle by `damage`
    6   pinched, with a trilinear skeleton
    7   pinched, with the corner of reloading at a share of the peak's deformation
    8   the same with a trilinear skeleton
    9   pinched, with the corner of reloading at a share of the deformation that is left where the peak is unloaded
    10  the same with a trilinear skeleton
    11  reinforced concrete: a section of layers of concrete and bars under an axial force, and an elastic shaft; R₀ of
        the bars is the exponent, and what leans on the column makes the hardening negative; it has a first stiffness of
        its own, because a planned one is seldom that of concrete without cracks
    12  the endochronic law (K. C. Valanis, Archives of Mechanics 23 (1971), 517-551; Z. P. Bažant and P. D. Bhat, J.
        Eng. Mech. Div. ASCE 102 (1976), 701-722), dz/dδ = (1 − |z|ⁿ·sgn(z·dδ)) / δ_y, which unloads by up to twice the
        elastic stiffness: with `loop` β in general Bouc and Wen's 1 − |z|ⁿ·(1 − β + β·sgn(z·dδ)), where 0.5 is law 0
    13  Bouc and Wen with loss of strength and stiffness and with pinching, after Baber and Noori (1985) and Foliente
        (1995): see `models/specimens/bwbn.py`, with γ = 1 − β and δ_ψ = 0

Laws 5 to 10 may be stronger on one side, by `asymmetry`: concrete that cracks, or bars on one side only.

Not to be confused with `column.degradation`, which softens without a loop, `column.friction`, whose loop has the same
height at every amplitude, or `column.self_centring`, whose loop closes before the origin.
"""

from __future__ import annotations

import math

from laboratories.effects.effect import Law, Parameter
from laboratories.effects.laws import sets, which_law

SKELETON = {"first_bend": 0.5, "second_stiffness": 0.5}
# Of the yield displacement. Between two ticks the noise of a command turns the motion by this much, in the laboratory
# at other times than in the replay; Menegotto and Pinto's law forgets a branch at every turn, a specimen does not.
TURN = 3e-4
RELOADING = {
    "pinch_force": 0.5,
    "pinch_displacement": 0.5,
    "unloading": 0.2,
    "damage": 0.01,
    "asymmetry": 0.0,
}
LAYERS = {
    "concrete": 5.0,
    "axial": 0.4,
    "strength": 0.5,
    "spalling": 0.15,
    "shaft": 0.6,
    "focus": 2.0,
    "core": 0.5,
    "friction": 0.02,
    "eccentricity": 0.0,
    "uncracked": 1.0,
}

DEGRADING = {
    "strength_loss": 0.01,
    "stiffness_loss": 0.02,
    "pinch_depth": 0.4,
    "pinch_place": 0.1,
    "pinch_rate": 0.2,
    "pinch_width": 0.3,
    "pinch_spread": 0.5,
}
BABER_AND_NOORI = {
    "strength_loss": "delta_nu",
    "stiffness_loss": "delta_eta",
    "pinch_depth": "zeta_s",
    "pinch_place": "q",
    "pinch_rate": "p",
    "pinch_width": "psi",
    "pinch_spread": "lambda_",
}


def share(name: str, null: float, least: float, says: str) -> Parameter:
    """A parameter of shape between `least` and 1 that only some of the laws have."""
    return Parameter(name, "", null, least, 1.0, (), says, shape=True)


def of_law(law: int, name: str, null: float, least: float, most: float, says: str) -> Parameter:
    """A parameter of shape that only one of the laws has."""
    return Parameter(name, "", null, least, most, (), f"{says}, of law {law}", shape=True)


EFFECT = sets(
    "column",
    "yielding",
    {
        "yield_displacement": Parameter(
            "yield_displacement",
            "m",
            null=math.inf,
            least=1e-05,
            most=0.1,
            sizes=(0.004, 0.0025, 0.0015, 0.0008),
            says="deformation at which it yields",
        ),
        "hardening": Parameter(
            "hardening",
            "",
            null=0.05,
            least=-0.2,
            most=1.0,
            sizes=(0.0, 0.05, 0.2),
            says="stiffness after yielding over the elastic stiffness",
            shape=True,
        ),
        "exponent": Parameter(
            "exponent",
            "",
            null=2.0,
            least=1.0,
            most=20.0,
            sizes=(1.0, 2.0, 5.0),
            says="sharpness of the transition",
            shape=True,
        ),
    },
    further={
        "law": which_law(
            13.0,
            "0 Bouc and Wen, 1 bilinear, 2 Menegotto and Pinto, 3 peak-oriented, 4 trilinear, 5 pinched, 6 both, "
            "7 and 8 as these with the corner by the peak, 9 and 10 by its rest, 11 layers of concrete and bars, 12 "
            "endochronic, 13 Bouc and Wen that degrades and pinches",
        ),
        "unloading": Parameter(
            "unloading",
            "",
            null=0.0,
            least=0.0,
            most=1.0,
            sizes=(),
            says="exponent of the unloading stiffness of laws 3 and 5 to 10",
            shape=True,
        ),
        "turn": Parameter(
            "turn",
            "",
            null=0.0,
            least=0.0,
            most=0.1,
            sizes=(),
            says="reversal over yield_displacement below which a branch of law 2 goes on",
            shape=True,
        ),
        "first_bend": share(
            "first_bend",
            1.0,
            0.02,
            "deformation at the first bend of laws 4, 6, 8 and 10 over yield_displacement",
        ),
        "second_stiffness": share(
            "second_stiffness",
            0.5,
            0.0,
            "stiffness of laws 4, 6, 8 and 10 between the bends over the elastic stiffness",
        ),
        "pinch_force": share(
            "pinch_force",
            1.0,
            0.0,
            "force at the corner of reloading of laws 5 to 10 over the force at the peak",
        ),
        "pinch_displacement": share(
            "pinch_displacement",
            1.0,
            0.0,
            "place of that corner: on the way to the peak, over the peak's deformation, or over what is left of it",
        ),
        "damage": Parameter(
            "damage",
            "",
            null=0.0,
            least=0.0,
            most=10.0,
            sizes=(),
            says="relative growth of the peak of laws 5 to 10 per plastic deformation of yield_displacement",
            shape=True,
        ),
        "yield_asymmetry": Parameter(
            "asymmetry",
            "",
            null=0.0,
            least=-0.98,
            most=0.98,
            sizes=(),
            says="strength of laws 5 to 10 on the positive side less that on the negative one, over their sum",
            shape=True,
        ),
        "concrete": of_law(11, "concrete", 5.0, 1.0, 30.0, "stiffness of the concrete over that of the bars"),
        "axial": of_law(11, "axial", 0.0, 0.0, 5.0, "axial force over that at which all bars yield"),
        "concrete_strength": of_law(
            11,
            "strength",
            0.5,
            0.1,
            3.0,
            "strength of the concrete over its stiffness times the bars' yield strain",
        ),
        "spalling": of_law(
            11,
            "spalling",
            0.0,
            0.0,
            1.0,
            "share of their strength that outer layers lose per strain of yielding bars",
        ),
        "shaft": of_law(11, "shaft", 0.6, 0.05, 0.98, "share of the flexibility outside the section"),
        "focus": of_law(
            11,
            "focus",
            2.0,
            0.1,
            100.0,
            "strain in tension over that of yielding bars to which concrete unloads",
        ),
        "core": of_law(
            11, "core", 0.1, 0.0, 1.0, "share of the outer layers' loss of strength that the core has"
        ),
        "rubbing": of_law(
            11,
            "friction",
            0.0,
            0.0,
            0.09,
            "friction of cracks over the first stiffness times yield_displacement",
        ),
        "eccentricity": of_law(
            11,
            "eccentricity",
            0.0,
            -1.0,
            1.0,
            "constant force over the same, of an axial force off the centre or of a load cell's zero",
        ),
        "uncracked": of_law(11, "uncracked", 1.0, 0.3, 5.0, "first stiffness over the planned one"),
        "yield_loop": Parameter(
            "loop",
            "",
            null=0.5,
            least=0.01,
            most=3.0,
            sizes=(),
            says="width of the loop of laws 12 and 13: 0.5 unloads with the elastic stiffness, 1 with up to twice it",
            shape=True,
            defining=True,
        ),
        "strength_loss": of_law(
            13, "strength_loss", 0.0, 0.0, 10.0, "δ_ν, loss of strength per dissipated energy over k·δ_y²"
        ),
        "stiffness_loss": of_law(
            13, "stiffness_loss", 0.0, 0.0, 10.0, "δ_η, loss of stiffness per the same energy"
        ),
        "pinch_depth": of_law(
            13, "pinch_depth", 0.0, 0.0, 0.99, "ζ_s, share of the slope that pinching takes at last"
        ),
        "pinch_place": of_law(
            13, "pinch_place", 0.1, -1.0, 1.0, "q, force at which pinching is deepest over the strength"
        ),
        "pinch_rate": of_law(
            13, "pinch_rate", 0.1, 0.0, 50.0, "p, rate at which pinching sets in with that energy"
        ),
        "pinch_width": of_law(
            13,
            "pinch_width",
            0.3,
            0.02,
            5.0,
            "ψ, width of pinching over the sum of its depth and pinch_spread",
        ),
        "pinch_spread": of_law(
            13, "pinch_spread", 0.5, 0.01, 5.0, "λ, added to the depth in the width of pinching"
        ),
    },
    laws=(
        Law("Bouc and Wen", {"hardening": 0.05, "exponent": 2.0}, "bouc_wen", {"exponent": "n"}),
        Law("bilinear", {"hardening": 0.05}, "bilinear"),
        Law(
            "Menegotto and Pinto",
            {"hardening": 0.05, "exponent": 15.0},
            "menegotto_pinto",
            {"exponent": "sharpness"},
            {"turn": TURN},
        ),
        Law("peak-oriented", {"hardening": 0.05, "unloading": 0.3}, "clough"),
        Law("trilinear", {"hardening": 0.05, **SKELETON}, "trilinear"),
        Law("pinched", {"hardening": 0.05, **RELOADING}, "pinched"),
        Law("pinched trilinear", {"hardening": 0.05, **SKELETON, **RELOADING}, "pinched"),
        Law("pinched by the peak", {"hardening": 0.05, **RELOADING}, "pinched_by_peak"),
        Law(
            "pinched by the peak, trilinear", {"hardening": 0.05, **SKELETON, **RELOADING}, "pinched_by_peak"
        ),
        Law("pinched by the rest", {"hardening": 0.05, **RELOADING}, "pinched_by_rest"),
        Law(
            "pinched by the rest, trilinear", {"hardening": 0.05, **SKELETON, **RELOADING}, "pinched_by_rest"
        ),
        Law(
            "layers of concrete and bars",
            {"hardening": 0.0, "exponent": 16.0, **LAYERS},
            "layered",
            {"exponent": "sharpness"},
        ),
        Law(
            "endochronic",
            {"hardening": 0.05, "exponent": 2.0, "loop": 1.0},
            "bouc_wen",
            {"exponent": "n", "loop": "beta"},
        ),
        Law(
            "Bouc and Wen that degrades and pinches",
            {"hardening": 0.02, "exponent": 1.5, "loop": 0.5, **DEGRADING},
            "bwbn",
            {"exponent": "n", "loop": "beta", **BABER_AND_NOORI},
        ),
    ),
    says="the specimen yields",
    reference="Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976) 249-263",
)
