"""OpenSees' uniaxial materials as columns: calls, ranges of the parameters, and the effects that are right names.

A material takes the deformation (m) as strain and gives the force (N) as stress. Its parameters are drawn in multiples
of the plan's stiffness k and of a deformation d at which it yields, so that the default test's drifts take it far into
its inelastic range. Fixed numbers give each law its usual form; Steel02's are those of the OpenSees manual.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

Values = Mapping[str, float]
Rows = list[list[str | float]]  # calls of `uniaxialMaterial`; the last is the column

BENDS = (
    0.7e-3,
    2.0e-3,
)  # m, deformation at which a column yields: below the peaks of most of the trial's columns
YIELDING = ("column.yielding",)
PINCHED = ("column.pinching", "column.yielding", "column.degradation", "column.slip")
WORN = ("column.yielding", "column.degradation")


class Material(NamedTuple):
    """A material: its rows by the drawn values, the ranges of these, the effects whose mechanism it is."""

    rows: Callable[[Values], Rows]
    ranges: Mapping[str, tuple[float, float]]
    effects: tuple[str, ...]


def backbone(v: Values) -> list[float]:
    """Three points (force, deformation) of an envelope that yields about d."""
    k, d = v["k"], v["d"]
    return [0.7 * k * d, 0.7 * d, 1.2 * k * d, 1.7 * d, 1.2 * k * d + v["b"] * k * 8.0 * d, 9.7 * d]


def mirrored(points: list[float]) -> list[float]:
    """The envelope and its mirror image."""
    return points + [-value for value in points]


def peak_oriented(name: str, v: Values, *more: float) -> Rows:
    """Ibarra, Medina and Krawinkler's hinge, whose cap lies beyond every drift of the trial.

    OpenSees warns of its older ModIMKPinching: after a reversal just beyond yielding that one's force is zero for ever.
    """
    k, force, cap = v["k"], v["k"] * v["d"], 0.04
    # m of plastic deformation to the cap and beyond it, m to failure; N at yielding; over it the cap and the rest
    side = [cap, 0.1, 0.3, force, 1.0 + v["b"] * k * cap / force, 0.2]
    return [[name, 1, k, *side, *side, *[v["life"]] * 4, *[1.0] * 6, *more]]


MATERIALS: dict[str, Material] = {
    "Steel01": Material(
        lambda v: [["Steel01", 1, v["k"] * v["d"], v["k"], v["b"]]], {"b": (0.01, 0.2)}, YIELDING
    ),
    "Steel02": Material(
        lambda v: [["Steel02", 1, v["k"] * v["d"], v["k"], v["b"], v["r"], 0.925, 0.15]],
        {"b": (0.01, 0.2), "r": (10.0, 20.0)},
        YIELDING,
    ),
    "Hardening": Material(
        lambda v: [["Hardening", 1, v["k"], v["k"] * v["d"], 0.0, v["b"] * v["k"]]],
        {"b": (0.02, 0.3)},
        YIELDING,
    ),
    "MultiLinear": Material(lambda v: [["MultiLinear", 1, *multilinear(v)]], {"b": (0.02, 0.1)}, YIELDING),
    "BoucWen": Material(
        lambda v: [
            [
                "BoucWen",
                1,
                v["b"],
                v["k"],
                v["n"],
                *[0.5 / v["d"] ** v["n"]] * 2,
                1.0,
                0.0,
                0.0,
                0.0,
                1e-8,
                50,
            ]
        ],
        {"b": (0.02, 0.2), "n": (1.0, 2.0)},
        YIELDING,
    ),
    "IMKPeakOriented": Material(
        lambda v: peak_oriented("IMKPeakOriented", v), {"b": (0.01, 0.1), "life": (0.3, 3.0)}, WORN
    ),
    "IMKPinching": Material(
        lambda v: peak_oriented("IMKPinching", v, v["pinch"], 0.5),
        {"b": (0.01, 0.1), "pinch": (0.2, 0.6), "life": (0.3, 3.0)},
        PINCHED,
    ),
    "Pinching4": Material(
        lambda v: [["Pinching4", 1, *pinching4(v)]], {"b": (0.01, 0.05), "pinch": (0.2, 0.6)}, PINCHED
    ),
    "Hysteretic": Material(
        lambda v: [["Hysteretic", 1, *mirrored(backbone(v)), v["pinch"], v["pinch"], 0.0, 0.0, v["soften"]]],
        {"b": (0.01, 0.05), "pinch": (0.3, 1.0), "soften": (0.05, 0.5)},
        PINCHED,
    ),
    "BWBN": Material(
        lambda v: [["BWBN", 1, v["b"], v["k"], 1.2, *[0.5 / v["d"] ** 1.2] * 2, 1.0, *bwbn(v)]],
        {"b": (0.05, 0.2), "pinch": (0.5, 0.9)},
        PINCHED,
    ),
    "SAWS": Material(
        lambda v: [["SAWS", 1, v["k"] * v["d"], 0.15 * v["k"] * v["d"], 20.0 * v["d"], v["k"], *saws(v)]],
        {"b": (0.02, 0.1), "pinch": (0.02, 0.1)},
        PINCHED,
    ),
    "SelfCentering": Material(
        lambda v: [["SelfCentering", 1, v["k"], v["b"] * v["k"], v["k"] * v["d"], v["beta"]]],
        {"b": (0.05, 0.2), "beta": (0.3, 0.9)},
        (*YIELDING, "column.pinching", "column.self_centring"),
    ),
    "ElasticPPGap": Material(
        lambda v: [["Elastic", 1, (1.0 - v["share"]) * v["k"]], *gaps(v), ["Parallel", 4, 1, 2, 3]],
        {"share": (0.2, 0.6), "gap": (0.2, 0.8)},
        ("column.slip", "column.hardening"),
    ),
    "ElasticMultiLinear": Material(
        lambda v: [["ElasticMultiLinear", 1, "-strain", *elastic(v)[0], "-stress", *elastic(v)[1]]],
        {"b": (0.2, 0.6)},
        ("column.softening", "column.cubic", "column.hardening"),
    ),
    "Concrete02": Material(
        lambda v: [["Elastic", 1, 0.5 * v["k"]], *concrete(v), ["Parallel", 3, 1, 2]],
        {"soften": (0.1, 0.5)},
        (*PINCHED, "column.asymmetry"),
    ),
    "friction": Material(
        lambda v: [
            ["Elastic", 1, v["k"]],
            ["Steel01", 2, v["share"] * v["k"] * v["d"], 15.0 * v["k"], 1e-6],
            ["Parallel", 3, 1, 2],
        ],
        {"share": (0.05, 0.3)},
        ("column.friction",),
    ),
}
"""By name; every value is drawn log-uniform."""


def multilinear(v: Values) -> list[float]:
    """Deformations and forces of an envelope of four straight lines."""
    k, d = v["k"], v["d"]
    force, points = 0.0, []
    for begin, end, share in ((0.0, 0.6, 1.0), (0.6, 1.4, 0.45), (1.4, 2.5, 0.12), (2.5, 30.0, v["b"])):
        force += share * k * (end - begin) * d
        points += [end * d, force]
    return points


def pinching4(v: Values) -> list[str | float]:
    """Envelope of four points, unloading and reloading at a share of the largest, no damage."""
    k, d, pinch = v["k"], v["d"], v["pinch"]
    forces = [0.6 * k * d, 1.0 * k * d, 1.2 * k * d, 1.2 * k * d + v["b"] * k * 20.0 * d]
    points = [
        value for pair in zip(forces, (0.6 * d, 1.3 * d, 3.0 * d, 23.0 * d), strict=True) for value in pair
    ]
    return [*points, pinch, pinch, 0.1 * pinch, *[0.0] * 15, 10.0, "energy"]


def bwbn(v: Values) -> list[float | int]:
    """q, ζs, p, ψ, δψ, λ, tolerance and iterations of Baber and Noori's pinching."""
    return [0.1, v["pinch"], 1.0, 0.05, 0.005, 0.1, 1e-8, 100]


def saws(v: Values) -> list[float]:
    """Stiffness shares and exponents of Folz and Filiatrault's wall."""
    return [v["b"], -0.05, 1.0, v["pinch"], 0.7, 1.1]


def gaps(v: Values) -> Rows:
    """Two springs that carry load beyond a gap, one on either side."""
    k, share, gap = v["k"], v["share"], v["gap"] * v["d"]
    return [["ElasticPPGap", tag, share * k, sign * 1e9, sign * gap] for tag, sign in ((2, 1.0), (3, -1.0))]


def elastic(v: Values) -> tuple[list[float], list[float]]:
    """Strains and stresses of a curve that softens at d and at 3d, in both directions."""
    k, d, b = v["k"], v["d"], v["b"]
    forces = [k * d, k * d * (1.0 + 2.0 * b), k * d * (1.0 + 2.0 * b + 17.0 * b * b)]
    strains = [d, 3.0 * d, 20.0 * d]
    return [-x for x in strains[::-1]] + [0.0, *strains], [-f for f in forces[::-1]] + [0.0, *forces]


def concrete(v: Values) -> Rows:
    """Concrete that crushes slowly and cracks, parallel to an elastic half of the stiffness."""
    k, d = v["k"], v["d"]
    return [
        [
            "Concrete02",
            2,
            -0.5 * k * 2.0 * d,
            -4.0 * d,
            -0.3 * k * d,
            -30.0 * d,
            v["soften"],
            0.1 * k * d,
            0.1 * k,
        ]
    ]


def calls(name: str, stiffness: float, values: Values) -> Rows:
    """The calls that make a material for a stiffness (N/m)."""
    return MATERIALS[name].rows({"k": stiffness, **values})
