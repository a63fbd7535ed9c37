"""The places where an effect can be, and the role whose laboratory holds each."""

from __future__ import annotations

from common.roles import MASTER, SLAVE
from common.signals import MEASURED

SITES = {
    "ground": "",
    "structure": "",
    "actuator": MASTER,
    "column": MASTER,
    "link": "",
    "table": SLAVE,
    "damper": SLAVE,
    **{f"sensor.{name}": role for role, names in MEASURED.items() for name in names},
}
"""Role by site, empty for what stands in no laboratory; in the order in which effects are listed."""
