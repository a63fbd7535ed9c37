"""A reinforced-concrete frame of two storeys for OpenSees, as the building of a hybrid test.

Two bays of 5 m, storeys of 3 m, columns of 350 × 350 mm and beams of 300 × 450 mm with fibre sections. The middle
column of the lower storey is the laboratory's: the model has a bar in its place, which carries its axial force alone.

    [structure]
    model = "opensees:frame.py"
"""

from __future__ import annotations

from typing import Any

STOREY, BAY, LINES = 3.0, 5.0, (1, 2, 3)  # m, m, column lines
COLUMN, BEAM = (0.35, 0.35), (0.30, 0.45)  # m, width and depth
TO_BAR, BAR = 0.05, 380e-6  # m from the face to the centre of a bar, m²
MASS = 100e3  # kg of a floor
DAMPING = 0.03  # ratio of both modes of the floors
CORE, SKIN, STEEL, ELASTIC = 1, 2, 3, 4  # tags of the materials
FIBRES = 10  # over the depth of the core


def build(ops: Any) -> tuple[list[int], int]:
    """Build the frame under its own weight; returns the nodes of the floors and the direction of the ground motion."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    ops.uniaxialMaterial("Concrete02", CORE, -36e6, -0.0026, -29e6, -0.020, 0.1, 2.5e6, 2.0e9)
    ops.uniaxialMaterial("Concrete02", SKIN, -30e6, -0.0022, -6e6, -0.010, 0.1, 2.5e6, 2.0e9)
    ops.uniaxialMaterial("Steel02", STEEL, 400e6, 200e9, 0.01, 18.0, 0.925, 0.15)
    ops.uniaxialMaterial("Elastic", ELASTIC, 27e9)
    section(ops, 1, *COLUMN, (3, 2, 3))
    section(ops, 2, *BEAM, (4, 0, 4))
    ops.geomTransf("PDelta", 1)
    ops.geomTransf("Linear", 2)
    nodes(ops)
    members(ops)
    weigh(ops)
    damp(ops)
    return [11, 21], 1


def section(ops: Any, tag: int, width: float, depth: float, bars: tuple[int, int, int]) -> None:
    """Define a fibre section with its integration points; `bars` are those of the three rows."""
    half, side, core = 0.5 * depth, 0.5 * width, 0.5 * depth - TO_BAR
    ops.section("Fiber", tag)
    ops.patch("rect", CORE, FIBRES, 1, -core, -side + TO_BAR, core, side - TO_BAR)
    for z in (-side, side - TO_BAR):
        ops.patch("rect", SKIN, FIBRES, 1, -core, z, core, z + TO_BAR)
    ops.patch("rect", SKIN, 2, 1, -half, -side, -core, side)
    ops.patch("rect", SKIN, 2, 1, core, -side, half, side)
    for y, number in zip((-core, 0.0, core), bars, strict=True):
        if number:
            ops.layer("straight", STEEL, number, BAR, y, -side + TO_BAR, y, side - TO_BAR)
    ops.beamIntegration("Lobatto", tag, tag, 4)


def nodes(ops: Any) -> None:
    """Joints 1 to 3 at the ground, 11 to 13 and 21 to 23 at the floors, which are rigid along the frame."""
    for level in range(3):
        for line in LINES:
            node = 10 * level + line
            ops.node(node, BAY * line, STOREY * level)
            if level == 0:
                ops.fix(node, 1, 1, 1)
                continue
            ops.mass(node, MASS / len(LINES), MASS / len(LINES), 0.0)
            if line > 1:
                ops.equalDOF(10 * level + 1, node, 1)


def members(ops: Any) -> None:
    """Columns with the numbers of their lower joints, beams with 100 more than their left ones."""
    for level in (0, 1):
        for line in LINES:
            low = 10 * level + line
            if low == 2:
                ops.element("Truss", low, low, low + 10, COLUMN[0] * COLUMN[1], ELASTIC)
            else:
                ops.element("dispBeamColumn", low, low, low + 10, 1, 1)
            if line < LINES[-1]:
                ops.element("dispBeamColumn", low + 110, low + 10, low + 11, 2, 2)


def weigh(ops: Any) -> None:
    """Apply the weight in ten steps and keep it constant."""
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for level in (1, 2):
        for line in LINES:
            ops.load(10 * level + line, 0.0, -9.81 * MASS / len(LINES), 0.0)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("BandGeneral")
    ops.test("NormDispIncr", 1e-10, 50)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 0.1)
    ops.analysis("Static", "-noWarnings")
    if ops.analyze(10) != 0:
        raise RuntimeError("OpenSees found no equilibrium under the weight")
    ops.loadConst("-time", 0.0)


def damp(ops: Any) -> None:
    """Damp both modes of the floors alike, by mass and initial stiffness."""
    low, high = (value**0.5 for value in ops.eigen(2))  # rad/s
    ops.rayleigh(2.0 * DAMPING * low * high / (low + high), 0.0, 2.0 * DAMPING / (low + high), 0.0)
