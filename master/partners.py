"""All slaves of a test together, in the plan's order: what the master does with each of them at every tick."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain

from common.host import lateness
from common.lab.laboratory import Laboratory
from common.link.mailbox import LinkModel
from common.safety.watchdog import WatchdogFinding
from common.signals import alike
from laboratories import kinds
from master.partner import Partner


class Partners:
    """The slaves of the plan; `links` are the plug-ins that delay the messages of each, by role."""

    def __init__(self, lab: Laboratory, links: Mapping[str, LinkModel]) -> None:
        plan = lab.plan
        channels = {role: kinds.kind_of(plan, role).channels for role in plan.roles}
        lab.endpoint.expect({role: len(one.names) for role, one in channels.items()})
        self.by_role = {role: Partner(role, lab, links[role], channels[role]) for role in plan.roles}
        self.all = tuple(self.by_role.values())
        self._lab = lab
        self._groups = [[self.by_role[role] for role in roles] for roles in alike(channels).values()]
        self._late = lateness.LateTicks()

    def heard(self, seq: int) -> bool:
        """Whether every slave's feedback of a tick, or of a later one, has come."""
        for partner in self.all:  # noqa: SIM110 - a generator for `all` takes twice as long
            if not partner.heard(seq):
                return False
        return True

    def begin(self, tick: int, now: int) -> list[float]:
        """Begin a tick; returns the forces (N) that it uses, those of the newest feedbacks available."""
        forces: list[float] = []
        for partner in self.all:  # a comprehension is a function call more
            forces.append(partner.begin(tick, now))
        return forces

    def silent(self, now: int) -> Partner | None:
        """The first slave that has been silent for longer than the plan's `loss_timeout`, if there is one."""
        for partner in self.all:
            if now - partner.heard_ns > self._lab.loss_ns:
                return partner
        return None

    def look(self, tick: int, worst: WatchdogFinding, who: str) -> tuple[WatchdogFinding, str]:
        """The worst finding of their watchdogs and of `worst`, that of `who`; and the name of the first that has it."""
        for partner in self.all:
            found = partner.look(tick)
            if found > worst:
                worst, who = found, partner.title
        return worst, who

    def tell_late(self, tick: int) -> None:
        """Warn if too many ticks up to this one, which has just been judged, were late with any slave.

        A delay or loss by a link plug-in belongs to the simulated network, and does not count.
        """
        late = False
        for partner in self.all:  # a generator for `any` takes twice as long
            late = late or partner.account.late_last
        if tick >= 0 and (count := self._late.take(tick, late=late)):
            self._lab.note(
                "late", lateness.sentence(count), level="warning", tick=tick, values={"late": float(count)}
            )

    def row(self, tick: int) -> list[float]:
        """The values used and sent; slaves with the same channels share each signal, with a value for each slave."""
        found: list[float] = []
        for group in self._groups:
            if len(group) == 1:
                found += group[0].row(tick)
            else:
                found += chain.from_iterable(zip(*(partner.row(tick) for partner in group), strict=True))
        return found

    def finish(self, ticks: int) -> None:
        """Write the remaining rows of latency, and the counts of the messages of every slave."""
        for partner in self.all:
            partner.account.finish(ticks - 1, self._lab.clock.now())
            text, values = partner.exchanged()
            self._lab.note("exchange", text, tick=ticks, values=values)

    def progress(self, own: dict[str, float]) -> dict[str, float]:
        """The figures of the progress report: `own` forces of the master, forces (N), round trip (s), missed deadlines.

        For several slaves with the same channels it is the largest magnitude of force, and for all slaves the longest
        round trip and the largest number of missed deadlines.
        """
        figures = dict(own)
        for group in self._groups:
            name = group[0].channels.force
            several = [partner.force for partner in group]
            force = several[0] if len(several) == 1 else max(map(abs, several))
            figures[f"{name}_used" if name in figures else name] = force
        accounts = [partner.account for partner in self.all]
        if accounts:
            figures["round_trip"] = max(account.round_trip for account in accounts)
            figures["missed"] = float(max(account.missed for account in accounts))
        return figures
