"""The quality of the diagnosis over many cases: measures with their goals, confusion, calibration."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from report.text.formats import percent, quantity
from validation.blind.cases.names import NAMING
from validation.blind.library import OWN_KERNEL
from validation.blind.results.calibration import clopper_pearson, expected_calibration_error, wilson
from validation.blind.results.calibration import reliability as stated_and_observed
from validation.blind.results.rows import case_rows
from validation.blind.results.scoring import SURE, JudgedEstimate, Outcome
from validation.blind.results.stated import brier_score, in_columns, stated_verdicts

Judged = TypeVar("Judged")

ABSTAINING = ("unknown_effect", "not_enough_data", "ambiguous")
GOALS = 9  # judged at once; their thresholds are those of ADR 0012
LEVEL = (
    1.0 - 0.05 / GOALS
)  # of each interval, so that all verdicts together are right in 95 % of trials (Bonferroni)
UNDECIDED = "too few cases to say"
EDGES = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, math.inf)  # octaves about `VISIBLE`


@dataclass(frozen=True)
class Measure:
    """One line of the table; without a goal it is for information."""

    name: str
    value: float
    low: float  # Wilson interval of a rate, range of the middle 80 % of anything else
    high: float
    count: int
    rate: bool
    least: float | None = None
    most: float | None = None
    unit: str = ""
    # Whether the goal is met; None without goal or case, and where the cases are too few.
    passed: bool | None = None

    @property
    def verdict(self) -> str:
        """The verdict in words, empty where there is no goal or no case."""
        if self.count == 0 or not self.goal:
            return ""
        return UNDECIDED if self.passed is None else "pass" if self.passed else "FAIL"

    @property
    def goal(self) -> str:
        """The goal in words."""
        if self.least is None and self.most is None:
            return ""
        if self.least is not None and self.most is not None:
            return f"{self.shown(self.least)} to {self.shown(self.most)}"
        sign, limit = ("≥", self.least) if self.least is not None else ("≤", self.most)
        return f"{sign} {self.shown(limit)}"

    def shown(self, value: float | None) -> str:
        """A value of this measure as text."""
        if value is None or math.isnan(value):
            return "–"
        if math.isinf(value):
            return "none"
        return percent(value, 1) if self.rate else quantity(value, self.unit)

    @property
    def text(self) -> str:
        """The value with its interval."""
        if self.count == 0 or math.isnan(self.low):
            return self.shown(self.value)
        return f"{self.shown(self.value)} ({self.shown(self.low)} … {self.shown(self.high)})"


def reached(hits: int, count: int, share: float) -> bool | None:
    """Whether a proportion is at least `share`; None where the exact interval includes both, or there is no case."""
    low, high = clopper_pearson(hits, count, LEVEL) if count else (0.0, 1.0)
    return True if low >= share else False if high < share else None


def rate(
    name: str,
    cases: Sequence[Judged],
    good: Callable[[Judged], bool],
    least: float | None = None,
) -> Measure:
    """A share of cases with its Wilson interval."""
    hits = sum(map(good, cases))
    low, high = wilson(hits, len(cases)) if cases else (math.nan, math.nan)
    value = hits / len(cases) if cases else math.nan
    passed = None if least is None else reached(hits, len(cases), least)
    return Measure(name, value, low, high, len(cases), rate=True, least=least, passed=passed)


def quantile(
    name: str,
    values: Iterable[float],
    at: float = 0.5,
    *,
    least: float | None = None,
    most: float | None = None,
    unit: str = "",
    share: bool = False,
) -> Measure:
    """A quantile of values with the range of their middle 80 %; a missing value counts as the worst.

    The goal is met where the share of values that meet it is at least that of the quantile.
    """
    worst = -math.inf if least is not None else math.inf
    known = np.sort([worst if math.isnan(value) else value for value in values])
    if not known.size:
        return Measure(name, math.nan, math.nan, math.nan, 0, rate=share, least=least, most=most, unit=unit)
    middle, low, high = (float(np.quantile(known, q, method="higher")) for q in (at, 0.1, 0.9))
    passed = None
    if most is not None:
        passed = reached(int(np.count_nonzero(known <= most)), known.size, at)
    elif least is not None:
        passed = reached(int(np.count_nonzero(known >= least)), known.size, 1.0 - at)
    return Measure(
        name, middle, low, high, known.size, rate=share, least=least, most=most, unit=unit, passed=passed
    )


def measures(outcomes: Sequence[Outcome]) -> list[Measure]:
    """The table: measures with a goal first, then further ones."""
    return [*with_goal(outcomes), *further(outcomes)]


def with_goal(outcomes: Sequence[Outcome]) -> list[Measure]:
    """The measures that have a goal."""
    seen = [item for item in outcomes if item.single and item.visible]
    right = [one for item in seen if item.kind == "catalogue" for one in item.estimates]
    explained = [
        item
        for item in outcomes
        if item.visible and item.kind != "unknown" and not math.isnan(item.shrinkage)
    ]
    return [
        rate("right effect first", seen, lambda item: item.named, 0.95),
        rate("right site first", seen, lambda item: item.located, 0.98),
        rate("both of a pair", kind(outcomes, "pair"), lambda item: item.named, 0.85),
        rate("clean laboratory: no gap", kind(outcomes, "clean"), lambda item: item.named, 0.98),
        rate(
            "unknown effect: reported, site right", kind(outcomes, "unknown"), lambda item: item.right, 0.90
        ),
        quantile("parameter error, median", (one.error for one in right), most=0.05, share=True),
        quantile("shrinkage over the best possible, median", (i.shrinkage for i in explained), least=0.95),
        calibration_error(outcomes),
        quantile(
            "time per 30 s of test, 95th percentile", (i.seconds for i in outcomes), 0.95, most=10.0, unit="s"
        ),
    ]


def further(outcomes: Sequence[Outcome]) -> list[Measure]:
    """Measures without a goal."""
    singles = [item for item in outcomes if item.single]
    gaps = [item for item in outcomes if item.truth and not item.inside]
    inside = [item for item in outcomes if item.inside]
    visible = [item for item in gaps if item.visible]
    right = [one for item in outcomes for one in item.estimates]
    stated = [one for one in right if one.inside is not None]
    verdicts = stated_verdicts(outcomes)
    own = [item for item in visible if item.kind == "formula" and OWN_KERNEL in item.formulas]
    seen = {
        name: [item for item in kind(visible, name) if item not in own] for name in ("catalogue", "formula")
    }
    seen |= {OWN_KERNEL: own} if own else {}
    by_kind = [
        rate(f"right effect first, {name}", those, lambda item: item.named) for name, those in seen.items()
    ]
    strange = [item for item in kind(outcomes, "unknown") if item.visible]
    pairs = [item for item in kind(outcomes, "pair") if item.visible]
    noticed = [item for item in kind(outcomes, "unknown") if item.seen]
    return [
        rate("visible unknown effect: reported, site right", strange, lambda item: item.right),
        rate("unknown effect that an oracle sees: reported, site right", noticed, lambda item: item.right),
        rate(
            "unknown effect that an oracle sees: a wrong name that is sure",
            noticed,
            lambda item: item.surplus > 0 and item.probability >= SURE,
        ),
        rate("both of a pair whose strongest is visible", pairs, lambda item: item.named),
        *closed_on_another_motion(outcomes),
        rate("an oracle sees an effect", gaps, lambda item: item.seen),
        *by_kind,
        rate("right effect first, all sizes", singles, lambda item: item.named),
        rate("right site first, all sizes", singles, lambda item: item.located),
        rate("an effect named that is not present", outcomes, lambda item: item.surplus > 0),
        rate("false alarm in a clean laboratory", kind(outcomes, "clean"), lambda item: not item.named),
        rate("a known effect named for an unknown one", kind(outcomes, "unknown"), lambda i: bool(i.verdict)),
        rate("inside the tolerances: no gap or the effect named", inside, lambda item: item.named),
        rate("abstention where there is an effect", visible, lambda item: item.status in ABSTAINING),
        rate("missed: no gap where there is an effect", visible, lambda item: item.status == "no_gap"),
        quantile("parameter error relative to the value, median", (i.plain_error for i in right), share=True),
        _coverage(stated),
        Measure("Brier score", *_thrice(brier_score(verdicts)), len(verdicts), rate=False),
    ]


def closed_on_another_motion(outcomes: Sequence[Outcome]) -> list[Measure]:
    """Median and worst share of the gap that is closed on a second motion; empty where no report states it."""
    shares = sorted(0.0 if math.isnan(item.closed) else item.closed for item in outcomes if item.twice)
    if not shares:
        return []
    median = quantile("closed on another motion, median", shares)
    return [median, Measure("closed on another motion, worst", *_thrice(shares[0]), len(shares), rate=False)]


def kind(outcomes: Iterable[Outcome], name: str) -> list[Outcome]:
    """The cases of one kind."""
    return [item for item in outcomes if item.kind == name]


def _coverage(stated: Sequence[JudgedEstimate]) -> Measure:
    hits = sum(bool(one.inside) for one in stated)
    low, high = wilson(hits, len(stated)) if stated else (math.nan, math.nan)
    value = hits / len(stated) if stated else math.nan
    return Measure("stated intervals that hold the true parameter", value, low, high, len(stated), rate=True)


def calibration_error(outcomes: Sequence[Outcome]) -> Measure:
    """Expected calibration error of the verdict's probability."""
    stated = stated_verdicts(outcomes)
    value = float(expected_calibration_error(*in_columns(stated))) if stated else math.nan
    low, high = calibration_bounds(stated) if stated else (0.0, 1.0)
    most = 0.05
    passed = True if high <= most else False if low > most else None
    return Measure("calibration error", *_thrice(value), len(stated), rate=False, most=most, passed=passed)


def calibration_bounds(stated: Sequence[tuple[float, bool]]) -> tuple[float, float]:
    """Smallest and largest calibration error that the exact intervals of the bins' shares allow."""
    table = stated_and_observed(*in_columns(stated))
    low = high = 0.0
    for mean, share, count in zip(*table, strict=True):
        if count:
            least, most = clopper_pearson(round(share * count), int(count), LEVEL)
            low += count * max(least - mean, mean - most, 0.0)
            high += count * max(mean - least, most - mean)
    return low / len(stated), high / len(stated)


def _thrice(value: float) -> tuple[float, float, float]:
    return value, math.nan, math.nan


@dataclass(frozen=True)
class Bin:
    """Cases of like size, or of like probability."""

    low: float
    high: float
    count: int
    share: float
    share_low: float
    share_high: float
    middle: float  # median of the size or probability


def by_size(outcomes: Iterable[Outcome]) -> list[Bin]:
    """Share of right verdicts on single effects against residual to noise."""
    singles = [(item.size, item.named) for item in outcomes if item.single and not item.inside]
    return binned(singles, EDGES)


def reliability(outcomes: Iterable[Outcome]) -> list[Bin]:
    """Share of right verdicts against their stated probability."""
    return binned(stated_verdicts(outcomes), tuple(np.linspace(0.0, 1.0, 11)))


def binned(pairs: Sequence[tuple[float, bool]], edges: Sequence[float]) -> list[Bin]:
    """Hits by bins of a value; the last bin holds its upper edge."""
    result = []
    for low, high in pairwise(edges):
        last = high == edges[-1]
        inside = [(x, hit) for x, hit in pairs if low <= x < high or (last and x == high)]
        if inside:
            hits = sum(hit for _, hit in inside)
            least, most = wilson(hits, len(inside))
            middle = float(np.median([x for x, _ in inside]))
            result.append(Bin(low, high, len(inside), hits / len(inside), least, most, middle))
    return result


Matrix = dict[str, dict[str, int]]


def confusion(outcomes: Iterable[Outcome]) -> Matrix:
    """Number of verdicts by truth; pairs are left out, because they have two truths."""
    matrix: Matrix = {}
    for item in outcomes:
        if item.kind == "pair":
            continue
        true = {"clean": "no gap", "unknown": "unknown"}.get(item.kind) or item.truth[0]
        _count(matrix, true, said(item, true))
    return matrix


def said(item: Outcome, true: str) -> str:
    """The verdict as a label of the confusion matrix."""
    if item.named and not item.surplus and (item.status in NAMING or item.kind in ("clean", "unknown")):
        return true
    words = {"no_gap": "no gap", "unknown_effect": "unknown", "not_enough_data": "not enough data"}
    if item.status in words or not item.verdict:
        return words.get(item.status, item.status)
    return next((name for name in item.verdict if name != true), item.verdict[0])


def confusion_by_site(outcomes: Iterable[Outcome]) -> Matrix:
    """Number of first sites by true site; a clean laboratory's is "none"."""
    matrix: Matrix = {}
    for item in outcomes:
        if item.kind == "pair":
            continue
        true = item.sites[0] if item.sites else "none"
        first = true if item.located else item.verdict_site
        _count(matrix, true, "none" if item.status == "no_gap" or not first else first)
    return matrix


def _count(matrix: Matrix, true: str, verdict: str) -> None:
    row = matrix.setdefault(true, {})
    row[verdict] = row.get(verdict, 0) + 1


def as_plain(value: Any) -> Any:
    """A result as values of JSON; numbers that are not finite become null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: as_plain(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return as_plain(asdict(value))
    return [as_plain(item) for item in value] if isinstance(value, list | tuple) else value


def results(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Everything that is written as JSON."""
    table = [asdict(item) | {"goal": item.goal, "verdict": item.verdict} for item in measures(outcomes)]
    plain: dict[str, Any] = as_plain(
        {
            "measures": table,
            "confusion": {"effect": confusion(outcomes), "site": confusion_by_site(outcomes)},
            "rows": case_rows(outcomes),
            "accuracy_by_size": by_size(outcomes),
            "reliability": reliability(outcomes),
            "cases": [vars(item) for item in outcomes],
        }
    )
    return plain
