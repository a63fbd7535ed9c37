"""The link plug-in that a reality names, one instance per receiving laboratory."""

from __future__ import annotations

from common.mailbox import LinkModel, PerfectLink
from common.plugins import construct, find
from common.reality import Reality


def link_model(reality: Reality) -> LinkModel:
    """The impairment of one direction; raises InputError where the plug-in cannot be constructed."""
    rig = reality.link
    if not rig.class_:
        return PerfectLink()
    kind = find(rig.class_, reality.base, "[link]")
    model: LinkModel = construct(kind, {"seed": reality.seed} | rig.options, "[link]")
    return model
