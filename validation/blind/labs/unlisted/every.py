"""All effects of no catalogue with their sites, and the half that each is in."""

from __future__ import annotations

from validation.blind.labs.unlisted import actuator, building, column, damper, readings, table
from validation.blind.labs.unlisted.effect import Unlisted
from validation.blind.lots import number
from validation.blind.sets import HALVES

EFFECTS: dict[str, Unlisted] = {
    **building.EFFECTS,
    **actuator.EFFECTS,
    **column.EFFECTS,
    **table.EFFECTS,
    **damper.EFFECTS,
    **readings.EFFECTS,
}

# Chosen so that the parts of a test are about equally many in both halves.
SALT = 12


def site(name: str) -> str:
    """The site of an effect: its name without the first and the last part."""
    return name.removeprefix("x.").rpartition(".")[0]


def half(name: str) -> str:
    """The half that an effect is in: on one the diagnosis may be developed, on the other it is only judged."""
    return HALVES[number("half", SALT, name) % 2]
