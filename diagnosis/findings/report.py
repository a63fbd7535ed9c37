"""The report of a diagnosis, put together from its findings (contract, section 8)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from common.terminal.telling import Tell, untold
from diagnosis.findings import details, how_far, parts_table, rest, where
from diagnosis.findings.certainty import trust
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.further_tests import exercise, next_test
from diagnosis.findings.timeless import without_times
from diagnosis.findings.verdict import UNNAMED, PartVerdict
from diagnosis.findings.which import which
from diagnosis.fits.noise import sensor_noise
from diagnosis.fits.settling import SMALL
from diagnosis.recorded.nuisances import LoggedForce, LoggedReadings
from diagnosis.recorded.record import Record
from diagnosis.report.records import HowFar, Place, Report, Status, Tolerance

# Warning where the effects of a part explain its readings and the test is as far from its simulation as before.
OPEN = (
    "The effects named explain the readings of their part, but close less than half of the gap: another cause may be "
    "behind it."
)
UNLIKE = (
    "The effects named explain this recording, but leave more than a fifth of the gap on the recordings given for "
    "validation: their law is another one, or a further cause shows there."
)
RARE = 2.5  # tolerances that a parameter is rarely off: one of fourteen in one laboratory of six
STILL = 5.0  # rms of a signal over its noise below which nothing is judged: its noise alone is a gap of 20 %


class Judged(NamedTuple):
    """A report without its verdict in words, and its diagnosis with the learned laws that hold."""

    report: Report
    found: Diagnosis


def build(
    found: Diagnosis, validation: Sequence[Record], tell: Tell = untold, require: float | None = None
) -> Judged:
    """The whole report without its verdict in words; `require` is the gap that may be left in each part."""
    tell("how far the gap closes", 0, 0)
    far = how_far.judge(found, validation)
    found, learned, doubts = rest.with_laws_that_hold(found, validation)
    status = status_of(found)
    shrunk = status != "explained" or how_far.shrinks(found, far.how_far)
    signs = trust.signs(found)
    named = which(found, signs, 1.0 if shrunk else most_probable(far.how_far, signs))
    tell("the next test", 0, 0)
    tests = next_test.choices(found)
    whole = Report(
        version=2,
        status=status if shrunk else "partly_explained",
        tolerances=tolerances(found),
        gap=far.gap,
        where=sites_of(found, far),
        which=named.candidates,
        equivalent=tuple(names for verdict in found.verdicts for names in verdict.equivalent),
        how_far=replace(far.how_far, learned=learned),
        not_exercised=exercise.not_exercised(found),
        next_test=next_test.sentence(tests),
        warnings=(
            *found.warnings,
            *far.warnings,
            *named.warnings,
            *([] if shrunk else [open_gap(far.how_far)]),
            *doubts,
            *rarely_off(found),
        ),
        parts=parts_table.parts(found, require),
        details=details.details(found, far, named.candidates, tests, signs),
    )
    return Judged(without_times(whole, found.record) if found.record.static else whole, found)


def most_probable(far: HowFar, signs: Mapping[str, float]) -> float:
    """The largest probability of effects that explain the readings of their part, but not the gap.

    In the same recording that of a partial verdict: errors of nominal parameters, which the loop magnifies, may be all
    that is left of the gap. On other recordings the share that closes: a true cause with its law closes there as well.
    """
    if far.judged_on == how_far.OTHERS:
        return max(far.closed or 0.0, 0.0)
    return trust.PARTLY.probability(signs)


def open_gap(far: HowFar) -> str:
    """The sentence on effects that explain the readings of their part, but not the gap."""
    return UNLIKE if far.judged_on == how_far.OTHERS else OPEN


def status_of(found: Diagnosis) -> Status:
    """The status in one word. An unknown gap in one part does not hide the effects named in another."""
    if not found.verdicts or not moved(found):
        return "not_enough_data"
    outcomes = {verdict.outcome for verdict in found.verdicts}
    named = any(verdict.effects for verdict in found.verdicts) or found.readings or found.link
    if "unknown" in outcomes and not named:
        return "unknown_effect"
    if not outcomes.isdisjoint(UNNAMED):
        return "partly_explained"
    if not named:
        return without_names(found)
    if any(verdict.effects and verdict.probability < 0.5 for verdict in found.verdicts):
        return "ambiguous"
    return "explained"


def moved(found: Diagnosis) -> bool:
    """Whether any part's readings stand out of their noise."""
    for verdict in found.verdicts:
        data = verdict.search.data
        level = np.sqrt(np.mean(np.square(data.part.measured), axis=0))
        if not data.part.exact and np.any(level > STILL * np.maximum(data.white, 1e-12)):
            return True
    return False


def without_names(found: Diagnosis) -> Status:
    """The status where no part has a gap of its own and nothing is named."""
    if any(map(unheard, found.verdicts)):
        return "not_enough_data"
    inside = any(verdict.outcome == "tolerances" for verdict in found.verdicts)
    return "within_tolerances" if inside else "no_gap"


def unheard(verdict: PartVerdict) -> bool:
    """Whether loud noise may be a gap: only the residual tells of it, in a recording too short to ask the inputs."""
    data = verdict.search.data
    return data.related is None and sensor_noise.share(data) > SMALL


def tolerances(found: Diagnosis) -> dict[str, Tolerance]:
    """How far each nominal parameter was moved."""
    result = {}
    for verdict in found.verdicts:
        fit = verdict.search.chosen
        for nuisance, z in zip(verdict.search.data.part.nuisances, fit.z, strict=True):
            if isinstance(nuisance, LoggedForce | LoggedReadings):
                continue
            result[nuisance.name] = Tolerance(factor=1.0 + float(z) * nuisance.tolerance, z=float(z))
    return result


def rarely_off(found: Diagnosis) -> list[str]:
    """Sentences on nominal parameters that explain a gap alone, but are rarely as far off."""
    return [
        f"{nuisance.name} is {abs(z):.1f} tolerances {'above' if z > 0.0 else 'below'} its value in the plan, which is "
        "rare: measure it again, or state a wider tolerance."
        for verdict in found.verdicts
        if verdict.outcome == "tolerances"
        for nuisance, z in zip(verdict.search.data.part.nuisances, verdict.search.chosen.z, strict=True)
        if abs(z) > RARE and not nuisance.of_record
    ]


def sites_of(found: Diagnosis, far: how_far.Response) -> tuple[Place, ...]:
    """Where the gap lies, the largest share first."""
    places = []
    for trace in far.traces:
        share, low, high = far.shares[trace.site]
        places.append(
            Place(
                site=trace.site,
                residual_to_noise=trace.ratio,
                when=where.when(trace, found.record) if trace.series.size else (),
                frequency_band=where.frequencies(trace, found.record) if trace.series.size else (0.0, 0.0),
                share=share,
                share_interval=(low, high),
            )
        )
    return tuple(sorted(places, key=lambda place: -(place.share or 0.0)))
