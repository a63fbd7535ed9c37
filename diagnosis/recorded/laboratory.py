"""A laboratory of a recorded test: its kind, and the names of its signals and sites in a record.

Where both laboratories of a record have a signal or a site of one name, sites and effects of both begin with the role
(`master.column`, `slave.column`), and signals of the slave do so too; elsewhere all names are those of the recording.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from common.plan.plan import Plan
from common.roles import MASTER
from common.signals import Signal
from laboratories import effects
from laboratories.effects import sites
from laboratories.effects.effect import Effect, Parameter
from laboratories.kind import Kind
from laboratories.kinds import kind_of


@dataclass(frozen=True)
class RecordedLaboratory:
    """One laboratory that a record shows."""

    role: str
    kind: Kind
    plan: Plan  # as the role sees it
    before: str = ""  # prefix of its sites and effects in the record
    ahead: str = ""  # prefix of its signals

    @property
    def title(self) -> str:
        """Its name in texts: laboratory A is the master's, laboratory B a slave's."""
        return "laboratory A" if self.role == MASTER else "laboratory B"

    def signal(self, name: str) -> str:
        """A signal's name in the record."""
        return self.ahead + name if name else name

    def site(self, name: str) -> str:
        """A site's name, or an effect's, in the record."""
        return self.before + name

    def sensor(self, name: str) -> str:
        """The site of the sensor behind a measured signal of the record."""
        return self.site(f"sensor.{name.removeprefix(self.ahead)}")

    @property
    def rows(self) -> tuple[Signal, ...]:
        """The signals written and measured in it, with units, under the names of the record."""
        channels = self.kind.channels
        rows = (channels.target, channels.command, *([channels.effort] if channels.effort else []))
        return tuple(row._replace(name=self.signal(row.name)) for row in (*rows, *channels.measured))

    @property
    def measured(self) -> tuple[str, ...]:
        """The measured signals."""
        return tuple(map(self.signal, self.kind.channels.names))

    @property
    def commands(self) -> dict[str, str]:
        """The signals that drive it, each with the name of its machine in texts."""
        command, *effort = self.kind.channels.drives
        words = {command: command.removesuffix("_command").replace("_", " ")}
        words |= {name: f"{name.removesuffix('_command').replace('_', ' ')}'s motor" for name in effort}
        return {self.signal(name): text for name, text in words.items()}

    @property
    def responses(self) -> tuple[str, ...]:
        """The signals by which the gap of a test is judged."""
        channels = self.kind.channels
        names = self.kind.responses or tuple(dict.fromkeys((channels.position, channels.force)))
        return tuple(map(self.signal, names))

    @property
    def noise(self) -> dict[str, float]:
        """Nominal rms noise of the measured signals."""
        return dict(zip(self.measured, self.kind.noise(self.plan).tolist(), strict=True))

    def effects(self) -> dict[str, Effect]:
        """The effects that it can have, under the names of the record."""
        found = map(self.scoped, effects.of_kind(self.kind, self.plan).values())
        return {effect.name: effect for effect in found}

    def scoped(self, effect: Effect) -> Effect:
        """An effect of the catalogue, with site, signals and name as in the record."""
        if not self.before:
            return effect
        stop = effect.contact
        contact = (
            replace(stop, motion=self.signal(stop.motion), force=self.signal(stop.force)) if stop else None
        )
        return replace(
            effect,
            name=self.site(effect.name),
            site=self.site(effect.site),
            signal=self.signal(effect.signal),
            parameters=tuple(map(self._followed, effect.parameters)),
            further=tuple(map(self._followed, effect.further)),
            contact=contact,
        )

    def _followed(self, parameter: Parameter) -> Parameter:
        return replace(parameter, follows=self.signal(parameter.follows))


def recorded(plan: Plan, plans: Mapping[str, Plan]) -> tuple[RecordedLaboratory, ...]:
    """The laboratories that a record shows, the master's and at most one slave's; `plans` are those of their roles.

    Raises:
        InputError: a kind of the plan cannot be loaded.
    """
    kinds = {role: kind_of(plan, role) for role in plans if role in plan.kinds}
    names = [{*sites.of_kind(kind), *kind.channels.drives, *kind.channels.names} for kind in kinds.values()]
    alike = len(names) > 1 and bool(names[0] & names[1])
    before = {role: f"{role}." if alike else "" for role in kinds}
    return tuple(
        RecordedLaboratory(role, kind, plans[role], before[role], before[role] if role != MASTER else "")
        for role, kind in kinds.items()
    )
