"""The data logger between an imported recording and its laboratories: its clock, delay and interpolation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from common.recording.imported import ImportedChannel
from common.recording.logger.low_pass import LoggerFilter
from diagnosis.findings.certainty.covariances import FOREIGN, covariance
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.logged import delays, means, shapes
from diagnosis.findings.sensors import readings
from diagnosis.findings.verdict import UNNAMED, PartVerdict
from diagnosis.fits import fitting, hypothesis, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.ground import Ground
from diagnosis.recorded.nuisances import ALIKE, LATE
from diagnosis.recorded.parts import LaboratoryPart, Part
from diagnosis.recorded.record import LEAST_TICKS, NOT_LATE, Delay, Late, Record
from diagnosis.signals import clock, edges

BLURRED = 0.1  # of a reading's noise, from which on what an interpolation misses may be told from it
TOLD = 4e-3  # of a reading's gain: the report shows two digits, and less is no matter for a test


def interpolated(parts: Sequence[Part]) -> dict[str, float]:
    """The step whose rounding would be as large as the error of an interpolated ground motion, by signal."""
    grounds = [part for part in parts if isinstance(part, Ground)]
    return {part.signals[0]: math.sqrt(12.0) * part.blur for part in grounds if part.blur > 0.0}


def blurred(verdicts: Sequence[PartVerdict]) -> set[str]:
    """The readings of which straight lines between a logger's rows may miss a part that counts beside the noise.

    That part follows the motion, as noise of a loose connector does.
    Between rows every Δ such lines miss (ω·Δ)²/12 of a wave on average, most where it bends most. Whether a recording
    that was interpolated elsewhere has straight lines is not stated.
    """
    result = set[str]()
    for data, fit in ((one.search.data, one.search.chosen) for one in verdicts):
        part, interval = data.part, data.system.plan.test.interval
        if not isinstance(part, LaboratoryPart):
            continue
        bends = np.diff(part.predict(hypothesis.lay(data, fit.z, fit.values)), 2, axis=0) / interval**2
        for place, channel in enumerate(part.channels):
            if channel.interpolated and channel.rate > 0.0:
                missed = float(np.std(bends[:, place])) / (12.0 * channel.rate**2)
                if missed > BLURRED * data.white[place]:
                    result.add(part.signals[place])
    return result


def later(late: Late, verdict: PartVerdict, record: Record) -> Late:
    """Delays of a logger, of which a part that was judged may tell that of forces.

    Where no two laboratories tell by how much their other readings are late, these are as late as the forces.
    """
    force = by_building(verdict)
    if force is None:
        return late
    return Late(force, late.motion if len(record.labs) > 1 else force)


def by_building(verdict: PartVerdict) -> Delay | None:
    """Delay of a logger by the forces of a building; None where it tells nothing.

    A building tells the delay apart from that of any machine, but only as surely as its own formula is right, and
    nothing where its gap has no cause. No other part tells it.
    """
    fit = verdict.search.chosen
    part = fit.data.part
    if not isinstance(part, LoggedBuilding) or verdict.outcome in UNNAMED:
        return None
    return part.late(fit.z, FOREIGN * np.sqrt(np.diag(covariance(fit))[: fit.z.size]))


def whole(record: Record) -> Record:
    """An imported record without the first and last ticks of readings that a resampling filter spoilt."""
    if record.stated is None or record.static:
        return record
    present = dict(record.present)
    for part in parts_of(record):
        if isinstance(part, LaboratoryPart):
            residual = part.measured - part.predict(record.systems[part.role])
            for name, there, column in zip(part.signals, part.present.T, residual.T, strict=True):
                if there.all() and (bad := edges.spoilt(column)).any():
                    present[name] = present[name] & ~bad
    spoilt = tuple(name for name, there in present.items() if there is not record.present[name])
    return replace(record, present=present, edges=spoilt) if spoilt else record


def clocked(record: Record) -> Record:
    """An imported record with its readings on the clock of the commands.

    That the logger's clock is fast or slow is told by all readings of several laboratories alike.
    """
    if record.stated is None or record.static or record.ticks < LEAST_TICKS:
        return record
    said = [
        rates(lab, fit) for lab, fit in nominal(parts_of(record), record, readings.resolutions(record, {}))
    ]
    fast = clock.common(said)
    return record.put_right(fast) if fast != 0.0 else record


def nominal(
    parts: Sequence[Part], record: Record, steps: Mapping[str, float]
) -> list[tuple[LaboratoryPart, Fit]]:
    """Laboratories behind a logger of any delay, each with the fit of its nominal model."""
    labs = [part.logged(NOT_LATE, LATE) for part in parts if isinstance(part, LaboratoryPart)]
    return [(lab, fitting.fit(residuals.prepare(lab, record, steps), {})) for lab in labs]


def rates(lab: LaboratoryPart, fit: Fit) -> list[clock.Rate]:
    """How fast the clock of each reading of a laboratory runs."""
    predicted = lab.predict(hypothesis.lay(fit.data, fit.z, fit.values))
    interval = fit.data.system.plan.test.interval
    columns = zip(lab.measured.T, predicted.T, lab.present.T, strict=True)
    found = [clock.rate(*column, interval) for column in columns]
    return [one for one in found if one is not None]


def remarks(found: Diagnosis) -> list[str]:
    """Sentences on what the logger of an import did to readings: filters, delays, a fast or slow clock, gains."""
    return [
        *passed(found),
        *means.remarks(found),
        *shapes.remarks(found),
        *delays.remarks(found),
        *timed(found),
        *gained(found),
        *bent(found),
    ]


def bent(found: Diagnosis) -> list[str]:
    """A sentence where the ends of readings are left out."""
    if not found.record.edges:
        return []
    return [
        f"The first or last ticks of {', '.join(found.record.edges)} bend as at the ends of a filter that resampled, "
        "and are left out."
    ]


def passed(found: Diagnosis) -> list[str]:
    """A sentence for each kind of filter of the logger that the import map does not state."""
    alike: dict[tuple[str, int, float], dict[str, LoggerFilter]] = {}
    for (_, name), one in found.record.passed.items():
        if one.filter is not None:
            kind = (one.filter.type, one.filter.order, one.filter.ripple)
            alike.setdefault(kind, {})[name] = one.filter
    return [
        f"{' and '.join(those)} passed a low-pass filter of the data logger that the import map does not state: "
        f"about {kind.title()}, of order {order}{f', with a ripple of {ripple:g} dB,' if ripple else ''} and "
        f"{span([one.cutoff for one in those.values()])} Hz, late by "
        f"{span([1e3 * ImportedChannel(one).late for one in those.values()])} ms. It was taken into account; state it."
        for (kind, order, ripple), those in alike.items()
    ]


def span(values: Sequence[float]) -> str:
    """Values in three digits, from the least to the largest."""
    return " to ".join(dict.fromkeys(f"{value:.3g}" for value in (min(values), max(values))))


def gained(found: Diagnosis) -> list[str]:
    """A sentence for readings with a gain that is taken for the calibration of their channels."""
    names: dict[float, list[str]] = {}
    for name, (_, gain) in found.logger.items():
        if abs(gain - 1.0) >= TOLD and found.record.has(name) and np.ptp(found.record.signals[name]) > 0.0:
            names.setdefault(gain, []).append(name)
    return [
        f"The reading{'s' * (len(those) > 1)} {' and '.join(those)} {'are' if len(those) > 1 else 'is'} "
        f"{1e2 * abs(gain - 1.0):.2g} % {'larger' if gain > 1.0 else 'smaller'} than the plan says, which is taken for "
        "the calibration of the channels. A machine of that gain would look the same."
        for gain, those in names.items()
    ]


def timed(found: Diagnosis) -> list[str]:
    """Sentences where readings of an import are late alike, and where their clock was fast or slow."""
    fast = found.record.fast
    said = []
    if fast != 0.0:
        said.append(
            f"The clock of the readings is {'fast' if fast > 0.0 else 'slow'} by {1e6 * abs(fast):.2g} ppm against "
            "that of the commands: the readings were put onto the clock of the commands."
        )
    start = found.record.start
    if start is not None:
        middle = start.late + 0.5 * start.fast * found.record.ticks * found.record.plan.test.interval
        said.append(
            f"The recorded ground motion comes {1e3 * abs(middle):.2g} ms {'later' if middle > 0.0 else 'earlier'} "
            "than the plan's, which is less than an interval and taken for the time at which the data logger began."
        )
    if found.record.early > 0.0:
        said.append(
            f"The readings of all laboratories stand {1e3 * found.record.early:.2g} ms before their time, as means do "
            "that bear the time at which they begin, or readings in the row of the next command: they were put right."
        )
    late = {names: delay for names, delay in least_late(found).items() if delay >= ALIKE}
    if len(late) > 1:
        late = {"All readings": min(late.values())}
    return said + [
        f"{names} come {1e3 * delay:.2g} ms late or more, which is taken for the data logger's delay: state "
        "filter or delay of the channels in the import map to have effects of such a delay judged."
        for names, delay in late.items()
    ]


def least_late(found: Diagnosis) -> dict[str, float]:
    """By how much all readings of forces, and all others, are late at least, s; their names in texts first."""
    delays: dict[str, list[float]] = {}
    for name, (delay, _) in found.logger.items():
        if not found.record.has(name):
            continue
        forces = found.record.unit(name) == "N"
        delays.setdefault("All readings of forces" if forces else "All readings but forces", []).append(delay)
    return {names: min(those) for names, those in delays.items()}
