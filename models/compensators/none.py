"""No compensation: the command is the target, `u = r` (m).

Not to be confused with a switched-off actuator: the target still moves it, one actuator delay late.
"""

from __future__ import annotations

from typing import NamedTuple

from common.plan.schema import Rule


class NoParams(NamedTuple):
    """No parameters."""


RULES: dict[str, Rule] = {}
