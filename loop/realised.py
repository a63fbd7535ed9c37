"""What a reality says the laboratories are."""

from __future__ import annotations

from common.errors import InputError
from common.plan.reality import Reality
from common.roles import SLAVE
from laboratories.effects import CATALOGUE, lay
from laboratories.effects.sites import SITES
from models.system import System


def true_system(reality: Reality) -> System:
    """The plan's parameters as they really are, with the effects laid over them.

    Raises:
        InputError: an effect that the catalogue does not know, parameters it cannot have, an effect on a
            laboratory whose rig is a plug-in: it brings its own physics, or one that names a slave and is none of
            a slave's.
    """
    only = reality.only or ("",) * len(reality.effects)
    for (name, _), alone in zip(reality.effects, only, strict=True):
        site = CATALOGUE[name].site if name in CATALOGUE else ""
        lab = SITES.get(site, "")
        if lab and getattr(reality, lab).class_:
            raise InputError(
                f"The effect '{name}' cannot be laid over the plug-in in "
                f"[{reality.role if lab == SLAVE else lab}.rig]: "
                "put it into that rig, or leave the rig out of the reality and the plan."
            )
        if alone and site != "link" and lab != SLAVE:
            raise InputError(f"The effect '{name}' does not belong to one slave: leave out its slave.")
    return lay(System(reality.plan), reality.effects)


def true_slaves(reality: Reality) -> dict[str, System]:
    """The laboratories of all slaves as they really are, by role; raises InputError as `true_system` does."""
    return {role: true_system(reality.of(role)) for role in reality.plan.roles}
