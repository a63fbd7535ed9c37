"""Delays of a data logger beside filters that the import map states.

Forces often come through an amplifier of their own. A fault in a laboratory delays readings of that laboratory alone.
"""

from __future__ import annotations

import math
from dataclasses import replace

from diagnosis.findings.found import Diagnosis
from diagnosis.findings.logged.filters import AlikeReadings, LikelyFilter, in_common, of_laboratories
from diagnosis.findings.logged.means import alike
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.recorded.record import LEAST_TICKS, Record
from diagnosis.signals import low_pass
from diagnosis.signals.strength import BEYOND


def delayed(record: Record) -> Record:
    """An imported record whose forces, or other readings, are late in all laboratories alike beside stated filters.

    Where the map states nothing, nothing is looked for here; where it states a delay, no more than an interval, within
    which the logger may have read.
    """
    if record.stated is None or record.static or record.ticks < LEAST_TICKS:
        return record
    labs = [part for part in parts_of(record) if isinstance(part, LaboratoryPart)]
    if any(part.free for part in labs):
        return record
    most = record.plan.test.interval if any(part.delay_stated for part in labs) else math.inf
    found: dict[tuple[str, str], float] = {}
    for force in (True, False):
        readings = of_laboratories(record, labs, force=force)
        common = in_common(readings, later(readings))
        if common.channel.delay <= most:
            found |= {(one.role, name): common.channel.delay for one in common.by for name in one.names}
    return replace(record, delayed=found)


def later(readings: list[AlikeReadings]) -> list[LikelyFilter]:
    """The delay of each laboratory whose readings are far likelier with one."""
    tried = [(low_pass.delay(one.spectra), one) for one in readings]
    return [LikelyFilter(delay, one.gain(delay), one) for delay, one in tried if one.gain(delay) > BEYOND]


def remarks(found: Diagnosis) -> list[str]:
    """A sentence for each delay beside stated filters."""
    return [
        f"{' and '.join(names)} come {1e3 * delay:.2g} ms later than behind the filters that the import map states, in "
        "all laboratories alike, which is taken for the data logger's delay: state it as `delay`."
        for delay, names in alike(found.record.delayed).items()
    ]
