"""Names of effects and sites of a test where several laboratories have them.

A name then begins with the role of its laboratory, as in a diagnosis of two laboratories of one kind:
`master.column`, `slave.east.column.stiffness`. Elsewhere it is that of the catalogue.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from common.plan.plan import Plan
from common.roles import MASTER, slave_role
from diagnosis.report.records import Report
from diagnosis.report.values import Value
from laboratories import effects
from laboratories.effects import sites
from laboratories.effects.effect import Effect
from laboratories.kinds import kinds_of
from validation.blind.cases.case import Laid

NAMING = ("explained", "partly_explained", "ambiguous")


@dataclass(frozen=True)
class Heard:
    """What one report of a diagnosis says, in names that are unique in the whole test."""

    role: str  # of the slave that it shows beside the master
    status: str
    names: tuple[str, ...]  # of the effects in the verdict; none where the status names no cause
    probability: float | None
    parameters: Mapping[str, Mapping[str, Value]]  # of these effects
    sets: tuple[frozenset[str], ...]  # of effects that cannot be separated
    site: str  # the first, empty for none
    closed: float | None
    signs: Mapping[str, float]  # from which the probability follows


class CaseNames:
    """The names of a plan's sites and effects."""

    def __init__(self, plan: Plan) -> None:
        self._kinds = kinds_of(plan)
        self._slaves = plan.roles
        self._site_of = {name: effect.site for name, effect in effects.of_plan(plan).items()}
        # site, fault of a reading, and role and effect, all by names that are unique in the whole test
        self.sites: dict[str, str] = {}
        self.faults: dict[str, str] = {}
        self.placed: dict[str, tuple[str, Effect]] = {}
        for role in (MASTER, *plan.roles):
            for name, effect in effects.of_role(plan, role).items():
                self.sites[self.whole(role, name, effect.site)] = self.whole(role, effect.site, effect.site)
                self.faults[self.whole(role, name, effect.site)] = effect.fault
                self.placed[self.whole(role, name, effect.site)] = (role, effect)

    def whole(self, role: str, name: str, site: str) -> str:
        """The name of a site, or of an effect at it, in a role's laboratory or over its link."""
        if site in sites.BUILDING or len(self._having(site)) < 2:
            return name
        return f"{role}.{name}"

    def effect(self, item: Laid) -> str:
        """The name of an effect that a case hides."""
        return self.whole(item.role, item.name, item.site)

    def site(self, item: Laid) -> str:
        """The name of its site."""
        return self.whole(item.role, item.site, item.site)

    def heard(self, slave: str, report: Report) -> Heard:
        """The report on the master and the slave of that name."""
        role = slave_role(slave) if slave or self._slaves else MASTER

        def whole(name: str) -> str:
            return self._heard(role, name)

        first = report.which[0] if report.which and report.status in NAMING else None
        parameters = first.parameters if first else {}
        return Heard(
            role,
            report.status,
            tuple(map(whole, first.effects)) if first else (),
            first.probability if first else None,
            {whole(name): values for name, values in parameters.items()},
            tuple(frozenset(map(whole, names)) for names in report.equivalent),
            whole(report.where[0].site) if report.where else "",
            report.how_far.closed,
            {name: value for name, value in report.details.signs.items() if value is not None},
        )

    def _heard(self, role: str, name: str) -> str:
        """A name of a report, which shows the master and the slave of a role."""
        for one in dict.fromkeys((role, MASTER)):
            if name.startswith(f"{one}."):
                rest = name.removeprefix(f"{one}.")
                return self.whole(one, rest, self._site_of.get(rest, rest))
        site = self._site_of.get(name, name)
        own = MASTER in self._kinds and site in sites.of_kind(self._kinds[MASTER])
        return self.whole(MASTER if own else role, name, site)

    def _having(self, site: str) -> tuple[str, ...]:
        """The roles that have a site."""
        if site == sites.LINK:
            return self._slaves
        return tuple(role for role, kind in self._kinds.items() if site in sites.of_kind(kind))
