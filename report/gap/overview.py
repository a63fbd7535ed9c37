"""The page's head: the verdict in a sentence, its numbers, and the gap of every signal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from report.gap import wording
from report.gap.blocks import absent, bar, esc, paragraph, section, table
from report.gap.wording import Report
from report.text.formats import MISSING, as_float, known, percent, probability, quantity, times


def overview(report: Report) -> str:
    """Verdict, tiles and the test's facts."""
    status = str(report.get("status"))
    chip = f'<span class="chip {esc(status)}">{esc(wording.STATUS.get(status, status))}</span>'
    return (
        f"<header><h1>Sim-to-real gap {chip}</h1>"
        f'<p class="verdict">{esc(wording.verdict(report))}</p>{tiles(report)}{facts(report)}</header>\n'
    )


def tiles(report: Report) -> str:
    """The few numbers that matter most."""
    gap, far = report.get("gap") or {}, report.get("how_far") or {}
    found = [
        ("gap", percent(gap.get("overall")), f"noise floor {percent(gap.get('overall_noise_floor'))}"),
        place(report),
        cause(report),
        ("left after", percent(far.get("after")), closed(report)),
    ]
    cells = [
        f"<div><dt>{esc(name)}</dt><dd>{esc(value)}</dd><small>{esc(note)}</small></div>"
        for name, value, note in found
    ]
    return f'<dl class="tiles">{"".join(cells)}</dl>'


def place(report: Report) -> tuple[str, str, str]:
    """The foremost site."""
    if not report.get("where"):
        return "where", MISSING, "no site" if report.get("status") == "no_gap" else "not determined"
    first = report["where"][0]
    return "where", wording.site(str(first["site"])), f"{percent(first.get('share'))} of the gap"


def cause(report: Report) -> tuple[str, str, str]:
    """The foremost candidate."""
    if not report.get("which"):
        return "which", MISSING, "nothing named"
    first = report["which"][0]
    return (
        "which",
        wording.effects(first.get("effects") or []),
        f"probability {probability(first.get('probability'))}",
    )


def closed(report: Report) -> str:
    """How much of the gap closes."""
    share = wording.closed(report)
    if share:
        return f"closed {share}"
    return "nothing to close" if report.get("status") == "no_gap" else "not determined"


def facts(report: Report) -> str:
    """What was tested, in a line."""
    test = (report.get("details") or {}).get("test") or {}
    found = [str(test[key]) for key in ("name", "motion", "file") if test.get(key)]
    if known(test.get("duration")):
        found.append(f"{as_float(test['duration']):g} s")
    if known(test.get("interval")):
        found.append(f"interval {quantity(test['interval'], 's')}")
    if known(test.get("ticks")):
        found.append(f"{test['ticks']} ticks")
    if test.get("outcome"):
        found.append(f"outcome: {test['outcome']}")
    return paragraph(" · ".join(found), "facts")


def ratio(item: Mapping[str, Any]) -> str:
    """A signal's gap over its noise floor."""
    whole = known(item.get("nrmse")) and known(item.get("noise_floor"))
    return times(wording.above_floor(item)) if whole else MISSING


def gap(report: Report) -> str:
    """Every signal's gap beside its noise floor."""
    found = report.get("gap") or {}
    signals = sorted((found.get("signals") or {}).items(), key=lambda item: -wording.above_floor(item[1]))
    if not signals:
        return section("gap", "The gap", absent("The recording holds no signal that a simulation predicts."))
    top = max(
        [as_float(item.get("nrmse")) for _name, item in signals if known(item.get("nrmse"))], default=1.0
    )
    rows = [
        [
            esc(wording.plain(name)),
            bar(as_float(item.get("nrmse")) / (top or 1.0), percent(item.get("nrmse"))),
            esc(percent(item.get("noise_floor"))),
            ratio(item),
            esc(quantity(item.get("peak_error"), str(item.get("unit") or ""))),
        ]
        for name, item in signals
    ]
    head = ("signal", "gap (rms error / rms recorded)", "noise floor", "gap / floor", "largest error")
    overall = (
        f"Overall {percent(found.get('overall'))}, noise floor {percent(found.get('overall_noise_floor'))}: "
        "recorded against the simulation with nominal models."
    )
    return section(
        "gap", "The gap", paragraph(overall if known(found.get("overall")) else ""), table(head, rows)
    )
