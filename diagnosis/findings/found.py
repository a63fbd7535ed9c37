"""Everything that was found in a recording, and the laboratories that it amounts to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from common.plan.plan import Plan
from diagnosis.findings.readings import Reading
from diagnosis.findings.verdict import Verdict
from diagnosis.fits.fitting import Values
from diagnosis.recorded.link import Finding
from diagnosis.recorded.record import Record
from laboratories.effects import CATALOGUE
from models.system import System


@dataclass(frozen=True)
class Diagnosis:
    """Everything that was found in a recording."""

    record: Record
    verdicts: Sequence[Verdict] = ()
    readings: Sequence[Reading] = ()
    link: Sequence[Finding] = ()
    held: Mapping[str, float] = field(default_factory=dict)  # sensors that repeat samples, and how many
    white: Mapping[str, float] = field(default_factory=dict)  # rms of each reading's noise
    warnings: Sequence[str] = ()

    def named(self, site: str) -> list[str]:
        """The effects found at a site."""
        names = [name for verdict in self.verdicts for name in verdict.effects]
        names += [item.effect for item in self.readings] + [item.effect for item in self.link]
        return [name for name in names if CATALOGUE[name].site == site]

    def system(
        self, sites: frozenset[str] | None = None, plan: Plan | None = None, *, noisy: bool = True
    ) -> System:
        """A plan with parameters moved inside their tolerances and the effects found, of some sites or of all.

        The recording's own plan where none is given; without added noise of sensors where not `noisy`.
        """
        system = System(plan or self.record.plan)
        for verdict in self.verdicts:
            fit = verdict.search.chosen
            kept = {
                name: values
                for name, values in fit.values.items()
                if sites is None or CATALOGUE[name].site in sites
            }
            system = laid(system, verdict, kept)
        for reading in self.readings:
            effect = CATALOGUE[reading.effect]
            if (sites is None or effect.site in sites) and (noisy or not effect.random):
                system = effect.apply(system, **{reading.parameter: reading.value})
        return system


def laid(system: System, verdict: Verdict, values: Values) -> System:
    """A system with a part's parameters moved and some of its effects laid over it."""
    part, z = verdict.search.data.part, verdict.search.chosen.z
    for nuisance, place in zip(part.nuisances, z, strict=True):
        system = nuisance.moved(system, float(place))
    for name, given in values.items():
        system = CATALOGUE[name].apply(system, **given)
    return system
