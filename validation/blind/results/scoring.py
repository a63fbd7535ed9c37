"""Every case judged against its truth.

Naming any one effect of a set that the report calls equivalent counts as naming the set. An effect counts as named
where the status names causes (`NAMING`). A laboratory whose parameters are all inside their tolerances, effect
included, has no gap, and a report that says so is right. Distortions by a data logger may be named beside the effect,
or without one, because they are real. So may nominal parameters that are truly more than two tolerances off, in sets
whose tolerances are standard deviations.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from common.plan import read as plans
from diagnosis.report.records import Report
from diagnosis.report.values import Value
from validation.blind.best import best_closed
from validation.blind.cases.case import Case, Laid
from validation.blind.cases.names import NAMING, CaseNames, Heard
from validation.blind.cases.truths import TWO_TOLERANCES, is_truly_off
from validation.blind.judge import NONE, DiagnosisAnswer
from validation.blind.labs.materials import MATERIALS
from validation.blind.library import MATERIAL
from validation.blind.logger.loggers import LOGGERS
from validation.blind.oracle import SEEN
from validation.blind.record import RecordedCase

QUIET = ("no_gap", "within_tolerances")
UNKNOWN = ("unknown_effect", "partly_explained")  # the second without a name that the report is sure of
SURE = 0.5  # probability from which a report is sure of a name: more likely than not
VISIBLE = 2.0  # residual to noise from which an effect must be found: below it noise may hide an effect
AS_MUCH = {
    "butterworth": "delay"
}  # a Butterworth low-pass resembles a pure delay as much as the catalogue's lag
HARDLY = 1.1  # times its noise floor, which rests on two noisy simulations, from which on a gap stands out
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
    laboratories: list[str]  # the role that has each effect, empty for the building's
    parameters: dict[str, dict[str, float]]
    size: float  # residual to noise, of several effects the smallest; NaN for a clean laboratory
    inside: bool
    stopped: str
    recording: str
    status: str
    verdict: list[str]
    verdict_site: str
    probability: float  # NaN where nothing is named
    named: bool  # every true effect is named; a clean laboratory or an unknown effect is reported as such
    located: bool  # the true site stands first
    surplus: int  # effects named that are not present
    right: bool
    why: str
    logger: str = ""  # through which it was recorded
    # The first name of the verdict, apart from distortions by the logger, is a true effect.
    first: bool = False
    asked: int = 0  # effects that are large enough to be found
    listed: int = 0  # of these, those that the verdict names
    separation: float = math.inf  # of all effects, as an oracle sees them
    closed: float = math.nan  # share of the gap that is closed by the report
    twice: bool = False  # that share is of another motion
    estimates: list[JudgedEstimate] = field(default_factory=list)
    shrinkage: float = math.nan  # closed over what the true effects would close
    seconds: float = math.nan  # per 30 s of test
    signs: Mapping[str, float] = field(default_factory=dict)  # from which the probability follows

    @property
    def single(self) -> bool:
        """Whether one effect of the catalogue is hidden."""
        return self.kind in ("catalogue", "formula", MATERIAL)

    @property
    def visible(self) -> bool:
        """Whether the effect is large enough to be found."""
        return self.size >= VISIBLE and not self.inside

    @property
    def seen(self) -> bool:
        """Whether an oracle sees an effect."""
        return self.separation >= SEEN and not self.inside


def judge_all(
    cases: Sequence[Case], recorded: Mapping[int, RecordedCase], answers: Mapping[str, DiagnosisAnswer]
) -> list[Outcome]:
    """Every case judged; one without an answer is wrong."""
    return [judge(case, recorded[case.index], answers.get(recorded[case.index].name, NONE)) for case in cases]


def judge(case: Case, recorded: RecordedCase, answer: DiagnosisAnswer) -> Outcome:
    """One case judged.

    Of a test with several slaves each effect counts as named where the report on its laboratory says so.
    """
    names = CaseNames(plans.from_tables(case.plan, Path()))
    heard = [names.heard(slave, report) for slave, report in answer.reports.items()]
    asked = consulted(case, heard)
    status = status_of(case, asked)
    verdict = list(dict.fromkeys(name for one in heard for name in one.names))
    sets = [set(those) for one in heard for those in one.sets]
    located = [
        one.site
        for item in case.laid
        if (one := report_on(item, heard)) and one.site in right_sites(item, one, names)
    ]
    truth = [names.effect(item) for item in case.laid]
    real = {name for one in heard for name in one.names if is_real(case, name, one, names)}
    own = [name for name in verdict if name in truth or name not in real]
    right_names = {name for item in case.laid for name in truths(item, names)}
    wrong = [name for name in own if not any(same(item, name, sets) for item in right_names)]
    asked_for = visible(case, recorded)
    listed = credited(asked_for, heard, names)
    named = is_named(case, status, heard, names, asked_for)
    best = best_closed(list(answer.reports.values()), recorded.left)
    closed = min((number(one.closed) for one in asked), default=math.nan)
    right = named and (bool(located) or not case.laid or case.inside)
    outcome = Outcome(
        index=case.index,
        kind=case.kind,
        truth=truth,
        formulas=[item.formula for item in case.laid],
        sites=[names.site(item) for item in case.laid],
        laboratories=[item.role for item in case.laid],
        parameters={names.effect(item): item.parameters for item in case.laid},
        size=min(recorded.sizes, default=math.nan),
        inside=case.inside,
        stopped=recorded.stopped,
        recording=recorded.name,
        status=status,
        verdict=verdict,
        verdict_site=next((one for one in located), next((one.site for one in asked if one.site), "")),
        probability=min((number(one.probability) for one in asked if one.names), default=math.nan),
        named=named,
        located=bool(located),
        surplus=len(wrong),
        right=right,
        why="",
        logger=case.logger,
        first=bool(own) and own[0] not in wrong,
        asked=len(asked_for),
        listed=len(listed),
        separation=recorded.separation,
        closed=closed,
        twice=bool(case.other) and stands_out(answer.reports.values()),
        estimates=estimates(case, heard, names) if named else [],
        shrinkage=0.0 if math.isnan(closed) else closed / best,
        seconds=answer.seconds * STANDARD_LENGTH / float(case.plan["test"]["duration"]),
        signs=next((one.signs for one in asked if one.names), {}),
    )
    return outcome if right else replace(outcome, why=why(outcome, answer.error))


def stands_out(reports: Iterable[Report]) -> bool:
    """Whether the gap of the motion that judges stands out of its noise: where it does not, nothing can close.

    A weak second motion leaves a column elastic that yielded under the first. Reports without figures count as well.
    """
    far = [(one.how_far.before, one.how_far.noise_floor) for one in reports]
    return not far or any(before is None or floor is None or before > HARDLY * floor for before, floor in far)


def report_on(item: Laid, heard: Sequence[Heard]) -> Heard | None:
    """The report that shows the laboratory of an effect; of the master's, which all show, the first with a gap."""
    own = [one for one in heard if one.role == item.role]
    return next(iter(own or alarmed(heard)), None)


def alarmed(heard: Sequence[Heard]) -> list[Heard]:
    """The reports, those with a gap first."""
    return sorted(heard, key=lambda one: one.status in QUIET)


def consulted(case: Case, heard: Sequence[Heard]) -> list[Heard]:
    """The reports by which a case is judged: those on its effects, or all of a clean case."""
    found = [one for item in case.laid if (one := report_on(item, heard))]
    return [one for one in heard if one in found] if case.laid else alarmed(heard)


def status_of(case: Case, asked: Sequence[Heard]) -> str:
    """One status for the case: of several reports that of the first without a name; of a clean case the first alarm."""
    denied = [one.status for one in asked if case.laid and one.status not in NAMING]
    return next(iter([*denied, *(one.status for one in asked)]), "error")


def visible(case: Case, recorded: RecordedCase) -> list[Laid]:
    """The effects that are large enough to be found."""
    if case.inside:
        return []
    return [item for item, size in zip(case.laid, recorded.sizes, strict=False) if size >= VISIBLE]


def is_named(
    case: Case, status: str, heard: Sequence[Heard], names: CaseNames, asked_for: Sequence[Laid]
) -> bool:
    """Whether the verdict is true; of many mild effects only those that are large enough must be named."""
    if case.kind == "clean":
        return bool(heard) and all(is_quiet(case, one, names) for one in heard)
    if case.kind == "unknown":
        by_mechanism = bool(credited(case.laid, heard, names))
        return (status in UNKNOWN or by_mechanism) and not is_surely_wrong(case, heard, names)
    if case.inside and status in QUIET:
        return True
    wanted = asked_for if case.kind == "many" else case.laid
    return len(credited(wanted, heard, names)) == len(wanted)


def is_surely_wrong(case: Case, heard: Sequence[Heard], names: CaseNames) -> bool:
    """Whether a report on an unknown effect is sure of a name that is neither real nor the effect's mechanism."""
    right = {name for item in case.laid for name in truths(item, names)}
    return any(
        number(one.probability) >= SURE
        and not all(
            is_real(case, name, one, names) or any(same(true, name, one.sets) for true in right)
            for name in one.names
        )
        for one in consulted(case, heard)
    )


def is_quiet(case: Case, one: Heard, names: CaseNames) -> bool:
    """Whether a report has no gap, or only what is real besides hidden effects."""
    real = bool(one.names) and all(is_real(case, name, one, names) for name in one.names)
    return one.status in QUIET or real


def is_real(case: Case, name: str, one: Heard, names: CaseNames) -> bool:
    """Whether a name is a distortion by the case's logger, or moves parameters that are truly far off."""
    if is_distortion(case, name, names):
        return True
    if not case.normal or name not in names.placed:
        return False
    found = {key: number(item.value) for key, item in one.parameters.get(name, {}).items()}
    plan = plans.from_tables(case.plan, Path())
    return bool(found) and is_truly_off(case.truths, plan, names.placed[name], found, TWO_TOLERANCES)


def is_distortion(case: Case, name: str, names: CaseNames) -> bool:
    """Whether a name is a distortion by the case's logger."""
    return bool(case.logger) and names.faults.get(name) in LOGGERS[case.logger].distortions


def credited(wanted: Sequence[Laid], heard: Sequence[Heard], names: CaseNames) -> list[Laid]:
    """The most effects of these that the reports name, each name counting for one effect only.

    A single name in a set with two hidden effects is one of them. Source: Kuhn, The Hungarian method (1955).
    """
    chances = [names_of(item, heard, names) for item in wanted]
    taken: dict[tuple[str, str], int] = {}

    def finds(place: int, seen: set[tuple[str, str]]) -> bool:
        for name in chances[place]:
            if name not in seen:
                seen.add(name)
                if name not in taken or finds(taken[name], seen):
                    taken[name] = place
                    return True
        return False

    return [item for place, item in enumerate(wanted) if finds(place, set())]


def names_of(item: Laid, heard: Sequence[Heard], names: CaseNames) -> list[tuple[str, str]]:
    """The names that are right for an effect in the report on its laboratory, each with that report's role."""
    one = report_on(item, heard)
    if one is None:
        return []
    right = truths(item, names)
    return [(one.role, name) for name in one.names if any(same(true, name, one.sets) for true in right)]


def truths(item: Laid, names: CaseNames) -> set[str]:
    """Right names for an effect: its own, and the fault of the same reading that its formula resembles as much."""
    if item.name.startswith("opensees."):
        mechanism = MATERIALS[item.name.removeprefix("opensees.")].effects
        return {names.effect(replace(item, name=name)) for name in mechanism}
    if item.name.startswith("x."):
        return {names.effect(replace(item, name=name)) for name in (item.name, *mechanisms(item.name))}
    fault, site = AS_MUCH.get(item.formula), names.site(item)
    alike = {name for name, there in names.sites.items() if there == site and names.faults[name] == fault}
    return {names.effect(item)} | alike


def mechanisms(name: str) -> tuple[str, ...]:
    """The effects of the catalogue that are the mechanism of an effect of no catalogue."""
    from validation.blind.labs import ALIKE
    from validation.blind.labs.unlisted import every  # compiles kernels

    return every.EFFECTS[name].alike if name in every.EFFECTS else ALIKE.get(name, ())


def same(true: str, name: str, sets: Iterable[Collection[str]]) -> bool:
    """Whether a name is the true effect's, or that of an effect in the same set of equivalents."""
    return true == name or any(true in group and name in group for group in sets)


def right_sites(item: Laid, one: Heard, names: CaseNames) -> set[str]:
    """Right sites: the effect's own, and that of an equivalent effect that a report names instead."""
    right = truths(item, names)
    placed = [name for name in one.names if name in names.sites]
    named = [name for name in placed if any(same(true, name, one.sets) for true in right)]
    return {names.site(item)} | {names.sites[name] for name in named}


def estimates(case: Case, heard: Sequence[Heard], names: CaseNames) -> list[JudgedEstimate]:
    """The strength parameters of the true effects that the verdict itself names."""
    result = []
    for item in case.laid:
        one, true = report_on(item, heard), names.effect(item)
        if one is None or true not in one.parameters or is_distortion(case, true, names):
            continue
        result += [
            estimate(item, true, name, one.parameters[true].get(name))
            for name in item.nulls
            if name in item.parameters
        ]
    return result


def estimate(item: Laid, called: str, name: str, said: Value | None) -> JudgedEstimate:
    """One parameter; relative to its distance from the null value where that is finite."""
    from validation.blind.labs.meanings import as_in_catalogue  # compiles kernels

    null = item.nulls[name]
    true = as_in_catalogue(item.name, item.formula, name, item.parameters[name])
    value = number(said.value if said else None)
    miss = abs(value - true) if math.isfinite(value) else math.inf
    strength = abs(true - null) if math.isfinite(null) else abs(true)
    low, high = (said.interval if said else None) or (None, None)
    inside = None if low is None or high is None else low <= true <= high
    return JudgedEstimate(
        f"{called}.{name}", true, value, miss / strength, miss / abs(true) if true else miss, inside
    )


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
        reasons.append(f"reports {said}, not {wanted.get(outcome.kind, ' and '.join(outcome.truth))}")
    if outcome.truth and not outcome.located and outcome.status != "error":
        reasons.append(f"first site is {outcome.verdict_site or 'none'}, not {' or '.join(outcome.sites)}")
    if outcome.size < VISIBLE:
        reasons.append(f"residual to noise below {VISIBLE:g}")
    if outcome.stopped:
        reasons.append("the test was stopped by a limit")
    return "; ".join(reasons)
