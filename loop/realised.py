"""The laboratories as the reality describes them, with true parameters and effects."""

from __future__ import annotations

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.schema import nearest
from common.reality.found import LearnedEntry
from common.reality.reality import Reality
from common.roles import MASTER
from laboratories import effects
from laboratories.effects import CATALOGUE, lay, sites
from laboratories.effects.effect import Effect
from laboratories.kinds import kind_of
from models.system import System


def true_system(reality: Reality) -> System:
    """The true parameters for a role, with the effects that apply to it.

    For a reality that is not of one role the role is the master. An effect applies to every laboratory that has its
    site, or to the one that it names; effects on the building apply to all.

    Raises:
        InputError: an effect is unknown to the plan's test, has invalid parameters, is on a laboratory whose rig is a
            plug-in, which brings its own physics, or names a role that does not have its site.
    """
    one = reality if reality.whole else reality.of(MASTER)
    whole = one.whole or one
    known, own = effects.of_plan(whole.plan), effects.of_role(whole.plan, one.role)
    for (name, _), only in zip(whole.effects, whole.only, strict=True):
        check(name, only, whole.plan, known)
    for part in (one,) if reality.whole else map(whole.of, (MASTER, *whole.plan.roles)):
        check_rig(part)
    system = lay(System(one.plan), [entry for entry in one.effects if entry[0] in own], own)
    for law in one.learned:
        system = with_learned(system, law)
    return system


def with_learned(system: System, given: LearnedEntry) -> System:
    """The system whose machine follows a learned law beside its model; raises InputError for a machine that cannot."""
    machine = getattr(system.effects, given.machine, None)
    if not hasattr(machine, "learned"):
        raise InputError(
            f"machine of [[learned]] is '{given.machine}', which follows no learned law: "
            "give actuator, column, table or damper."
        )
    return system.laid(given.machine, learned=given.law)


def check(name: str, only: str, whole: Plan, known: dict[str, Effect]) -> None:
    """Raise InputError where the test of a plan cannot have an effect, or the role that the effect names cannot."""
    if name not in known:
        if name in CATALOGUE:
            raise InputError(
                f"The effect '{name}' acts on the {CATALOGUE[name].site}, which the plan's test does not have: leave "
                "it out, or change kind in [master] or [slave]."
            )
        raise InputError(f"Unknown effect '{name}' in [[effect]]: {nearest(name, known)}")
    site = known[name].site
    if only and not (site == sites.LINK and only != MASTER) and only not in sites.holders(whole, site):
        named = "one slave: leave out its slave" if only != MASTER else "the master: leave out its laboratory"
        raise InputError(
            f"The effect '{name}' does not belong to {named}, or name a laboratory that has the {site}."
        )


def check_rig(one: Reality) -> None:
    """Raise InputError where an effect is in the laboratory of a role whose rig is a plug-in."""
    rig, plan = one.master if one.role == MASTER else one.slave, (one.whole or one).plan
    if not rig.own or one.role not in plan.kinds:
        return
    places = sites.of_kind(kind_of(plan, one.role))
    for name, _ in one.effects:
        if name in CATALOGUE and CATALOGUE[name].site in places:
            raise InputError(
                f"The effect '{name}' cannot be applied to the plug-in in [{one.role}.rig]: "
                "put it into that rig, name the laboratory that it is for, or leave the rig out of the reality and "
                "the plan."
            )


def true_slaves(reality: Reality) -> dict[str, System]:
    """The true systems of all slaves, by role; raises InputError as `true_system` does."""
    return {role: true_system(reality.of(role)) for role in reality.plan.roles}
