"""Readings that are means over time, of which the import map states no more than a delay.

A mean over a time comes late by half of it, which is what many state. It also takes (π·f·length)²/6 of a wave of
frequency f away: 0.07 % at 2 Hz of a mean over 10 ms, which a filter that only delays does not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TypeVar

from common.recording.imported import NOTHING_STATED, ImportedChannel
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.logged.filters import of_laboratories
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.recorded.record import LEAST_TICKS, Record
from diagnosis.signals import low_pass
from diagnosis.signals.strength import BEYOND

Shared = TypeVar("Shared")

# Over the stated delay: some state the time to the middle of the last sample, others that of all of them.
SHORTEST, LONGEST = 1.4, 2.8


def averaged(record: Record) -> Record:
    """An imported record whose readings are means, where they are far less surprising so than with a stated delay only.

    All readings must have one stated delay, and no filter or mean: a logger averages its channels alike.
    """
    if record.stated is None or record.static or record.ticks < LEAST_TICKS:
        return record
    labs = [part for part in parts_of(record) if isinstance(part, LaboratoryPart)]
    channels = [channel for part in labs for channel in part.channels]
    said = {channel.delay for channel in channels}
    if len(said) != 1 or (delay := said.pop()) <= 0.0 or any(channel.blunt for channel in channels):
        return record
    spectra = [one.spectra for one in of_laboratories(record, labs)]
    surprise = partial(low_pass.surprises, spectra)
    mean, least = low_pass.closest(surprise, without_delay, SHORTEST * delay, LONGEST * delay)
    if least > surprise(NOTHING_STATED) - BEYOND:
        return record
    names = ((part.role, name) for part in labs for name in part.lab.kind.channels.names)
    found = replace(mean, delay=0.0)
    return replace(record, passed={**record.passed, **dict.fromkeys(names, found)})


def without_delay(length: float) -> ImportedChannel:
    """What a mean over a time (s) does beside its delay."""
    return ImportedChannel(delay=-0.5 * length, average=length)


def remarks(found: Diagnosis) -> list[str]:
    """A sentence for each time over which readings were taken for means."""
    lengths = {name: (one.average, one.means) for name, one in found.record.passed.items() if one.average}
    return [
        f"{' and '.join(names)} are {'means of ' * (times - 1)}means over {1e3 * length:.3g} ms, by what they have of "
        "fast motion, and the import map does not state it. It was taken into account; state it as `average`"
        f"{f' with `means = {times}`' if times > 1 else ''}."
        for (length, times), names in alike(lengths).items()
    ]


def alike(channels: Mapping[tuple[str, str], Shared]) -> dict[Shared, list[str]]:
    """The names of channels by what they have in common, from what each has by topic and name."""
    names: dict[Shared, list[str]] = {}
    for (_, name), value in channels.items():
        names.setdefault(value, []).append(name)
    return names
