"""The limits of a laboratory's recorded values as its plan gives them, for pages; no class of a user's is run."""

from __future__ import annotations

import contextlib

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.schema import as_type
from common.signals import OF_STOREYS
from report.facts.laboratories import SHIPPED, LaboratoryFacts


def limits(plan: Plan, lab: LaboratoryFacts | None) -> dict[str, float]:
    """The limits of a laboratory's signals and of the building's, in SI units by signal's name.

    Without a laboratory those of the building alone. Of a kind of the user's own only those in `[device.limits]` are
    known, because its class is not run.
    """
    found = {name: float(value) for name, value in vars(plan.limits).items() if name in OF_STOREYS}
    if lab is None:
        return found
    kind = SHIPPED.get(plan.kinds.get(lab.role, ""))
    return found | (dict(kind.limits(plan.of(lab.role))) if kind else own(plan.of(lab.role), lab))


def own(plan: Plan, lab: LaboratoryFacts) -> dict[str, float]:
    """The limits in `[device.limits]` of the signals of a kind of the user's; `plan` is as its role sees it."""
    channels = lab.channels
    found: dict[str, float] = {}
    units = {row.name: row.unit for row in (*channels.driving, channels.command, *channels.measured)}
    for name in units.keys() & plan.device.limits.keys():
        with contextlib.suppress(InputError):  # in a unit that is not the signal's: the class refuses it
            found[name] = as_type("float", plan.device.limits[name], name, units[name])
    return found
