"""The motor's force is larger or smaller than commanded: motor constant, calibration of the drive.

    T_m·u̇ + u = factor·damper_command

Not to be confused with `damper.mass`, or with a wrong force reading (`sensor.damper_force.gain`), which
leaves the stroke as it was.
"""

from __future__ import annotations

from laboratories.effects.laws import factor_on, of_site

EFFECT = factor_on(
    "damper",
    "gain",
    of_site("damper", "gain"),
    says="the motor's force is larger or smaller than commanded",
    reference="T_m·u̇ + u = factor·damper_command",
    bounds=(0.0, 3.0),
    sizes=(0.85, 0.93, 0.97, 1.03, 1.07, 1.15),
)
