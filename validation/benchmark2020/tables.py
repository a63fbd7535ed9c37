"""The tables of the benchmark as heads and rows of text, for the terminal and the page."""

from __future__ import annotations

import math

from report.text.formats import signed
from report.text.terminal import TitledTable
from validation.benchmark2020.criteria import MEANINGS
from validation.benchmark2020.evidence import SAMPLE, BenchmarkEvidence
from validation.benchmark2020.published import CRITICAL_DELAYS, TABLE_3
from validation.benchmark2020.runs import NOMINAL, on_el_centro

MISSING, UNSTABLE = "–", "unstable"


def tables(evidence: BenchmarkEvidence) -> list[TitledTable]:
    """All tables that have rows."""
    found = (
        table_3(evidence),
        compensators(evidence),
        by_motion(evidence),
        late(evidence),
        critical(evidence),
    )
    return [table for table in found if table.rows]


def table_3(evidence: BenchmarkEvidence) -> TitledTable:
    """The sample controller's 36 cells beside the published ones."""
    rows = []
    for item in on_el_centro(evidence.results, SAMPLE):
        theirs = cells(TABLE_3[item.case])
        rows.append([f"case {item.case}", "published", *theirs, MISSING, MISSING])
        if item.found is None:
            rows.append(["", "computed", *[UNSTABLE] * len(theirs), MISSING, MISSING])
            continue
        extra = [milliseconds(item.two_sided, 2), percent(item.noise_floor)]
        rows.append(["", "computed", *cells(item.found), *extra])
        apart = zip(item.found, TABLE_3[item.case], strict=True)
        differences = [signed((ours - old) * (1e2 if at else 1e3), 2) for at, (ours, old) in enumerate(apart)]
        rows.append(["", "deviation", *differences, MISSING, MISSING])
    head = [
        "",
        "",
        "J1, ms",
        *(f"{name}, %" for name in list(MEANINGS)[1:]),
        "two-sided, ms",
        "J2 of noise, %",
    ]
    return TitledTable("Table 3: sample controller, El Centro at 0.4", head, rows)


def cells(values: tuple[float, ...]) -> list[str]:
    """J1 in ms, the others in per cent."""
    return [milliseconds(values[0], 1), *map(percent, values[1:])]


def compensators(evidence: BenchmarkEvidence) -> TitledTable:
    """The worst results of every setting, the best setting first."""
    rows = [
        [
            item.setting,
            item.kind,
            percent(item.tracking),
            milliseconds(item.behind, 2),
            percent(item.nominal),
            percent(item.plants),
            f"{item.unstable} of {item.tests}",
            f"{item.force:.0f}" if math.isfinite(item.force) else MISSING,
        ]
        for item in sorted(evidence.summaries, key=lambda item: item.order)
    ]
    drawn = f"{evidence.plants} plant{'s' * (evidence.plants != 1)}"
    head = [
        "setting",
        "compensator",
        "J2, %",
        "delay, ms",
        "J4, %",
        "J4 of plants, %",
        "unstable",
        "force, N",
    ]
    return TitledTable(
        f"Compensators: worst of 4 cases × 3 motions, on the nominal plant and on {drawn} drawn",
        head,
        rows,
    )


def by_motion(evidence: BenchmarkEvidence) -> TitledTable:
    """J4 of every setting that is stable somewhere, on the nominal plant, by motion and case."""
    places = [(on.motion.title, on.case.number) for on in evidence.stages]
    found = {
        (item.setting, item.motion, item.case): item for item in evidence.results if item.plant == NOMINAL
    }
    rows = [
        [item.setting, *(percent(found[item.setting, motion, case].j4) for motion, case in places)]
        for item in sorted(evidence.summaries, key=lambda item: item.order)
        if any(found[item.setting, motion, case].stable for motion, case in places)
    ]
    return TitledTable("J4, %, of the nominal plant", ["setting", *(f"{m} C{c}" for m, c in places)], rows)


def late(evidence: BenchmarkEvidence) -> TitledTable:
    """The criteria and the indicator of the force path where the force arrives late."""
    rows = []
    for item in evidence.late:
        found, path = item.result.found, item.path
        start = [f"case {item.result.case}", f"{item.delay * 1e3:g}"]
        if found is None:
            rows.append([*start, *[UNSTABLE] * 3, MISSING, MISSING])
            continue
        rows.append(
            [
                *start,
                milliseconds(found.j1, 2),
                percent(found.j2),
                percent(found.j4),
                milliseconds(path.delay, 2) if path else MISSING,
                milliseconds(0.5 * (path.interval[1] - path.interval[0]), 2) if path else MISSING,
            ]
        )
    head = ["", "force late by, ms", "J1, ms", "J2, %", "J4, %", "force path, ms", "± (95 %), ms"]
    return TitledTable("A late force (amb, El Centro): J1 and J2 do not show it", head, rows)


def critical(evidence: BenchmarkEvidence) -> TitledTable:
    """Critical delays by search, by equation, and as published."""
    rows = [
        [
            f"case {item.case}",
            milliseconds(item.searched, 2),
            milliseconds(item.equation, 2),
            milliseconds(CRITICAL_DELAYS[item.case], 2),
        ]
        for item in evidence.critical
    ]
    head = ["", "by search, ms", "by the characteristic equation, ms", "published, ms"]
    return TitledTable("Critical delays of the force", head, rows)


def percent(value: float) -> str:
    """A share in per cent."""
    if math.isnan(value):
        return MISSING
    return f"{value * 1e2:.1f}" if math.isfinite(value) else UNSTABLE


def milliseconds(value: float, digits: int) -> str:
    """A time in ms."""
    return MISSING if math.isnan(value) else f"{value * 1e3:.{digits}f}"
