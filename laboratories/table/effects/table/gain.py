"""The table's displacement is larger or smaller than commanded: calibration of its loop.

    u_true = factor·u

Not to be confused with wrong readings (`sensor.table_displacement.gain`, `sensor.table_acceleration.gain`):
here the damper is excited by the table's true motion, and both readings of the table change together.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_site

EFFECT = factor_on(
    "table",
    "gain",
    of_site("table", "gain"),
    says="the table's displacement is larger or smaller than commanded",
    reference="Y(s) = G(s)·factor·U(s)",
    bounds=(0.0, 3.0),
    sizes=(0.85, 0.93, 0.97, 1.03, 1.07, 1.15),
)
