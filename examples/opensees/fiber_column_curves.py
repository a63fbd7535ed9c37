"""Compute the force of four fibre columns over the deformation of the seed paper's static test, as CSV.

    python examples/opensees/fiber_column_curves.py tests/data/fiber_column

Three cycles each of 1.5, 3, 4.5, 6 and 7.5 mm in steps of 0.05 mm, of which every third is written. A step for which
OpenSees finds no equilibrium is divided into shorter ones.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

from common.opensees.process import SpecimenProcess

MODEL = Path(__file__).with_name("fiber_column.py")
AMPLITUDES, CYCLES, STEPS, KEPT = (30, 60, 90, 120, 150), 3, 1, 3  # of 0.05 mm; every third one is written
COLUMNS = {"4-D22": (4, False), "8-D22": (8, False), "4-D22_bondslip": (4, True), "8-D22_bondslip": (8, True)}


def protocol() -> list[int]:
    """The deformations in multiples of 0.05 mm."""
    corners = [0, *(place for top in AMPLITUDES for place in (top, -top) * CYCLES), 0]
    path = [0]
    for start, end in pairwise(corners):
        path += range(start, end, 1 if end > start else -1)[1:]
        path.append(end)
    return path


def curve(bars: int, slip: bool) -> list[tuple[float, float]]:
    """Rows of deformation (mm) and force (kN)."""
    column = SpecimenProcess(
        "the fibre column", {"model": str(MODEL), "options": {"bars": bars, "slip": slip}}
    )
    try:
        return [(0.05 * place, 1e-3 * column.force([0.05e-3 * place])) for place in protocol()]
    finally:
        column.close()


def main() -> None:
    """Write the four curves into a folder."""
    folder = Path(sys.argv[1])
    for name, (bars, slip) in COLUMNS.items():
        rows = [f"{place:.2f},{force:.3f}" for place, force in curve(bars, slip)[::KEPT]]
        text = "\n".join(["disp_mm,force_kN", *(row.replace("-0.00,", "0.00,") for row in rows)])
        (folder / f"column_{name}.csv").write_text(f"{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
