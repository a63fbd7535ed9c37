"""The names of kinds of laboratory as a plan gives them, and the tables of a plan that each kind takes.

The package `laboratories` defines the kinds; a kind of the user's is a class in a file.
"""

from __future__ import annotations

from collections.abc import Mapping

from common.errors import PlanError
from common.plan.schema import nearest
from common.roles import MASTER

COLUMN, TABLE, NONE = "column", "table", "none"
OWN = "own"  # any kind of the user's: 'file.py:Class' or 'package.module:Class'

TABLES_OF_KIND: Mapping[str, tuple[str, ...]] = {
    TABLE: ("table", "damper", "control"),
    COLUMN: ("actuator", "column", "compensator"),
    OWN: ("device",),
}


def planned(role: str, given: str) -> str:
    """The kind of a role for which a plan gives this text; the default of the role where the text is empty."""
    return given or (COLUMN if role == MASTER else TABLE)


def known_kind(kind: str) -> str:
    """The key of a kind in `TABLES_OF_KIND`: `own` for a class of the user's, otherwise the kind itself."""
    return OWN if ":" in kind else kind


def check_kind(given: object, where: str) -> str:
    """The kind as a plan gives it; raises PlanError where it is unknown, or where a named slave is given none."""
    known = (COLUMN, TABLE) if "." in where else (COLUMN, TABLE, NONE)
    if isinstance(given, str) and (given in ("", *known) or ":" in given):
        return given
    raise PlanError(
        f"kind in [{where}] is {given!r}, but must be one of {', '.join(known)}, or 'file.py:Class' for one of "
        f"your own: {nearest(str(given), known)}"
    )
