"""How far the learned laws close the gap beside the named effects, and how the report shows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from diagnosis.findings.found import Diagnosis
from diagnosis.findings.gaps import RecordingGaps, judging
from diagnosis.findings.series import numbers, strongest
from diagnosis.learned.equations import Equation
from diagnosis.learned.learn import LearnedLaw, Of
from diagnosis.learned.regression import AVERAGED
from diagnosis.recorded.loop import closed_share, overall
from diagnosis.recorded.record import Record
from diagnosis.report.evidence import Abscissa, LearnedRest, NaturalCurve, Ordinate
from diagnosis.report.records import LearnedGap
from diagnosis.signals.mask import Mask
from models import preisach

# Largest motion of the strongest part over that of the rest from which on judging there is extrapolation.
FARTHER = 1.1
# Gap with a learned law over that with the named effects alone beyond which the law is dropped: a law that changes
# nothing at all makes a gap a little larger or smaller by chance.
WORSE = 1.02
# Share of the strongest part that no fit of effects must have seen, for it to be judged on that share alone; of every
# five seconds two are withheld, so that the usual share is 0.4.
ENOUGH = 0.2
OTHERS, STRONGEST = "other recordings", "strongest part"


class Gaps(NamedTuple):
    """Overall gaps on data that was not used."""

    before: float  # parameters moved inside their tolerances, no effect
    named: float  # with the effects of the verdict
    learned: float  # with what was learned as well
    floor: float  # of noise alone
    on: str  # the data


def with_laws_that_hold(
    found: Diagnosis, validation: Sequence[Record]
) -> tuple[Diagnosis, LearnedGap | None, tuple[str, ...]]:
    """The findings without learned laws that do not hold, how far the others close the gap, and warnings.

    Laws are judged on the recordings given for validation; without these on the strongest part of the recording, by
    laws that were learned from the rest of it.
    """
    if not found.learned:
        return found, None, ()
    gap = on_others(found, validation) or on_itself(found)
    sites = tuple(law.site for law in found.learned)
    if not gap.learned <= WORSE * gap.named:  # nor one with which the simulation diverges
        text = f"The law learned at {', '.join(sites)} does not hold on data not used for it and is left out."
        return replace(found, learned=()), None, (text,)
    closed = closed_share(gap.before, gap.learned, gap.floor)
    far = LearnedGap(
        before=gap.before, named=gap.named, after=gap.learned, closed=closed, sites=sites, judged_on=gap.on
    )
    return found, far, ()


def on_others(found: Diagnosis, validation: Sequence[Record]) -> Gaps | None:
    """Means over the recordings given, None where none of them holds a part that was judged."""
    judges = [RecordingGaps(found, record, np.ones(record.ticks, dtype=bool)) for record in validation]
    gaps = [gaps_of(judge, "law", OTHERS) for judge in judges if judge.judges]
    if not gaps:
        return None
    before, named, learned, floor = (
        float(np.mean(values)) for values in zip(*(item[:4] for item in gaps), strict=True)
    )
    return Gaps(before, named, learned, floor, OTHERS)


def on_itself(found: Diagnosis) -> Gaps:
    """Gaps on the strongest part, by laws learned from the rest where these hold; otherwise on the withheld seconds."""
    record = found.record
    held, where_judged = judging(found)
    part = strongest_part(found)
    if part is not None:
        unseen = part & held
        mask = unseen if unseen.sum() > ENOUGH * part.sum() else part
        found_there = gaps_of(RecordingGaps(found, record, mask), "weaker", STRONGEST)
        if found_there.learned <= WORSE * found_there.named:
            return found_there
    return gaps_of(RecordingGaps(found, record, held), "interleaved", where_judged)


def strongest_part(found: Diagnosis) -> Mask | None:
    """Ticks around the largest motion at the strongest law, None where the motion elsewhere is about as large."""
    first = max(found.learned, key=lambda law: law.regression.share)
    part = np.zeros(found.record.ticks, dtype=bool)
    part[slice(*first.regression.strongest)] = True
    motion = np.abs(first.equation.motion)
    farther = float(motion[part].max()) > FARTHER * float(motion[~part].max(initial=0.0))
    return part if farther else None


def gaps_of(judge: RecordingGaps, of: Of, on: str) -> Gaps:
    """The overall gaps of a recording without effects, with the effects found, and with the learned laws as well."""
    plans = judge.record.plans
    corrected = judge.simulated(judge.found.corrected(plans, of))
    simulated = (judge.signals(frozenset()), judge.signals(None), corrected)
    before, named, learned = (overall(judge.gap(item)) for item in simulated)
    return Gaps(before, named, learned, overall(judge.floor()), on)


def abscissa(equation: Equation, part: slice) -> Abscissa:
    """Abscissa of the curve of a law: the rate of the motion, or the motion."""
    if equation.over == "velocity":
        return Abscissa(label="velocity (m/s)", values=numbers(equation.rate[part]))
    return Abscissa(label=f"{equation.over} (m)", values=numbers(equation.motion[part]))


def shown(found: Diagnosis, law: LearnedLaw) -> LearnedRest:
    """The report's entry of one law, with its curve in natural coordinates."""
    equation, regression = law.equation, law.regression
    interval = found.record.plan.test.interval
    part = strongest(equation.left, interval)
    said = preisach.play(regression.law, equation.motion, equation.rate)
    band = regression.band(equation.motion, equation.rate)
    left = ndimage.uniform_filter1d(equation.left, max(1, round(AVERAGED / interval)))
    return LearnedRest(
        site=law.site,
        quantity=equation.quantity,
        unit=equation.unit,
        before=regression.before,
        after=regression.error,
        curve=NaturalCurve(
            title=f"{law.site}: {equation.quantity} beyond the effects named, over {equation.over}",
            x=abscissa(equation, part),
            y=Ordinate(label=f"{equation.quantity} left ({equation.unit})"),
            measured=numbers(left[part]),
            after=numbers(said[part]),
            low=numbers((said - band)[part]),
            high=numbers((said + band)[part]),
        ),
        law=tuple(regression.law.tolist()),
    )
