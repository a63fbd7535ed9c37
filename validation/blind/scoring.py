"""Every case judged against its truth.

Naming any one effect of a set that the report calls equivalent counts as naming the set. An effect counts
as named where the status says so much (`NAMING`); a laboratory whose parameters are all inside their
tolerances, effect included, has no gap, and saying so is right. What a data logger did to the signals may be named
beside the effect, or where there is none: it is really there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from diagnosis.report.records import Candidate
from diagnosis.report.values import Value
from laboratories.effects import CATALOGUE, of_site
from validation.blind.draw import Case, Laid
from validation.blind.judge import NONE, DiagnosisAnswer
from validation.blind.loggers import LOGGERS
from validation.blind.record import RecordedCase

QUIET = ("no_gap", "within_tolerances")
NAMING = ("explained", "partly_explained", "ambiguous")
UNKNOWN = ("unknown_effect", "partly_explained")
VISIBLE = 2.0  # residual to noise from which an effect must be found: below it noise may hide an effect
AS_MUCH = {"butterworth": "delay"}  # a maximally flat low-pass is as much a delay as the catalogue's lag
STANDARD_LENGTH = 30.0  # s of test that the time of a diagnosis is scaled to


@dataclass(frozen=True)
class JudgedEstimate:
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
    surplus: int  # effects named that are not there
    right: bool
    why: str
    logger: str = ""  # through which it was recorded
    first: bool = False  # the first name of the verdict, the logger's doing apart, says a true effect
    estimates: list[JudgedEstimate] = field(default_factory=list)
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
    cases: Sequence[Case], recorded: Mapping[int, RecordedCase], answers: Mapping[str, DiagnosisAnswer]
) -> list[Outcome]:
    """Every case judged; one without an answer is wrong."""
    return [judge(case, recorded[case.index], answers.get(recorded[case.index].name, NONE)) for case in cases]


def judge(case: Case, recorded: RecordedCase, answer: DiagnosisAnswer) -> Outcome:
    """One case judged."""
    report = answer.report
    status = report.status if report else "error"
    verdict = report.which[0] if report and report.which and status in NAMING else None
    names = list(verdict.effects) if verdict else []
    sets = [set(group) for group in report.equivalent] if report else []
    truth = [item.name for item in case.laid]
    site = report.where[0].site if report and report.where else ""
    located = any(site in sites_of(item, names, sets) for item in case.laid)
    own = [name for name in names if not is_distortion(case, name) or name in truth]
    wrong = [name for name in own if not any(same(item, name, sets) for item in truth)]
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
        probability=number(verdict.probability) if verdict else math.nan,
        named=named,
        located=located,
        surplus=len(wrong),
        right=right,
        why="",
        logger=case.logger,
        first=bool(own) and own[0] not in wrong,
        estimates=estimates(case, verdict) if named and verdict else [],
        shrinkage=number(report.how_far.closed if report else None) / best_closed(case),
        seconds=answer.seconds * STANDARD_LENGTH / duration,
    )
    return outcome if right else replace(outcome, why=why(outcome, answer.error))


def is_named(case: Case, status: str, names: list[str], sets: list[set[str]]) -> bool:
    """Whether the verdict says what there is."""
    if case.kind == "clean":
        return status in QUIET or (bool(names) and all(is_distortion(case, name) for name in names))
    if case.kind == "unknown":
        return status in UNKNOWN
    if case.inside and status in QUIET:
        return True
    return all(any(same(true, name, sets) for true in truths(item) for name in names) for item in case.laid)


def is_distortion(case: Case, name: str) -> bool:
    """Whether a name says what the case's logger did to a signal."""
    if not case.logger or not name.startswith("sensor."):
        return False
    return name.rpartition(".")[2] in LOGGERS[case.logger].distortions


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


def estimates(case: Case, verdict: Candidate) -> list[JudgedEstimate]:
    """The strength parameters of the true effects that the verdict itself names."""
    found = verdict.parameters
    return [
        estimate(item, name, found[item.name].get(name))
        for item in case.laid
        if item.name in found and not is_distortion(case, item.name)
        for name in item.nulls
        if name in item.parameters
    ]


def estimate(item: Laid, name: str, said: Value | None) -> JudgedEstimate:
    """One parameter; relative to its distance from the null value where that is finite."""
    true, null = item.parameters[name], item.nulls[name]
    value = number(said.value if said else None)
    miss = abs(value - true) if math.isfinite(value) else math.inf
    strength = abs(true - null) if math.isfinite(null) else abs(true)
    low, high = (said.interval if said else None) or (None, None)
    inside = None if low is None or high is None else low <= true <= high
    return JudgedEstimate(
        f"{item.name}.{name}", true, value, miss / strength, miss / abs(true) if true else miss, inside
    )


def best_closed(_case: Case) -> float:
    """Share of the gap that the true effects close: all of it, down to the noise floor."""
    return 1.0


def number(value: float | None) -> float:
    """A number of a report, NaN where it was not determined."""
    return math.nan if value is None else value


def why(outcome: Outcome, error: str) -> str:
    """Why a case is wrong, in a sentence; `error` is that of a diagnosis that failed."""
    reasons = []
    if outcome.status == "error":
        reasons.append(error)
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
