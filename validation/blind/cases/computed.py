"""The master's computation of a case's building, with an effect of no catalogue where the case has one."""

from __future__ import annotations

from collections.abc import Sequence

from common.reality.reality import Reality
from master.assembly import master_step
from master.step import MasterStep
from validation.blind.cases.case import Laid, strange_building


def building(reality: Reality, laid: Sequence[Laid]) -> MasterStep:
    """The computation of the building of a reality that has these effects."""
    return strange(reality, laid) or master_step(reality)


def strange(reality: Reality, laid: Sequence[Laid]) -> MasterStep | None:
    """The same with an effect of no catalogue, none where the building has no such effect."""
    from validation.blind.labs.unlisted.building import EFFECTS, StrangeBuilding  # compiles kernels

    item = strange_building(laid)
    return StrangeBuilding(reality, EFFECTS[item.name], item.parameters) if item else None
