"""The sites of effects: the building, the link, and the parts of each kind of laboratory."""

from __future__ import annotations

from collections.abc import Iterable

from common.plan.plan import Plan
from common.roles import MASTER
from laboratories.column.kind import COLUMN
from laboratories.kind import Kind
from laboratories.kinds import kinds_of
from laboratories.table.kind import TABLE

STRUCTURE, LINK = "structure", "link"
BUILDING = ("ground", STRUCTURE)
OF_TEST = (*BUILDING, LINK)  # in no laboratory


def sensors(kind: Kind) -> tuple[str, ...]:
    """The sites of a kind's sensors, one per measured channel."""
    return tuple(f"sensor.{name}" for name in kind.channels.names)


def is_sensor(site: str) -> bool:
    """Whether a site is a sensor, also under the name that it has in a test with several laboratories of a kind."""
    return "sensor." in site


def of_kind(kind: Kind) -> tuple[str, ...]:
    """The sites in a laboratory of a kind, its sensors last."""
    return (*kind.sites, *sensors(kind))


def of_kinds(own: Kind | None, others: Iterable[Kind]) -> tuple[str, ...]:
    """The sites of a test in the order in which effects are listed, each once; `own` is the kind at the master."""
    mine, others = ([own] if own else []), list(others)
    link = [LINK] if others else []
    machines = [*(site for kind in mine for site in kind.sites), *link]
    machines += [site for kind in others for site in kind.sites]
    read = [site for kind in (*mine, *others) for site in sensors(kind)]
    return tuple(dict.fromkeys((*BUILDING, *machines, *read)))


SITES = of_kinds(COLUMN, (TABLE,))
"""The sites of the kinds that ship."""


def of_plan(plan: Plan) -> tuple[str, ...]:
    """The sites that the test of a plan has; raises InputError where one of its kinds cannot be loaded."""
    kinds = kinds_of(plan)
    found = of_kinds(kinds.pop(MASTER, None), kinds.values())
    if plan.foreign:  # a model that another program computes, of which no effect is known
        found = tuple(site for site in found if site != STRUCTURE)
    return found if LINK in found or not plan.roles else (*found, LINK)


def holders(plan: Plan, site: str) -> tuple[str, ...]:
    """The roles whose laboratory has a site, none for one that is in no laboratory; raises InputError as `of_plan`."""
    return tuple(role for role, kind in kinds_of(plan).items() if site in of_kind(kind))
