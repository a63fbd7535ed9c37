"""Everything that was found in a recording, and the systems of master and slave that follow from it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from common.plan.plan import Plan
from diagnosis.findings.sensors.readings import SensorFinding
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits.hypothesis import Values
from diagnosis.learned.learn import LearnedLaw, Of
from diagnosis.recorded.link.exchange import LinkFinding
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.recorded.record import Record
from models.system import System


@dataclass(frozen=True)
class Diagnosis:
    """Everything that was found in a recording."""

    record: Record
    verdicts: Sequence[PartVerdict] = ()
    readings: Sequence[SensorFinding] = ()
    link: Sequence[LinkFinding] = ()
    held: Mapping[str, float] = field(default_factory=dict)  # sensors that repeat samples, and how many
    white: Mapping[str, float] = field(default_factory=dict)  # rms of each reading's noise, lines aside
    lines: Mapping[str, float] = field(default_factory=dict)  # rms of narrow lines that each reading picks up
    warnings: Sequence[str] = ()
    learned: Sequence[LearnedLaw] = ()  # what no effect explains

    def noise(self, name: str) -> float:
        """Rms of a reading's noise with the lines that it picks up, in its unit."""
        return math.hypot(self.white.get(name, 0.0), self.lines.get(name, 0.0))

    def named(self, site: str) -> list[str]:
        """The effects found at a site."""
        names = [name for verdict in self.verdicts for name in verdict.effects]
        names += [item.effect for item in self.readings] + [item.effect for item in self.link]
        return [name for name in names if self.record.catalogue[name].site == site]

    def systems(
        self,
        sites: frozenset[str] | None = None,
        plans: Mapping[str, Plan] | None = None,
        *,
        noisy: bool = True,
    ) -> dict[str, System]:
        """Systems of master and slave by role: nominal parameters as fitted, and the effects of some sites or of all.

        They are built on the recording's own plans where none are given, and without the sensors' added noise where
        not `noisy`.
        """
        catalogue = self.record.catalogue
        systems = {role: System(plan) for role, plan in (plans or self.record.plans).items()}
        for verdict in self.verdicts:
            fit, role = verdict.search.chosen, verdict.search.data.part.role
            kept = {
                name: values
                for name, values in fit.values.items()
                if sites is None or catalogue[name].site in sites
            }
            systems[role] = laid(systems[role], verdict, kept)
        for reading in self.readings:
            effect = catalogue[reading.effect]
            role = next(lab.role for lab in self.record.labs if effect.signal in lab.measured)
            if (sites is None or effect.site in sites) and (noisy or not effect.random):
                systems[role] = effect.apply(systems[role], **{reading.parameter: reading.value})
        return systems

    @cached_property
    def logger(self) -> dict[str, tuple[float, float]]:
        """Delay (s) and gain that the data logger gave to each reading, by signal; empty where rths recorded."""
        result: dict[str, tuple[float, float]] = {}
        for verdict in self.verdicts:
            part, z = verdict.search.data.part, verdict.search.chosen.z
            if not isinstance(part, LaboratoryPart):
                continue
            system = System(self.record.plans[part.role])
            for nuisance, place in zip(part.nuisances, z, strict=True):
                system = nuisance.moved(system, float(place)) if nuisance.of_record else system
            for name in part.lab.kind.channels.names:
                if made := system.effects.sensors.get(name):
                    result[part.lab.signal(name)] = made.logger_delay, made.gain
        return result

    def corrected(self, plans: Mapping[str, Plan] | None = None, of: Of = "law") -> dict[str, System]:
        """Systems of master and slave by role, with the effects of all sites and the learned laws."""
        systems = self.systems(plans=plans)
        for law in self.learned:
            systems[law.role] = law.laid(systems[law.role], of)
        return systems


def laid(system: System, verdict: PartVerdict, values: Values) -> System:
    """A system with the nominal parameters of a part as fitted and with some of its effects."""
    part, z = verdict.search.data.part, verdict.search.chosen.z
    for nuisance, place in zip(part.nuisances, z, strict=True):
        system = system if nuisance.of_record else nuisance.moved(system, float(place))
    for name, given in values.items():
        system = verdict.search.data.catalogue[name].apply(system, **given)
    return system
