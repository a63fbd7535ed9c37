"""A data file, its map and what an import says of them, for tests of imports."""

from __future__ import annotations

from typing import Any

import numpy as np

from common.recording.imported import ImportedData, imported
from common.recording.run import Run

PLAN = '[test]\ninterval = 0.01\nduration = 1.0\n[compensator]\nkind = "none"\n'
TIMES = 0.01 * np.arange(400)
COMMAND = 5.0 * np.sin(2.0 * np.pi * 0.7 * TIMES)  # mm
LATE = 5.0 * np.sin(2.0 * np.pi * 0.7 * (TIMES - 0.045))
FORCE = 12.5 * LATE  # kN at 12.5 kN/mm


def table(
    head: str, *columns: Any, between: str = ",", decimal: str = ".", below: str = "", above: str = ""
) -> str:
    rows = (
        between.join(f"{value:.9f}".replace(".", decimal) for value in row)
        for row in zip(*columns, strict=True)
    )
    return "\n".join([*([above] if above else []), head, *([below] if below else []), *rows]) + "\n"


def known(run: Run) -> ImportedData:
    """The statements of a recording about its import."""
    found = imported(run)
    assert found is not None
    return found


DRIVE = (
    'actuator_command = { column = "u", unit = "mm" }\ncolumn_displacement = { column = "y", unit = "mm" }\n'
)
