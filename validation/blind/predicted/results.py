"""The quality of predictions over many cases: measures with their goals, and a row for each case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from report.text.formats import MISSING, percent, quantity
from validation.blind.predicted.predict import PredictedCase
from validation.blind.results.measures import Measure, as_plain, quantile, rate
from validation.blind.results.scoring import Outcome

HEAD = (
    "case",
    "kind",
    "hidden",
    "next test",
    "before",
    "after",
    "after / before",
    "inside",
    "closed",
    "remarks",
)
# The goals: what is left of the error in the median and in the worst tenth of the cases, and the share of the time
# that bands of 90 % hold, over cases.
MEDIAN, WORST_TENTH = 0.1, 0.5
HELD = (0.85, 0.95)
# Share of the cases in which the share of the gap that closes is stated within `NEAR` of what it is in the next test.
AGREES, NEAR = 0.9, 0.1
SURE = 1.96  # standard errors of a mean on both sides, for an interval of 95 %


def with_stated(cases: Sequence[PredictedCase], outcomes: Sequence[Outcome]) -> list[PredictedCase]:
    """The predictions with the share of the gap that each report stated to close where it names effects."""
    said = {one.index: one.closed for one in outcomes if one.verdict and not one.twice}
    return [replace(one, stated=said.get(one.index, math.nan)) for one in cases]


def measures(cases: Sequence[PredictedCase]) -> list[Measure]:
    """The table; a prediction that could not be made counts as the worst."""
    ratios = [one.ratio for one in cases]
    return [
        quantile("prediction: error after / before, median", ratios, most=MEDIAN),
        quantile("prediction: error after / before, worst tenth", ratios, 0.9, most=WORST_TENTH),
        share_inside([one.inside for one in cases if not math.isnan(one.inside)]),
        rate(
            f"prediction: closed as stated, within {NEAR:g}",
            [one for one in cases if not math.isnan(one.closed + one.stated)],
            lambda one: abs(one.closed - one.stated) <= NEAR,
            AGREES,
        ),
    ]


def share_inside(shares: Sequence[float]) -> Measure:
    """Mean share of the time inside the bands; the goal is judged by the interval of the mean."""
    name, (least, most) = "prediction: time inside the band of 90 %, mean", HELD
    if not shares:
        return Measure(name, math.nan, math.nan, math.nan, 0, rate=True, least=least, most=most)
    mean = float(np.mean(shares))
    error = SURE * float(np.std(shares, ddof=1)) / math.sqrt(len(shares)) if len(shares) > 1 else math.inf
    low, high = (float(np.quantile(shares, q)) for q in (0.1, 0.9))
    within = least <= mean - error and mean + error <= most
    beyond = mean + error < least or mean - error > most
    passed = True if within else False if beyond else None
    return Measure(name, mean, low, high, len(shares), rate=True, least=least, most=most, passed=passed)


def cells(one: PredictedCase) -> tuple[str, ...]:
    """The row of a case in words."""
    remarks = [one.error, f"stopped: {one.stopped}" if one.stopped else "", beyond(one)]
    return (
        str(one.index),
        one.kind,
        " and ".join(one.truth) or "clean",
        f"{one.motion}, {one.stronger:.2f} ×",
        percent(one.before, 2),
        percent(one.after, 2) if math.isfinite(one.after) else MISSING,
        quantity(one.ratio, "") if math.isfinite(one.ratio) else MISSING,
        percent(one.inside, 0) if not math.isnan(one.inside) else MISSING,
        MISSING if math.isnan(one.closed + one.stated) else f"{one.closed:.2f} ({one.stated:.2f} stated)",
        "; ".join(filter(None, remarks)),
    )


def beyond(one: PredictedCase) -> str:
    """Where the prediction states that the test leaves the observed range."""
    parts = [f"{role} {ratio:.2g} × the amplitude" for role, ratio in one.farther.items()]
    parts += [f"{role} {percent(share, 0)} at other frequencies" for role, share in one.elsewhere.items()]
    return f"said beyond what was seen: {', '.join(parts)}" if parts else ""


def results(cases: Sequence[PredictedCase]) -> dict[str, Any]:
    """Everything that is written as JSON."""
    table = [asdict(item) | {"goal": item.goal, "verdict": item.verdict} for item in measures(cases)]
    rows = [asdict(one) | {"ratio": one.ratio} for one in cases]
    plain: dict[str, Any] = as_plain({"measures": table, "cases": rows})
    return plain
