"""Every case judged against its truth.

Naming any one effect of a set that the report calls equivalent counts as naming the set. An effect counts
as named where the status says so much (`NAMING`); a laboratory whose parameters are all inside their
tolerances, effect included, has no gap, and saying so is right.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from models.effects import CATALOGUE, of_site
from validation.blind.draw import Case, Laid
from validation.blind.judge import NONE, Answer
from validation.blind.record import Recorded

NAMING = ("explained", "partly_explained", "ambiguous")
UNKNOWN = ("unknown_effect", "partly_explained")
VISIBLE = 2.0  # residual to noise from which an effect must be found: below it noise may hide an effect
AS_MUCH = {"butterworth": "delay"}  # a maximally flat low-pass is as much a delay as the catalogue's lag
STANDARD_LENGTH = 30.0  # s of test that the time of a diagnosis is scaled to


@dataclass(frozen=True)
class Estimate:
    """A parameter of a correctly named effect, judged."""

    name: str
    true: float
    value: float
    error: float  # relative to the distance from the null value
    plain_error: float  # relative to the value
    inside: bool | None  # whether the stated interval holds the truth, None where there is none


@dataclass(frozen=True)
class Outcome:
    """One case, judged."""

    index: int
    kind: str
    truth: list[str]
    formulas: list[str]
    sites: list[str]
    parameters: dict[str, dict[str, float]]
    size: float  # residual to noise, of a pair the smaller one's; NaN for a clean laboratory
    inside: bool
    stopped: str
    recording: str
    status: str
    verdict: list[str]
    verdict_site: str
    probability: float  # NaN where nothing is named
    named: bool  # every true effect is named, or, where there is none or an unknown one, that is said
    located: bool  # the true site stands first
    surplus: bool  # effects are named that are not there
    right: bool
    why: str
    estimates: list[Estimate] = field(default_factory=list)
    shrinkage: float = math.nan  # closed over what the true effects would close
    seconds: float = math.nan  # per 30 s of test

    @property
    def single(self) -> bool:
        """Whether one effect of the catalogue is hidden."""
        return self.kind in ("catalogue", "formula")

    @property
    def visible(self) -> bool:
        """Whether the effect is large enough to be asked for."""
        return self.size >= VISIBLE and not self.inside


def judge_all(
    cases: Sequence[Case], recorded: Mapping[int, Recorded], answers: Mapping[str, Answer]
) -> list[Outcome]:
    """Every case judged; one without an answer is wrong."""
    return [judge(case, recorded[case.index], answers.get(recorded[case.index].name, NONE)) for case in cases]


def judge(case: Case, recorded: Recorded, answer: Answer) -> Outcome:
    """One case judged."""
    report = answer.report
    status = str(report.get("status", "error"))
    verdict = _first(report, "which") if status in NAMING else {}
    names = [str(name) for name in verdict.get("effects", [])]
    sets = [set(group) for group in report.get("equivalent", [])]
    truth = [item.name for item in case.laid]
    site = str(_first(report, "where").get("site", ""))
    located = any(site in sites_of(item, names, sets) for item in case.laid)
    named = is_named(case, status, names, sets)
    right = named and (located or not case.laid or case.inside)
    duration = float(case.plan["test"]["duration"])
    outcome = Outcome(
        index=case.index,
        kind=case.kind,
        truth=truth,
        formulas=[item.formula for item in case.laid],
        sites=[item.site for item in case.laid],
        parameters={item.name: item.parameters for item in case.laid},
        size=min(recorded.sizes, default=math.nan),
        inside=case.inside,
        stopped=recorded.stopped,
        recording=recorded.name,
        status=status,
        verdict=names,
        verdict_site=site,
        probability=float(verdict.get("probability", math.nan)),
        named=named,
        located=located,
        surplus=any(not any(same(item, name, sets) for item in truth) for name in names),
        right=right,
        why="",
        estimates=estimates(case, verdict) if named else [],
        shrinkage=_closed(report) / best_closed(case),
        seconds=answer.seconds * STANDARD_LENGTH / duration,
    )
    return outcome if right else _with(outcome, why=why(outcome, report))


def is_named(case: Case, status: str, names: list[str], sets: list[set[str]]) -> bool:
    """Whether the verdict says what there is."""
    if case.kind == "clean":
        return status == "no_gap"
    if case.kind == "unknown":
        return status in UNKNOWN
    if case.inside and status == "no_gap":
        return True
    return all(any(same(true, name, sets) for true in truths(item) for name in names) for item in case.laid)


def truths(item: Laid) -> set[str]:
    """Names that are right for an effect: its own, and the fault of the same reading that its formula is as much."""
    fault = AS_MUCH.get(item.formula, "")
    return {item.name} | {effect.name for effect in of_site(item.site) if fault and effect.fault == fault}


def same(true: str, name: str, sets: Iterable[set[str]]) -> bool:
    """Whether a name says the true effect, by itself or by a set of equivalents that holds both."""
    return true == name or any(true in group and name in group for group in sets)


def sites_of(item: Laid, names: Sequence[str], sets: Iterable[set[str]]) -> set[str]:
    """Sites that are right: the effect's own, and that of an equivalent that is named in its place."""
    named = [name for name in names if name in CATALOGUE and same(item.name, name, sets)]
    return {item.site} | {CATALOGUE[name].site for name in named}


def estimates(case: Case, verdict: Mapping[str, Any]) -> list[Estimate]:
    """The strength parameters of the true effects that the verdict itself names."""
    found = verdict.get("parameters", {})
    return [
        estimate(item, name, found[item.name].get(name, {}))
        for item in case.laid
        if item.name in found
        for name in item.nulls
        if name in item.parameters
    ]


def estimate(item: Laid, name: str, said: Mapping[str, Any]) -> Estimate:
    """One parameter; relative to its distance from the null value where that is finite."""
    true, null = item.parameters[name], item.nulls[name]
    value = float(said.get("value", math.nan))
    miss = abs(value - true) if math.isfinite(value) else math.inf
    strength = abs(true - null) if math.isfinite(null) else abs(true)
    interval = said.get("interval")
    inside = bool(interval[0] <= true <= interval[1]) if interval else None
    return Estimate(
        f"{item.name}.{name}", true, value, miss / strength, miss / abs(true) if true else miss, inside
    )


def best_closed(_case: Case) -> float:
    """Share of the gap that the true effects close: all of it, down to the noise floor."""
    return 1.0


def _closed(report: Mapping[str, Any]) -> float:
    closed = (report.get("how_far") or {}).get("closed")
    return math.nan if closed is None else float(closed)


def _first(report: Mapping[str, Any], key: str) -> dict[str, Any]:
    entries = report.get(key) or [{}]
    return dict(entries[0])


def _with(outcome: Outcome, **values: Any) -> Outcome:
    return Outcome(**(vars(outcome) | values))


def why(outcome: Outcome, report: Mapping[str, Any]) -> str:
    """Why a case is wrong, in a sentence."""
    reasons = []
    if outcome.status == "error":
        reasons.append(str(report.get("error", "no report")))
    elif not outcome.named:
        said = " and ".join(outcome.verdict) or outcome.status
        wanted = {"clean": "no_gap", "unknown": " or ".join(UNKNOWN)}
        reasons.append(f"says {said}, not {wanted.get(outcome.kind, ' and '.join(outcome.truth))}")
    if outcome.truth and not outcome.located and outcome.status != "error":
        reasons.append(f"looks at {outcome.verdict_site or 'no site'}, not {' or '.join(outcome.sites)}")
    if outcome.size < VISIBLE:
        reasons.append(f"residual to noise below {VISIBLE:g}")
    if outcome.stopped:
        reasons.append("the test was stopped by a limit")
    return "; ".join(reasons)
