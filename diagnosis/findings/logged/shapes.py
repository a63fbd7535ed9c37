"""The shape of a filter that readings of a data logger passed, where the import map states a delay at most.

Slow motion tells by how much a filter delays. Which filter it is shows in what is fast: up to half the rate of the
ticks, and in what a machine does between them after each step of its command, which a filter smooths and a delay does
not. So each shape is weighed by all of that, with the nominal models at their best behind it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from common.recording.imported import NOTHING_STATED, ImportedChannel
from common.recording.logger.low_pass import RIPPLING, LoggerFilter
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.logged.filters import ANY_GAIN
from diagnosis.findings.logged.nominal_fits import (
    BANDS,
    Name,
    balanced,
    force,
    highest,
    known,
    laboratories,
    named,
    nominal_fits,
)
from diagnosis.fits.fitting import Fit
from diagnosis.fits.threads import each
from diagnosis.recorded.building.logged_building import BALANCE
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.nuisances import ALIKE, LoggedReadings, channels
from diagnosis.recorded.parts import LaboratoryPart, Part
from diagnosis.recorded.record import LEAST_TICKS, Delay, Record
from diagnosis.signals import low_pass
from diagnosis.signals.low_pass import ReadSpectra, Shape
from diagnosis.signals.mask import Mask, longest
from diagnosis.signals.strength import BEYOND

# Filters usual before converters: analogue ones, of switched capacitors with a ripple, and means of means in a
# converter of sigma-delta type.
FILTERS = (
    *(LoggerFilter("butterworth", order, 1.0) for order in (1, 2, 3, 4, 6, 8)),
    *(LoggerFilter("bessel", order, 1.0) for order in (2, 3, 4, 6, 8)),
    *(LoggerFilter("chebyshev", order, 1.0, 0.5) for order in (3, 4, 5, 6, 8)),
    *(LoggerFilter("elliptic", order, 1.0, 0.1, 60.0) for order in (4, 6, 8)),
)
SHAPES = (*map(low_pass.like, FILTERS), low_pass.means(1), low_pass.means(3))
# Over the delay by which a filter was found, of another one: the nominal models may be late or early themselves.
LEAST, MOST = 0.5, 1.8
LOOSE = 10.0  # tolerances of the plan's parameters, in which a machine may be at fault
SHOWN = 2  # readings that must show a filter where no delay is known
FAMILIES, FINALISTS = 4, 2  # of shapes, whose likeliest laboratories judge, and then the building too
ROUNDS = 2  # of looking for a shape, each about nominal models at their best behind the one before it


class Group(NamedTuple):
    """Readings behind one filter, mean or delay of a logger."""

    names: frozenset[Name]
    channel: ImportedChannel
    free: bool  # whether the import map states no delay

    def tried(self, record: Record, channel: ImportedChannel) -> Record:
        """The record with these readings behind another one."""
        passed = {name: one for name, one in record.passed.items() if name not in self.names}
        if channel.blunt:
            passed |= dict.fromkeys(sorted(self.names), replace(channel, delay=0.0))
        late = record.late
        if self.free:
            signals = {named: signal for lab in record.labs for named, signal in signals_of(lab)}
            kinds = {force(record, signals[name]) for name in self.names}
            late = late._replace(**{"force" if kind else "motion": Delay(channel.delay) for kind in kinds})
        return replace(record, passed=passed, late=late)


def shaped(record: Record) -> Record:
    """An imported record with the likeliest shape of what its readings passed, where the map does not state it."""
    if record.stated is None or record.static or record.ticks < LEAST_TICKS:
        return record
    there = known(record)
    if not any(group.free for group in groups(record)):
        record = anew(record, there)
    found = sampled(united(all_reshaped(united(record, there), there), there), there)
    return found if found.at_ticks == record.at_ticks else all_reshaped(found, there)


def all_reshaped(record: Record, there: Mapping[Name, Mask]) -> Record:
    """The record with every group of readings behind its likeliest shape."""
    for group in groups(record):
        record = reshaped(record, group, there)
    return record


def sampled(record: Record, there: Mapping[Name, Mask]) -> Record:
    """The record with filters and means, stated or found, that were given the readings at the ticks alone, or not.

    So a controller filters its own readings. What machines do between ticks tells.
    """
    behind = {
        name
        for lab in laboratories(record)
        for name, channel in zip(named(lab), lab.channels, strict=True)
        if (channel.filter or channel.average) and not channel.interpolated
    }
    if not behind & there.keys():
        return record
    other = replace(record, at_ticks=frozenset() if record.at_ticks else frozenset(behind))
    now = nominal_fits(record, there)
    tried = nominal_fits(other, there, near=now)
    return other if tried.far_likelier(now, now.told(behind & there.keys())) else record


def anew(record: Record, there: Mapping[Name, Mask]) -> Record:
    """The record with all readings of which nothing is stated behind a filter, where two of them are likelier.

    All together must be far likelier than behind a delay, which may be one of the machine. A converter that takes off
    the delay of its own filter leaves no trace but that nothing is faster than the ticks, which is no fault of any
    machine.
    """
    names = unstated(record) & there.keys()
    now = nominal_fits(record, there)
    counted = now.told(names)
    if not counted:
        return record
    spectra = [one for lab, fit in now.fits if (one := spectra_of(lab, fit, record, counted))]
    group = Group(frozenset(names), ImportedChannel(delay=low_pass.roughly(*spectra).late), free=True)
    ended = nominal_fits(group.tried(record, smooth(0.0)), there, near=now)
    said = partial(low_pass.surprises, spectra)
    first, *others = likeliest(spectra, group)
    if said(first) < said(NOTHING_STATED) - BEYOND:
        tried = {one: nominal_fits(group.tried(record, one), there, near=now) for one in (first, *others)}
        channel = min(tried, key=lambda one: tried[one].surprise(counted))
        found, delay = tried[channel], ImportedChannel(delay=channel.late)
        late = nominal_fits(group.tried(record, delay), there, near=now)
        shown = sum(now.of[name] > found.of[name] + BEYOND for name in counted)
        rivals = (now, late, ended, nominal_fits(record, there, LOOSE))
        if shown >= SHOWN and all(found.far_likelier(one, counted) for one in rivals):
            return found.record
    return ended.record if ended.far_likelier(now, counted) else record


def united(record: Record, there: Mapping[Name, Mask]) -> Record:
    """The record with all readings of which nothing is stated behind what some of them passed, where that is likelier.

    Loggers mostly treat all channels alike.
    """
    names, found = unstated(record) & there.keys(), [group for group in groups(record) if group.free]
    if not found or found[0].names == names:
        return record
    now = nominal_fits(record, there)
    counted = now.told(names)
    every = Group(frozenset(names), NOTHING_STATED, free=True)
    tried = [nominal_fits(every.tried(record, group.channel), there, near=now) for group in found]
    return min([now, *tried], key=lambda one: one.surprise(counted)).record


def of_balance(there: Collection[Name]) -> set[Name]:
    """The balances of a building, of what is there."""
    return {name for name in there if name[0] == BALANCE}


def unstated(record: Record) -> set[Name]:
    """The readings of laboratories of whose logger the import map states nothing."""
    labs = [lab for lab in laboratories(record) if lab.free]
    pairs = [pair for lab in labs for pair in zip(named(lab), lab.signals, strict=True)]
    return {name for name, signal in pairs if record.has(signal)}


def groups(record: Record) -> list[Group]:
    """Readings that come late behind something of which no more than a delay is stated.

    Those are one group that are behind filters of one type and order, or come late by the same delay.
    """
    found: dict[tuple[bool, str, int, float], dict[Name, ImportedChannel]] = {}
    for lab in laboratories(record):
        mapped = channels(record.mapped, lab.lab)
        for name, signal, said, now in zip(named(lab), lab.signals, mapped, lab.channels, strict=True):
            if said.filter or said.average or not record.has(signal):
                continue
            late = record.late.force if force(record, signal) else record.late.motion
            channel = replace(now.chain, delay=late.about if lab.free else now.delay)
            if channel.late > 0.0:
                kind = (channel.filter.type, channel.filter.order) if channel.filter else ("", 0)
                alone = 0.0 if channel.filter else channel.late
                found.setdefault((lab.free, *kind, alone), {})[name] = channel
    return [
        Group(frozenset(those), next(iter(those.values())), key[0]) for key, those in found.items() if those
    ]


def reshaped(record: Record, group: Group, there: Mapping[Name, Mask]) -> Record:
    """The record with readings of a group behind the likeliest shape, if that is likelier than what is known.

    Where no more than a delay is known, it must be far likelier. Beside a delay that is stated, a filter that takes
    away slow motion must be far likelier than machines far from their plan, which may do so too. The balance of a
    building, which takes longer, judges the likeliest ones only.
    """
    now = balanced(nominal_fits(record, there), there)
    own = now.told(group.names & there.keys())
    counted = own | now.told(of_balance(there)) if own else own
    for _ in range(ROUNDS if counted else 0):
        spectra = [one for lab, fit in now.fits if (one := spectra_of(lab, fit, record, counted))]
        late = group.channel.late
        known_as, sharp = ImportedChannel(delay=late), smooth(late)
        every = dict.fromkeys([*likeliest(spectra, group), sharp, known_as])
        by_labs = {one: nominal_fits(group.tried(record, one), there, near=now) for one in every}
        first = sorted(by_labs, key=lambda one: by_labs[one].surprise(own))[:FINALISTS]
        tried = {one: balanced(by_labs[one], there, now) for one in dict.fromkeys([*first, sharp, known_as])}
        channel = min(tried, key=lambda one: tried[one].surprise(counted))
        if not group.free and channel.late > channel.delay:
            loose = balanced(nominal_fits(group.tried(record, sharp), there, LOOSE), there)
            channel = channel if tried[channel].far_likelier(loose, counted) else sharp
        found = tried[channel]
        sure = found.far_likelier(now, counted)
        if not (sure or (group.channel.blunt and found.surprise(counted) < now.surprise(counted))):
            break
        record, now, group = found.record, found, group._replace(channel=channel)
        if not sure:
            break
    return record


def likeliest(spectra: Sequence[ReadSpectra], group: Group) -> list[ImportedChannel]:
    """The filters and means of several families behind which readings are least surprising, the likeliest first.

    They are late by about as much as what is known, and by just as much where that is stated. A filter may be without
    a trace but that it lets nothing pass which is faster than the ticks.
    """
    said = partial(low_pass.surprises, spectra)
    late = group.channel.late

    def closest(shape: Shape) -> tuple[ImportedChannel, float]:
        if group.free:
            return low_pass.closest(said, shape, LEAST * late, MOST * late)
        return (channel := shape(late)), said(channel)

    families: dict[str, ImportedChannel] = {}
    for channel, _ in sorted(each(closest, [*SHAPES, smooth]), key=lambda item: item[1]):
        families.setdefault(family(channel), channel)
    return list(families.values())[:FAMILIES]


def family(channel: ImportedChannel) -> str:
    """What a filter or mean has in common with others that pass slow motion nearly alike."""
    if channel.filter is None:
        return "smooth" if channel.smooth else "means"
    if channel.filter.order == 1:
        return "first order"
    return "rippling" if channel.filter.type in RIPPLING else channel.filter.type


def smooth(late: float) -> ImportedChannel:
    """A filter that delays by some s, and passes nothing that is faster than the ticks."""
    return ImportedChannel(delay=late, smooth=True)


def spectra_of(lab: Part, fit: Fit, record: Record, counted: Iterable[Name]) -> ReadSpectra | None:
    """Spectra of those readings of a laboratory that count, about a fit of its nominal model and before any filter.

    None of a building, whose balance filters do not change but for the forces.
    """
    if not isinstance(lab, LaboratoryPart):
        return None
    own = [place for place, name in enumerate(named(lab)) if name in counted and place != lab.freed]
    stretch = longest(np.all(lab.present[:, own], axis=1))
    if not own or stretch.stop - stretch.start < LEAST_TICKS:
        return None
    before = lab.replaced(
        channels=tuple(
            replace(NOTHING_STATED, at_ticks=one.at_ticks, smooth=not one.at_ticks) for one in lab.channels
        )
    )
    interval, system = record.plan.test.interval, record.systems[lab.role]
    movable = [one for one in lab.nuisances if not isinstance(one, LoggedReadings)]
    for one, z in zip(movable, fit.z, strict=False):
        system = one.moved(system, float(z))
    true = before.predict(system)[:, own]
    slopes = [before.predict(one.moved(system, 1.0))[:, own] - true for one in movable]
    slopes += [ANY_GAIN * true * (np.arange(len(own)) == place) for place in range(len(own))]
    forces = np.array([force(record, lab.signals[place]) for place in own])
    rates = ALIKE * np.gradient(true, interval, axis=0)
    slopes += [-rates * kind for kind in (forces, ~forces)]
    found = low_pass.spectra(
        lab.measured[stretch][:, own],
        true[stretch],
        np.stack(slopes, axis=2)[stretch],
        interval,
        highest(lab, interval),
        BANDS,
    )
    return found._replace(rounds=1)


def signals_of(lab: RecordedLaboratory) -> list[tuple[Name, str]]:
    """Topic and name of a laboratory's readings, each with its signal in the record."""
    return [((lab.role, name), lab.signal(name)) for name in lab.kind.channels.names]


def remarks(found: Diagnosis) -> list[str]:
    """Sentences where readings passed a filter that is seen by what is faster than the ticks alone."""
    record = found.record
    ended = [name for (_, name), one in record.passed.items() if one.smooth]
    said = [
        f"{' and '.join(ended)} show nothing of what machines do between the ticks, as behind a converter's own filter "
        "that delays by no more than was found or stated. It was taken into account."
    ]
    digital = [name for _, name in sorted(record.at_ticks)]
    given = [
        f"The filter of {' and '.join(digital)} was given the readings at the ticks alone, as a controller's own is, "
        "by what machines do between the ticks. It was taken into account."
    ]
    return (said if ended else []) + (given if digital else [])
