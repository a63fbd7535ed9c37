"""The link that a reality names or impairs, one instance per receiving laboratory."""

from __future__ import annotations

import hashlib

from common.errors import InputError
from common.link.mailbox import LinkModel, PerfectLink
from common.plan.plugins import construct, find
from common.reality.reality import Reality
from loop.realised import true_system
from models.system import LinkEffects

METHODS = {"fate": ("direction", "seq", "t")}
IMPAIRED = "models.link.impaired:ImpairedLink"


def link_model(reality: Reality) -> LinkModel:
    """The impairment of one direction, to or from the slave whose reality it is.

    Raises:
        InputError: the plug-in cannot be constructed, or effects of the reality cannot be applied.
    """
    rig, options = reality.link, impairment(reality)
    if rig.class_ and options:
        raise InputError(
            "Effects on the link cannot be applied to the plug-in in [link]: leave one of them out."
        )
    if not rig.class_ and not options:
        return PerfectLink()
    kind = find(rig.class_ or IMPAIRED, reality.base, "[link]")
    arguments = {"seed": seed_of(reality)} | (options or rig.options)
    model: LinkModel = construct(kind, arguments, "[link]", METHODS)
    return model


def seed_of(reality: Reality) -> int:
    """Seed of a slave's link: the reality's for the first slave, drawn from it for the others."""
    if reality.place == 0:
        return reality.seed
    text = f"{reality.seed}:{reality.place}"
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=4).digest(), "big")


def impairment(reality: Reality) -> dict[str, float]:
    """Options of the emulated network from the reality's effects; empty without effects on the link."""
    effects = true_system(reality).effects.link
    return {} if effects == LinkEffects() else vars(effects)
