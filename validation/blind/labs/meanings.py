"""Parameters of the laboratories' formulas as the catalogue's laws state them, where these have another reference."""

from __future__ import annotations

from models import dashpot
from validation.blind.labs.parts import specimen

# The force of a power law is c·v₀·|v/v₀|ᵃ, so that its coefficient depends on the speed v₀ at which it is stated.
FACTORS: dict[tuple[str, str, str], float] = {
    ("column.viscous", "power", "coefficient"): (dashpot.REFERENCE / specimen.POWER_AT)
    ** (specimen.POWER - 1.0)
}


def as_in_catalogue(effect: str, formula: str, parameter: str, value: float) -> float:
    """The value of a parameter by the catalogue's definition."""
    return value * FACTORS.get((effect, formula, parameter), 1.0)
