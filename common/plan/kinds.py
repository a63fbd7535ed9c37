"""The names of kinds of laboratory as a plan gives them, and the tables of a plan that each kind takes.

What a kind is stands in `laboratories`; a kind of the user's is a class in a file.
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
    """The kind of a role for which a plan gives this text, which is empty where it gives none."""
    return given or (COLUMN if role == MASTER else TABLE)


def known_kind(kind: str) -> str:
    """The kind by which `TABLES_OF_KIND` knows a kind: `own` for a class of the user's."""
    return OWN if ":" in kind else kind


def check_kind(given: object, where: str) -> str:
    """The kind as a plan gives it; raises PlanError where it is none, or where a named slave would have none."""
    known = (COLUMN, TABLE) if "." in where else (COLUMN, TABLE, NONE)
    if isinstance(given, str) and (given in ("", *known) or ":" in given):
        return given
    raise PlanError(
        f"kind in [{where}] is {given!r}, but must be one of {', '.join(known)}, or 'file.py:Class' for one of "
        f"your own: {nearest(str(given), known)}"
    )
