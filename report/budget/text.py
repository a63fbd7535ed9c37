"""A judged recording as text."""

from __future__ import annotations

import io

from common.terminal.printable import shown
from report.budget.checks import DOUBT, OVER, BudgetCheck
from report.budget.limits import PERCENTILES
from report.budget.verdict import NOT_JUDGED, WITHIN, BudgetReport, counts, percentiles
from report.facts.circumstances import NO_LATENCY
from report.text.formats import percent
from report.text.terminal import table

ENDS = {
    WITHIN: "within the budget",
    OVER: "over the budget",
    NOT_JUDGED: "not judged, because the machine may have caused it",
}


def text(report: BudgetReport) -> str:
    """Figures, checks, remarks and verdict for a terminal; one sentence for a test in virtual time that is within."""
    if report.figures.virtual and report.status == WITHIN:
        return shown(unmeasured(report)) + "\n"
    stream = io.StringIO()
    found = report.figures
    stream.write(
        shown(f"{found.recording}: {ticks(report)} against the budget {report.budget.name}") + "\n\n"
    )
    table(figure_rows(report), stream)
    stream.write("\n")
    table(check_rows(report.checks), stream)
    stream.write(f"\n{late(report)}\n")
    for lab in sorted({*found.stolen, *found.schedulers}):
        stolen = found.stolen.get(lab)
        facts = [f"scheduler {found.schedulers[lab]}"] if lab in found.schedulers else []
        facts += (
            [f"{percent(stolen, 2)} of the processors' time taken by the host"] if stolen is not None else []
        )
        stream.write(shown(f"{lab}: {', '.join(facts)}") + "\n")
    for line in [*report.warnings, *report.doubts]:
        stream.write(f"{shown(line)}\n")
    stream.write(f"{shown(verdict(report))}\n")
    return stream.getvalue()


def unmeasured(report: BudgetReport) -> str:
    """The sentence on a recording in virtual time, whose latency was not measured."""
    return (
        f"{NO_LATENCY}; by the interval and the link's model alone {report.figures.recording} "
        f"({ticks(report)}) is {ENDS[WITHIN]} {report.budget.name}."
    )


def verdict(report: BudgetReport) -> str:
    """The verdict in one line, with what is over, else in doubt."""
    wanted = OVER if report.status == OVER else DOUBT
    named = [check.name for check in report.checks if check.verdict == wanted]
    return ENDS[report.status] + (f": {', '.join(named)}" if named else "")


def ticks(report: BudgetReport) -> str:
    """How many ticks were judged."""
    return ", ".join(item.label(f"{item.ticks} ticks") for item in report.figures.exchanges)


def figure_rows(report: BudgetReport) -> list[list[str]]:
    """Percentiles of the segments and of the bare loop, µs."""
    columns = [*PERCENTILES, "max"]
    rows = [["latency, µs", *columns]]
    for item in report.figures.exchanges:
        rows += [[name, *micro(row[key] for key in columns)] for name, row in percentiles(item).items()]
    bare = report.figures.bare
    if bare is not None:
        rows.append(["bare loop", *micro([*(bare.percentiles[name] for name in PERCENTILES), bare.most])])
    return rows


def micro(values: object) -> list[str]:
    """Times (s) in µs."""
    return [f"{value * 1e6:.0f}" for value in values]  # type: ignore[attr-defined]


def check_rows(checks: list[BudgetCheck]) -> list[list[str]]:
    """The checks."""
    rows = [["check", "value", "bare loop", "limit", "allowed", ""]]
    for check in checks:
        bare = "–" if check.bare is None else amount(check.bare, check.unit)
        limits = [amount(value, check.unit) for value in (check.limit, check.allowed)]
        rows.append([check.name, amount(check.value, check.unit), bare, *limits, check.verdict])
    return rows


def amount(value: float, unit: str) -> str:
    """A value in the unit of the table: µs, %, ticks."""
    if unit == "s":
        return f"{value * 1e6:.0f} µs"
    if unit == "share":
        return percent(value, 2)
    return f"{value:g} tick{'s' * (value != 1)}"


def late(report: BudgetReport) -> str:
    """Late ticks of the test and of the bare loop, a line."""
    parts = []
    for item in report.figures.exchanges:
        found = counts(item)
        if "late" in found:
            parts.append(item.label(f"late ticks: {found['late']} of {item.ticks}"))
    bare = report.figures.bare
    parts.append(f"bare loop: {bare.late} of {bare.ticks + bare.late}" if bare else "no bare loop recorded")
    return "; ".join(parts)
