"""The data logger between an imported recording and its laboratories: its clock, delay and interpolation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.findings.certainty.intervals import FOREIGN, covariance
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.sensors import readings
from diagnosis.findings.verdict import UNNAMED, PartVerdict
from diagnosis.fits import fitting, hypothesis, residuals
from diagnosis.fits.fitting import Fit
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.ground import Ground
from diagnosis.recorded.logged_building import LoggedBuilding
from diagnosis.recorded.parts import ALIKE, LATE, LaboratoryPart, Part
from diagnosis.recorded.record import LEAST_TICKS, Record
from diagnosis.signals import clock

# Share of a reading's rms that a nominal model leaves, from which on an effect is at work: noise, a hum of 1 % of the
# peak and a converter together leave up to 4 %.
SPOILT = 0.05
TOLD = 4e-3  # of a reading's gain: the report shows two digits, and less is no matter for a test


def interpolated(parts: Sequence[Part]) -> dict[str, float]:
    """The step whose rounding would be as large as the error of an interpolated ground motion, by signal."""
    grounds = [part for part in parts if isinstance(part, Ground)]
    return {part.signals[0]: math.sqrt(12.0) * part.blur for part in grounds if part.blur > 0.0}


def common_delay(parts: Sequence[Part], record: Record, steps: Mapping[str, float]) -> float:
    """Delay (s) of a logger by which every channel of several laboratories is late at least, 0 where one is not.

    A filter or a logger delays all of its channels; an effect delays those of one machine. A laboratory that its
    nominal model misses by far tells nothing of the logger, as long as another one does.
    """
    fits = nominal(parts, record, steps)
    if len(fits) < 2:
        return 0.0
    near = [missed(fit) < SPOILT for _, fit in fits]
    found = [
        delay
        for (lab, fit), yes in zip(fits, near, strict=True)
        if yes or not any(near)
        for delay in lab.late(fit.z)
    ]
    return max(0.0, min(found, default=0.0))


def by_building(verdict: PartVerdict) -> tuple[float, float] | None:
    """Delay (s) and its standard deviation of a logger by the forces of a building; None where it tells nothing.

    A building tells the delay apart from that of any machine, but only as surely as its own formula is right, and
    nothing where its gap has no cause. No other part tells it.
    """
    fit = verdict.search.chosen
    part = fit.data.part
    if not isinstance(part, LoggedBuilding) or verdict.outcome in UNNAMED:
        return None
    return part.late(fit.z, FOREIGN * np.sqrt(np.diag(covariance(fit))[: fit.z.size]))


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
    labs = [part.logged(0.0, spread=LATE) for part in parts if isinstance(part, LaboratoryPart)]
    return [(lab, fitting.fit(residuals.prepare(lab, record, steps), {})) for lab in labs]


def rates(lab: LaboratoryPart, fit: Fit) -> list[clock.Rate]:
    """How fast the clock of each reading of a laboratory runs."""
    predicted = lab.predict(hypothesis.lay(fit.data, fit.z, fit.values))
    interval = fit.data.system.plan.test.interval
    columns = zip(lab.measured.T, predicted.T, lab.present.T, strict=True)
    found = [clock.rate(*column, interval) for column in columns]
    return [one for one in found if one is not None]


def missed(fit: Fit) -> float:
    """Largest share of a reading's rms that a fit leaves."""
    left = fit.data.residual(hypothesis.lay(fit.data, fit.z, fit.values))
    there = fit.data.part.present
    level, rest = (
        np.sqrt(np.sum(np.square(np.where(there, x, 0.0)), axis=0)) for x in (fit.data.part.measured, left)
    )
    return float(np.max(rest[level > 0.0] / level[level > 0.0], initial=0.0))


def remarks(found: Diagnosis) -> list[str]:
    """Sentences on readings of an import that are late alike or of a fast or slow clock, and on those with a gain."""
    return [*timed(found), *gained(found)]


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
    """Sentences where all readings of an import are late alike, and where their clock was fast or slow."""
    late = min((delay for delay, _ in found.logger.values()), default=0.0)
    fast = found.record.fast
    said = []
    if fast != 0.0:
        said.append(
            f"The clock of the readings is {'fast' if fast > 0.0 else 'slow'} by {1e6 * abs(fast):.2g} ppm against "
            "that of the commands: the readings were put onto the clock of the commands."
        )
    if late < ALIKE:
        return said
    return [
        *said,
        f"All readings come {1e3 * late:.2g} ms late or more, which is taken for the data logger's delay: state "
        "filter or delay of the channels in the import map to have effects of such a delay judged.",
    ]
