"""The evidence behind a report: series, spectra, curves and tables that pages draw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from common.recording.outcome import outcome
from diagnosis.findings import where
from diagnosis.findings.ceilings import ceilings, unknowns
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.further_tests.next_test import ChosenTest
from diagnosis.findings.how_far import Response
from diagnosis.findings.rest import shown
from diagnosis.findings.series import numbers, strongest
from diagnosis.findings.verdict import PartVerdict
from diagnosis.findings.where import SiteTrace
from diagnosis.fits import fitting, hypothesis
from diagnosis.fits.fitting import Fit
from diagnosis.fits.residuals import Data
from diagnosis.fits.unexplained import remaining
from diagnosis.fits.worth import SEEN
from diagnosis.recorded.laboratory import RecordedLaboratory
from diagnosis.recorded.loop import simulated
from diagnosis.recorded.paths import force_path, paths
from diagnosis.recorded.record import Record
from diagnosis.report.evidence import (
    Abscissa,
    Details,
    Evidence,
    LaboratorySeen,
    Left,
    NaturalCurve,
    NextTest,
    Ordinate,
    OverAmplitude,
    OverFrequency,
    OverTime,
    PartSeen,
    Reading,
    Remaining,
    TestFacts,
)
from diagnosis.report.records import Candidate
from diagnosis.signals import windows
from laboratories.effects import sites
from models.registry import Array

LISTED = 5  # next tests, the best separating ones: as many as a reader compares
# Hz, four times the frequency of the default table: above, spectra show the sensors' noise alone.
SHOWN_UP_TO = 60.0
# Classes of amplitude; each holds an eighth of the samples, seconds of a test, so that its rms is well known.
CLASSES = 8


def details(
    found: Diagnosis,
    far: Response,
    which: Sequence[Candidate],
    tests: Sequence[ChosenTest],
    signs: Mapping[str, float],
) -> Details:
    """Everything that a page shows beside the report itself."""
    record, strange = found.record, unknowns(found)
    return Details(
        test=facts(record),
        laboratories=tuple(map(laboratory, record.labs)),
        parts=tuple(part(found, trace) for trace in far.traces if trace.series.size),
        paths=paths(record, nominal_signals(found)),
        force_path=force_path(record),
        loop_shares=far.loop_shares,
        candidates=tuple(candidate(found, entry) for entry in which if entry.effects),
        signs=signs,
        ceiling=ceilings(found),
        curves=tuple(item for verdict in found.verdicts for item in curves(found, verdict)),
        waterfall=far.waterfall,
        histories=far.histories,
        unknown=strange[0] if strange else None,
        unknowns=strange,
        learned=tuple(shown(found, law) for law in found.learned),
        remaining=remains(found, far),
        next=tuple(
            NextTest(test=item.test, separation=item.separation, pair=item.pair) for item in tests[:LISTED]
        ),
    )


def facts(record: Record) -> TestFacts:
    """Facts of the test."""
    summary = record.run.metadata.get("summary", {})
    motion = record.run.metadata.get("ground_motion", {})
    return TestFacts(
        name=record.plan.test.name,
        duration=record.ticks * record.plan.test.interval,
        interval=record.plan.test.interval,
        ticks=record.ticks,
        motion=(
            f"{motion['record']}, scaled by {motion.get('scale', '?')}"
            if "record" in motion
            else "no ground motion recorded"
        ),
        outcome=outcome(summary),
        file=record.run.path.name,
    )


def laboratory(lab: RecordedLaboratory) -> LaboratorySeen:
    """The sites and sensors of a laboratory, under the names that the report uses."""
    machines, read = lab.kind.sites, sites.sensors(lab.kind)
    return LaboratorySeen(
        role=lab.role, sites=tuple(map(lab.site, machines)), sensors=tuple(map(lab.site, read))
    )


def remains(found: Diagnosis, far: Response) -> Remaining:
    """The gap that the verdict leaves, overall and by site."""
    return Remaining(
        overall=far.how_far.after,
        where=tuple(
            Left(site=where.unexplained(item).site, residual_to_noise=item.search.left)
            for item in found.verdicts
            if item.search.left > 0.0
        ),
    )


def nominal_signals(found: Diagnosis) -> dict[str, Array] | None:
    """Signals of the closed loop of nominal models, None where there is no loop."""
    record = found.record
    if record.ground is None or not record.simulable or not record.has(*record.targets[:1]):
        return None
    return simulated(record, record.systems, record.ground)


def part(found: Diagnosis, trace: SiteTrace) -> PartSeen:
    """Signals of the part that shows a site, measured and predicted, and its residual over time and frequency."""
    interval = found.record.plan.test.interval
    verdict = next(item for item in found.verdicts if trace.signal in item.search.data.part.signals)
    data, fit = verdict.search.data, verdict.search.chosen
    place = data.part.signals.index(trace.signal)
    over = windows.windows(trace.series, 1.0, interval)
    spectrum = windows.bands(trace.series * trace.sigma, float(data.white[place]), interval)
    keep = spectrum.frequency <= SHOWN_UP_TO
    amplitude, ratio = windows.by_amplitude(trace.series, data.part.measured[:, place], 1.0, CLASSES)
    return PartSeen(
        site=trace.site,
        signals=(reading(found.record, data, fit, trace),),
        windows=OverTime(t=numbers(over.t), ratio=numbers(over.ratio)),
        bands=OverFrequency(
            frequency=numbers(spectrum.frequency[keep]),
            residual=numbers(spectrum.residual[keep]),
            noise=numbers(np.broadcast_to(spectrum.noise, spectrum.residual.shape)[keep]),
        ),
        amplitudes=OverAmplitude(amplitude=numbers(amplitude), ratio=numbers(ratio)),
    )


def reading(record: Record, data: Data, fit: Fit, trace: SiteTrace) -> Reading:
    """The signal that shows a trace, measured and predicted, in its strongest seconds."""
    place = data.part.signals.index(trace.signal)
    shown = strongest(trace.series, record.plan.test.interval)
    nominal = data.part.predict(hypothesis.lay(data, fit.z, {}))[:, place]
    corrected = data.part.predict(hypothesis.lay(data, fit.z, fit.values))[:, place]
    measured = data.part.measured[:, place]
    return Reading(
        signal=trace.signal,
        unit=record.unit(trace.signal),
        residual_rms=float(np.sqrt(np.mean((measured - nominal) ** 2))),
        noise_floor=trace.sigma,
        t=numbers(record.time[shown]),
        measured=numbers(measured[shown]),
        nominal=numbers(nominal[shown]),
        corrected=numbers(corrected[shown]),
    )


def candidate(found: Diagnosis, entry: Candidate) -> Evidence:
    """A candidate with the evidence for and against it."""
    kinds = {found.record.catalogue[name].kind for name in entry.effects}
    explained, against = [], []
    for verdict in found.verdicts:
        own = {item.name for item in verdict.search.data.part.candidates}.intersection(entry.effects)
        for fit in (verdict.search.chosen, *verdict.search.alternatives):
            if set(fit.names) == own and own:
                before = fitting.excess(verdict.search.commissioned)
                explained.append(1.0 - fitting.excess(fit) / before if before else 0.0)
                if (left := remaining(fit)) > SEEN:
                    against.append(
                        f"leaves a residual of {left:.1f} times the noise in {verdict.search.data.part.name}"
                    )
                break
    share = float(np.mean(explained)) if explained else 1.0
    return Evidence(
        effects=entry.effects,
        kind="measurement" if kinds == {"measurement"} else "physics",
        probability=entry.probability,
        explained=share,
        score=entry.held_out_score,
        parameters=entry.parameters,
        for_=f"explains {100 * share:.1f} % of the energy of its part's gap",
        against="; ".join(against),
    )


def curves(found: Diagnosis, verdict: PartVerdict) -> list[NaturalCurve]:
    """Hysteresis or scatter of each site found, in its natural coordinates."""
    data, fit = verdict.search.data, verdict.search.chosen
    result = []
    coordinates = {
        lab.site(machine.site): (lab.signal(machine.curve[0]), lab.signal(machine.curve[1]))
        for lab in found.record.labs
        for machine in lab.kind.machines(lab.plan)
    }
    for trace in where.traces(data, fit):
        pair = coordinates.get(trace.site)
        if pair is not None and found.record.has(*pair) and pair[1] in data.part.signals:
            result.append(curve(found.record, data, fit, trace, pair))
    return result


def curve(record: Record, data: Data, fit: Fit, trace: SiteTrace, pair: tuple[str, str]) -> NaturalCurve:
    """One signal of a pair over the other, measured, and predicted without and with the effects of a site."""
    place = data.part.signals.index(pair[1])
    shown = strongest(trace.series, record.plan.test.interval)
    own = {name: values for name, values in fit.values.items() if data.catalogue[name].site != trace.site}
    before = data.part.predict(hypothesis.lay(data, fit.z, own))[:, place]
    after = data.part.predict(hypothesis.lay(data, fit.z, fit.values))[:, place]
    x, y = (name.replace("_", " ") for name in pair)
    return NaturalCurve(
        title=f"{trace.site}: {y} over {x}",
        x=Abscissa(label=f"{x} ({record.unit(pair[0])})", values=numbers(record.signals[pair[0]][shown])),
        y=Ordinate(label=f"{y} ({record.unit(pair[1])})"),
        measured=numbers(data.part.measured[shown, place]),
        before=numbers(before[shown]),
        after=numbers(after[shown]),
    )
