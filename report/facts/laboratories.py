"""The laboratories of a recording: the roles that host them, and the names of their signals.

The plan inside a recording names the kinds. The signals of a user's kind are read from the recording itself. A
recording is data: nothing here runs a class that its plan names, so that it opens on machines that do not have that
class.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from common.plan.kinds import COLUMN, TABLE, planned
from common.plan.plan import Plan
from common.plan.read import parse
from common.recording.run import Run
from common.roles import MASTER, SLAVE, kind_of
from common.signals import RATES, Channels, Signal
from laboratories.column.kind import COLUMN as COLUMN_KIND
from laboratories.kind import Coupling, Kind, Pictured, usual
from laboratories.table.kind import TABLE as TABLE_KIND

SHIPPED: Mapping[str, Kind] = {COLUMN: COLUMN_KIND, TABLE: TABLE_KIND}
LETTERS = {MASTER: " A", SLAVE: " B"}
BEFORE = {MASTER: "absolute_acceleration", SLAVE: "command_seq"}  # the row before a laboratory's own


class LaboratoryFacts(NamedTuple):
    """A laboratory as a recording shows it."""

    role: str
    topic: str  # in the given recording, which may be the part of one slave
    channels: Channels
    pictured: Pictured
    plan: Plan | None = None  # as the role sees it
    coupling: Coupling | None = None  # None for a kind that does not ship
    letter: str = ""  # " A" or " B" where the other laboratory is of the same kind

    @property
    def late(self) -> int:
        """Ticks from the recorded target to the measurement at which it should be reached."""
        return 0 if self.topic == MASTER else 1

    @property
    def name(self) -> str:
        """The part that it moves, in a word."""
        return self.pictured.name + self.letter

    @property
    def label(self) -> str:
        """The name of its motion."""
        return f"{self.pictured.name} {self.pictured.position}{self.letter}"


def whole_plan(run: Run) -> Plan | None:
    """The whole plan inside a recording; None where there is none.

    Raises:
        PlanError: it is no plan.
    """
    text = run.metadata.get("plan", {}).get("toml")
    return _parsed(text, run.path) if text else None


@lru_cache(maxsize=8)
def _parsed(text: str, path: Path) -> Plan:
    return parse(text, path.parent, f"the plan in {path}")


def plan_of(run: Run) -> Plan | None:
    """The plan inside a recording, as the slave sees it whose part of a recording it is; None where there is none."""
    plan = whole_plan(run)
    return plan.of(run.part_of) if plan is not None and run.part_of else plan


def views(run: Run) -> dict[str, Run]:
    """The recording as pictures show it: each slave with the master, by role; the master alone without slaves."""
    return {role: run.of(role) for role in run.roles} or {MASTER: run}


def laboratories(run: Run) -> list[LaboratoryFacts]:
    """The laboratories of a recording, the master's first; raises PlanError as `whole_plan`."""
    plan = whole_plan(run)
    found = [
        laboratory(
            run.part_of if topic == SLAVE and run.part_of else topic, topic, plan, run.units.get(topic, {})
        )
        for topic in (MASTER, *run.roles)
        if topic in run.columns
    ]
    return lettered([lab for lab in found if lab is not None])


def lettered(labs: list[LaboratoryFacts]) -> list[LaboratoryFacts]:
    """The laboratories with a letter where the master's and a slave's would otherwise have the same name."""
    names = {lab.pictured.name for lab in labs if lab.topic == MASTER}
    alike = names & {lab.pictured.name for lab in labs if lab.topic != MASTER}
    return [
        lab._replace(letter=LETTERS[kind_of(lab.topic)]) if lab.pictured.name in alike else lab
        for lab in labs
    ]


def alike(labs: Iterable[LaboratoryFacts]) -> list[list[LaboratoryFacts]]:
    """The laboratories, grouped so that slaves with the same signals are together."""
    found: dict[Any, list[LaboratoryFacts]] = {}
    for lab in labs:
        found.setdefault((lab.topic == MASTER, lab.channels, lab.letter), []).append(lab)
    return list(found.values())


def laboratory(role: str, topic: str, plan: Plan | None, units: Mapping[str, str]) -> LaboratoryFacts | None:
    """The laboratory of a role whose topic holds signals of these units; None where it has none or it is not known."""
    kind = planned(kind_of(role), "") if plan is None else plan.kinds.get(role, "")
    part = plan.of(role) if plan is not None and kind else None
    if kind in SHIPPED:
        known = SHIPPED[kind]
        coupling = known.coupling(part) if part is not None else None
        return LaboratoryFacts(role, topic, known.channels, known.pictured, part, coupling)
    channels = recorded_channels(topic, units) if kind else None
    return None if channels is None else LaboratoryFacts(role, topic, channels, usual(channels), part)


def recorded_channels(topic: str, units: Mapping[str, str]) -> Channels | None:
    """The channels of a user's kind, by the order of its topic's fields; None where some are missing.

    The order is: target, force of a motor if there is one, command, measured signals. The first measured signal in the
    target's unit is the position, the first in newtons the force.
    """
    names = [*units]
    after = names.index(BEFORE[kind_of(topic)]) + 1 if BEFORE[kind_of(topic)] in names else len(names)
    end = names.index("numerical_force") if "numerical_force" in names[after:] else len(names)
    rows = [Signal(name, units[name], name.replace("_", " ")) for name in names[after:end]]
    rates = {f"{rows[0].name}_{rate}" for rate in RATES} if rows else set()
    own = [row for row in rows if row.name not in rates]
    effort = own.pop(1) if len(own) > 2 and own[1].unit == "N" else None
    target, command, measured = own[:1], own[1:2], own[2:]
    position = [row.name for row in measured if row.unit == target[0].unit]
    force = [row.name for row in measured if row.unit == "N"]
    if not (position and force):
        return None
    return Channels(target[0], command[0], tuple(measured), position[0], force[0], effort)
