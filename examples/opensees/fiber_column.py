"""A reinforced-concrete column for OpenSees, with a fibre section of 250 × 250 mm, loaded 750 mm above its foot.

Concrete, steel, height and axial force are those of the seed paper's specimen (36.5 and 2.98 N/mm², D22 with 381
N/mm², axial force ratio 0.2). The paper does not state the following, which are assumed: the distance of 50 mm from the
face to the centre of the bars; the strength of the confined core, 1.15 times that of the cover; the strain of the
concrete at its strength, and its residual strength. With `slip` the bars slip in the footing by Zhao and Sritharan's
law (`Bond_SP01`).

    options = { file = "opensees/fiber_column.py", options = { bars = 4, slip = true } }
"""

from __future__ import annotations

from typing import Any

WIDTH, HEIGHT = 0.250, 0.750  # m
TO_BAR = 0.050  # m, from the face to the centre of a bar
AREA = 387.1e-6  # m², of D22
STRENGTH, TENSION, AXIAL = 36.5e6, 2.98e6, 0.2  # N/m², N/m², share of strength × gross area
YIELD, STEEL, HARDENING = 381e6, 200e9, 0.01  # N/m², N/m²
PEAK_STRAIN = 0.003  # of concrete at its strength
CONFINED = 1.15  # strength of the core over that of the cover
SLIP_AT_YIELD, SLIP_AT_END = (
    0.46e-3,
    16e-3,
)  # m: Zhao and Sritharan for D22 in that concrete; 35 times the first
PRESSED = 0.5 * WIDTH  # m, length of the compressed concrete at the foot where bars slip
FIBRES = 20  # over the width: fibres of 9 mm resolve the neutral axis
CORE, COVER, BARS = 1, 2, 3  # tags of the materials of the column; those of the foot are FOOT higher
COLUMN, FOOT = 0, 10  # tags of the sections


def build(ops: Any, bars: int = 4, slip: bool = False) -> tuple[int, int]:
    """Build the column under its axial force; returns the node at its top and the direction in which it is moved."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    materials(ops)
    section(ops, COLUMN, bars)
    ops.node(1, 0.0, 0.0)
    ops.node(2, 0.0, 0.0)
    ops.node(3, 0.0, HEIGHT)
    ops.fix(1, 1, 1, 1)
    if slip:
        section(ops, FOOT, bars)
        ops.element("zeroLengthSection", 1, 1, 2, FOOT, "-orient", 0.0, 1.0, 0.0, -1.0, 0.0, 0.0)
        ops.equalDOF(1, 2, 1)
    else:
        ops.equalDOF(1, 2, 1, 2, 3)
    ops.geomTransf("Linear", 1)
    ops.beamIntegration("Lobatto", 1, COLUMN, 5)
    ops.element("forceBeamColumn", 2, 2, 3, 1, 1, "-iter", 50, 1e-12)
    press(ops)
    return 3, 1


def materials(ops: Any) -> None:
    """Define core, cover and bars; those of the foot, where bars slip, by deformations (m) in place of strains."""
    for tag, length in ((0, 1.0), (FOOT, PRESSED)):
        for which, factor, crushed, end in ((CORE, CONFINED, 0.8, 0.020), (COVER, 1.0, 0.2, 0.010)):
            peak, strain = factor * STRENGTH, factor * PEAK_STRAIN * length
            soft = 0.1 * peak / strain
            law = (-peak, -strain, -crushed * peak, -end * length, 0.1, TENSION, soft)
            ops.uniaxialMaterial("Concrete02", tag + which, *law)
    ops.uniaxialMaterial("Steel02", BARS, YIELD, STEEL, HARDENING, 18.0, 0.925, 0.15)
    ops.uniaxialMaterial("Bond_SP01", FOOT + BARS, YIELD, SLIP_AT_YIELD, 566e6, SLIP_AT_END, 0.5, 0.8)


def section(ops: Any, tag: int, bars: int) -> None:
    """Define the fibre section; 4 bars are in the corners, the others of 8 in the middle of the sides."""
    core, cover, steel = (tag + which for which in (CORE, COVER, BARS))
    half, inner = 0.5 * WIDTH, 0.5 * WIDTH - 0.034  # m; the core ends at the hoops' centre
    bar, row = half - TO_BAR, 2 if bars == 4 else 3
    ops.section("Fiber", tag)
    ops.patch("rect", core, FIBRES, 1, -inner, -inner, inner, inner)
    ops.patch("rect", cover, 3, 1, -half, -half, -inner, half)
    ops.patch("rect", cover, 3, 1, inner, -half, half, half)
    ops.patch("rect", cover, FIBRES, 1, -inner, -half, inner, -inner)
    ops.patch("rect", cover, FIBRES, 1, -inner, inner, inner, half)
    for side in (-bar, bar):
        ops.layer("straight", steel, row, AREA, side, -bar, side, bar)
    if bars == 8:
        ops.layer("straight", steel, 2, AREA, 0.0, -bar, 0.0, bar)


def press(ops: Any) -> None:
    """Apply the axial force in ten steps and keep it constant."""
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(3, 0.0, -AXIAL * STRENGTH * WIDTH**2, 0.0)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("BandGeneral")
    ops.test("NormDispIncr", 1e-10, 50)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 0.1)
    ops.analysis("Static", "-noWarnings")
    if ops.analyze(10) != 0:
        raise RuntimeError("OpenSees found no equilibrium under the axial force")
    ops.loadConst("-time", 0.0)
