"""Filters and delays of the data logger of an import that its map does not state.

What a logger does to one channel it mostly does to all that measure forces, or to all others, while a fault in a
laboratory delays readings of that laboratory alone. So a filter is one of the logger where readings of several
laboratories pass it alike, or where the force that the master used did not pass it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from common.recording.imported import NOTHING_STATED, ImportedChannel
from common.roles import MASTER
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.nuisances import ALIKE
from diagnosis.recorded.parts import LaboratoryPart, Part
from diagnosis.recorded.record import LEAST_TICKS, Delay, Late, Record
from diagnosis.signals import low_pass
from diagnosis.signals.low_pass import ReadSpectra
from diagnosis.signals.mask import longest
from diagnosis.signals.strength import BEYOND

# Share of a reading's rms that a nominal model leaves, from which on an effect is at work: noise, a hum of 1 % of the
# peak and a converter together leave up to 4 %.
SPOILT = 0.05
ANY_GAIN = 0.1  # relative tolerance of a reading's gain, which says nothing of a filter
# Share of what a filter gains in a laboratory that another one may lose there: of a delay, a seventh more or less.
AS_LIKELY = 0.02
EACH = (
    2.0  # times that share, which each of several readings may lose where together they lose no more than it
)


class AlikeReadings(NamedTuple):
    """Readings of one laboratory that may have passed one filter."""

    role: str  # of the process that it belongs to
    names: tuple[str, ...]  # of its channels
    spectra: ReadSpectra

    @property
    def misses(self) -> float:
        """Largest share of a reading's rms that the nominal model leaves without a filter."""
        return low_pass.missed(self.spectra, NOTHING_STATED)

    def gain(self, channel: ImportedChannel) -> float:
        """By how much less surprising they are behind a filter than with nothing."""
        nothing, behind = (low_pass.surprise(self.spectra, one) for one in (NOTHING_STATED, channel))
        return nothing - behind


class LikelyFilter(NamedTuple):
    """The filter or delay of one laboratory."""

    channel: ImportedChannel
    gain: float
    of: AlikeReadings

    @property
    def missed(self) -> float:
        """Largest share of a reading's rms that the nominal model leaves behind it."""
        return low_pass.missed(self.of.spectra, self.channel)

    def allows(self, other: ImportedChannel, times: float = 1.0) -> bool:
        """Whether the readings are about as likely behind another one, with so many times the usual share to lose."""
        own = self.of.gain(self.channel)
        return self.of.gain(other) > own - max(BEYOND, times * AS_LIKELY * own)

    def spoken_for(self, several: Sequence[LikelyFilter]) -> bool:
        """Whether every filter of `several` that delays less allows this one."""
        return all(other.allows(self.channel) for other in several if other.channel.late < self.channel.late)


class Common(NamedTuple):
    """A filter or delay of the logger, and what passed it."""

    channel: ImportedChannel = NOTHING_STATED
    by: tuple[AlikeReadings, ...] = ()


def filtered(record: Record) -> Record:
    """An imported record with the filters and delays of its logger that its map does not state."""
    if record.stated is None or record.static or record.ticks < LEAST_TICKS:
        return record
    record = in_time(record)
    parts, labs = parts_of(record), unstated(record)
    reading_forces, reading_others = (of_laboratories(record, labs, force=force) for force in (True, False))
    whole = of_all([*reading_forces, *reading_others])
    if whole is not None:
        forces, others = (Common(whole, tuple(labs)) for labs in (reading_forces, reading_others))
    else:
        forces, others = (
            of_forces(reading_forces, of_building(record, parts)),
            in_common(reading_others, likely(reading_others)),
        )
        forces, others = followed(others, forces, reading_forces), followed(forces, others, reading_others)
        forces, others = alike(forces, others)
    late = Late(Delay(forces.channel.delay), Delay(others.channel.delay))
    return replace(record, passed=by_channel(forces, others), late=late)


def of_all(labs: Sequence[AlikeReadings]) -> ImportedChannel | None:
    """The one filter or delay that all readings passed, by what all of them say together.

    None where one of them knows of another one for itself: an effect may be at work there.
    """
    spectra = [one.spectra for one in labs]
    if len({one.role for one in labs}) < 2 or (rough := low_pass.roughly(*spectra)).gain < BEYOND:
        return None
    whole = low_pass.likeliest(rough.late, BEYOND, *spectra)
    lost = [item.of.gain(item.channel) - item.of.gain(whole) for item in likely(labs)]
    agreed = all(one.gain(whole) > -BEYOND for one in labs) and max(lost, default=math.inf) < EACH * BEYOND
    return whole if agreed else None


def unstated(record: Record) -> list[LaboratoryPart]:
    """The laboratories of whose logger the import map states neither a filter nor a delay."""
    return [part for part in parts_of(record) if isinstance(part, LaboratoryPart) and part.free]


def in_time(record: Record) -> Record:
    """The record with its readings later where those of all laboratories stand before their time alike.

    So does a mean over a row's time that bears the time of its beginning, or a reading in the row of the command that
    follows it. No machine moves before its command, and one that is faster than planned is so by itself. Filters and
    delays that the map states do not say when between two ticks the logger read.
    """
    labs = [part for part in parts_of(record) if isinstance(part, LaboratoryPart)]
    early = before_time(of_laboratories(record, labs), record.plan.test.interval)
    return record.put_right(0.0, early) if early > 0.0 else record


def earlier(early: float) -> ImportedChannel:
    """A channel that is early, s."""
    return ImportedChannel(delay=-early)


def before_time(labs: Sequence[AlikeReadings], most: float) -> float:
    """By how much readings of several laboratories are early alike, s, `most` at most; 0 where they are not.

    The laboratory decides that knows it best, unless it is less likely in one that is early less: a fault may make
    readings earlier still. Where only one knows it, all others must be likelier with it than without.
    """
    found = [
        (low_pass.closest(partial(low_pass.surprise, one.spectra), earlier, 0.0, most)[0], one)
        for one in labs
    ]
    sure = [
        LikelyFilter(channel, gain, one) for channel, one in found if (gain := one.gain(channel)) > BEYOND
    ]
    if not sure or len(found) < 2:
        return 0.0
    if len(sure) == 1 and any(one.gain(sure[0].channel) <= 0.0 for one in labs):
        return 0.0
    chosen = next(
        one
        for one in sorted(sure, key=lambda item: -item.gain)
        if all(other.allows(one.channel) for other in sure if other.channel.delay > one.channel.delay)
    )
    return -passed(labs, chosen.channel).channel.delay


def of_forces(labs: Sequence[AlikeReadings], exact: Sequence[AlikeReadings]) -> Common:
    """The filter of forces: of those that the master used, or of the laboratories that agree on one.

    Each of `exact` is a way to see the forces that the master used, by the motion of the building; the likeliest way
    counts. It tells the filter of the master's own converter apart, and which laboratory has an effect. But noise that
    the master read and the logger did not looks like a filter, so that where laboratories agree on one, and none of
    them allows what it says, theirs holds.
    """
    agreed = in_common(labs, sure := likely(labs))
    tried = [(low_pass.roughly(one.spectra), one) for one in exact]
    first, own = min(tried, key=lambda item: item[0].surprise, default=(None, None))
    if first is None or own is None or first.gain < BEYOND:
        return agreed
    channel = low_pass.likeliest(first.late, BEYOND, own.spectra)
    said = low_pass.surprise(own.spectra, channel)
    if low_pass.missed(own.spectra, channel) > SPOILT or low_pass.surprise_unknown(own.spectra) < said:
        return agreed  # something is at work in the building
    apart = not any(one.allows(channel) for one in sure)
    if not (apart and agreed.by):
        agreed = passed(labs, channel)
        return agreed if channel.filter is None else Common(channel, (own, *agreed.by))
    return agreed if agreed.channel.filter is None else agreed._replace(by=(own, *agreed.by))


def followed(known: Common, found: Common, labs: Sequence[AlikeReadings]) -> Common:
    """The filter `found` of a group of readings; where there is none that `known` of the other group, as likely.

    It is so where one laboratory's readings say the same by themselves.
    """
    if found.channel.late > 0.0 or known.channel.late == 0.0:
        return found
    agreeing = any(one.allows(known.channel) for one in likely(labs))
    return passed(labs, known.channel) if agreeing else found


def alike(*groups: Common) -> tuple[Common, ...]:
    """The same groups of readings behind one filter or delay, where that of one of them is about as likely for each.

    Of several such it is the likeliest one for all readings together: loggers mostly treat all channels alike, so that
    each may lose twice as much by it as they lose together.
    """
    found = [
        LikelyFilter(group.channel, one.gain(group.channel), one) for group in groups for one in group.by
    ]
    if not all(group.by for group in groups):
        return groups
    shared = [
        group.channel
        for group in groups
        if all(one.allows(group.channel, EACH) for one in found) and together(found, group.channel)
    ]
    best = max(shared, key=lambda channel: sum(one.of.gain(channel) for one in found), default=None)
    return groups if best is None else tuple(group._replace(channel=best) for group in groups)


def together(found: Sequence[LikelyFilter], channel: ImportedChannel) -> bool:
    """Whether readings behind filters of their own are together about as likely behind one."""
    own = sum(one.of.gain(one.channel) for one in found)
    return sum(one.of.gain(channel) for one in found) > own - max(BEYOND, AS_LIKELY * own)


def likely(labs: Sequence[AlikeReadings]) -> list[LikelyFilter]:
    """The filter or delay of each laboratory whose readings are far likelier behind one."""
    said = [(low_pass.roughly(one.spectra), one) for one in labs]
    return [
        LikelyFilter(low_pass.likeliest(item.late, BEYOND, one.spectra), item.gain, one)
        for item, one in said
        if item.gain > BEYOND
    ]


def in_common(labs: Sequence[AlikeReadings], sure: Sequence[LikelyFilter]) -> Common:
    """The filter or delay that readings of several laboratories passed, by what is `likely` of each.

    The laboratory decides that knows it best, unless it is less likely in one that is late less: what is like a filter
    in a laboratory makes its readings later still. One that its nominal model misses by far tells nothing of it, as
    long as another one does.
    """
    if len(sure) < 2:
        return Common()
    sure = sorted([item for item in sure if item.missed < SPOILT] or sure, key=lambda item: -item.gain)
    chosen = next(one for one in sure if one.spoken_for(sure))
    return passed(labs, chosen.channel)


def passed(labs: Sequence[AlikeReadings], channel: ImportedChannel) -> Common:
    """A filter or delay that readings of laboratories passed; nothing where one's are much less likely behind it.

    Those that the nominal model misses by far say nothing against it: an effect may make them come earlier by as much.
    """
    against = (one.gain(channel) < -BEYOND and one.misses < SPOILT for one in labs)
    return Common(channel, tuple(labs)) if labs and not any(against) else Common()


def by_channel(*found: Common) -> dict[tuple[str, str], ImportedChannel]:
    """What channels passed, by topic and name; those of a laboratory share the corner that all of them want."""
    sharing: dict[tuple[str, ImportedChannel], list[AlikeReadings]] = {}
    for channel, one in ((common.channel, one) for common in found for one in common.by):
        if channel.blunt:
            sharing.setdefault((one.role, channel), []).append(one)
    result: dict[tuple[str, str], ImportedChannel] = {}
    for (role, common), several in sharing.items():
        names = [(role, name) for one in several for name in one.names]
        result |= dict.fromkeys(names, tuned(several, common))
    return result


def tuned(several: Sequence[AlikeReadings], common: ImportedChannel) -> ImportedChannel:
    """A filter with the corner that readings of a laboratory want, within what channels of a logger differ by.

    Readings that would rather be late by more are late for another reason. The time of a mean is the logger's.
    """
    if common.filter is None:
        return common

    def said(channel: ImportedChannel) -> float:
        return sum(low_pass.surprise(one.spectra, channel) for one in several)

    late, of = common.late, low_pass.like(common.filter)
    best, least = low_pass.closest(said, of, max(late - 2.0 * ALIKE, 0.5 * late), late + 2.0 * ALIKE)
    near = abs(best.late - late) < ALIKE
    return best if near and least < said(common) - BEYOND else common


def of_laboratories(
    record: Record, labs: Sequence[LaboratoryPart], *, force: bool | None = None
) -> list[AlikeReadings]:
    """Forces, or else the other readings, of each laboratory that has any; all readings where neither is asked for."""
    return [one for part in labs if (one := of_laboratory(record, part, force=force))]


def of_laboratory(record: Record, part: LaboratoryPart, *, force: bool | None) -> AlikeReadings | None:
    """Forces, or else the other readings, or all of a laboratory; None where none was recorded."""
    rows = zip(part.signals, part.lab.kind.channels.names, np.ptp(part.measured, axis=0), strict=True)
    there = {
        place: name
        for place, (signal, name, span) in enumerate(rows)
        if force in (None, record.unit(signal) == "N")
        and record.has(signal)
        and part.present[:, place].any()
        and span > 0.0
        and place != part.freed
    }
    system, places = record.systems[part.role], list(there)
    known = longest(np.all(part.present[:, places], axis=1)) if record.gapped else slice(None)
    if not there or len(part.measured[known]) < LEAST_TICKS:
        return None
    true = part.predict(system)[known][:, places]
    slopes = [part.predict(one.moved(system, 1.0))[known][:, places] - true for one in part.nuisances]
    slopes += [ANY_GAIN * true * (np.arange(len(places)) == own) for own in range(len(places))]
    interval, read = record.plan.test.interval, part.measured[known][:, places]
    spectra = low_pass.spectra(read, true, np.stack(slopes, axis=2), interval)
    return AlikeReadings(part.role, tuple(there.values()), spectra)


def of_building(record: Record, parts: Sequence[Part]) -> list[AlikeReadings]:
    """The force of the master's laboratory as the building's motion tells it, and that with the other forces used.

    What the master's own converter added to a force is in the motion as well, and in no reading of a logger.
    The first is missing where what was recorded of the other forces is not what the master used.
    Empty where the import map states a filter or delay of what goes into it, or rows are missing.
    """
    found = next((part for part in parts if isinstance(part, Building)), None)
    if found is None or not (found.whole and found.linear and found.sources):
        return []
    if found.treated or record.gapped:
        return []
    view = LoggedBuilding(found)
    own, every = (view.demanded(used=used) for used in (False, True))
    alone = AlikeReadings(MASTER, found.sources[:1], own)
    used_others = low_pass.likelier_whole(every, own) < BEYOND
    return [*([alone] if used_others else []), AlikeReadings(MASTER, found.sources, every)]
