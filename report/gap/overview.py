"""The page's head: its numbers, the test's facts, and the gap of every signal."""

from __future__ import annotations

from diagnosis.report.records import Report, SignalGap
from report.gap import wording
from report.gap.blocks import Rows, bar
from report.text.formats import MISSING, known, percent, probability, quantity, times

HEAD = ("signal", "gap (rms error / rms recorded)", "noise floor", "gap / floor", "largest error")


def tiles(report: Report) -> list[tuple[str, str, str]]:
    """The few numbers that matter most: name, value, note."""
    gap = report.gap
    return [
        ("gap", percent(gap.overall), f"noise floor {percent(gap.overall_noise_floor)}"),
        ("where", *place(report)),
        ("which", *cause(report)),
        ("left after", percent(report.how_far.after), closed(report)),
    ]


def place(report: Report) -> tuple[str, str]:
    """The site with the largest share of the gap."""
    if not report.where:
        return MISSING, "no site" if report.status in wording.QUIET else "not determined"
    first = report.where[0]
    return wording.site(first.site), f"{percent(first.share)} of the gap"


def cause(report: Report) -> tuple[str, str]:
    """The first candidate."""
    if not report.which:
        return MISSING, "nothing named"
    first = report.which[0]
    return wording.candidate(first.effects, report.status), f"probability {probability(first.probability)}"


def closed(report: Report) -> str:
    """How much of the gap closes."""
    share = wording.closed(report)
    if share:
        return f"closed {share}"
    return "nothing to close" if report.status in wording.QUIET else "not determined"


def facts(report: Report) -> str:
    """What was tested, in a line."""
    test = report.details.test
    found = [text for text in (test.name, test.motion, test.file) if text]
    if test.duration is not None:
        found.append(f"{test.duration:g} s")
    if test.interval is not None:
        found.append(f"interval {quantity(test.interval, 's')}")
    if test.ticks is not None:
        found.append(f"{test.ticks} {'rows' if test.static else 'ticks'}")
    if test.outcome:
        found.append(f"outcome: {test.outcome}")
    return " · ".join(found)


def overall(report: Report) -> str:
    """The gap over all response signals, in a sentence."""
    gap = report.gap
    if gap.overall is None:
        return ""
    return (
        f"Overall {percent(gap.overall)}, noise floor {percent(gap.overall_noise_floor)}: "
        "recorded against the simulation with nominal models."
    )


def signals(report: Report) -> Rows:
    """Every signal's gap beside its noise floor."""
    found = wording.by_floor(report)
    top = max((item.nrmse for _name, item in found if item.nrmse is not None), default=1.0) or 1.0
    rows = [
        [
            wording.plain(name),
            bar(None if item.nrmse is None else item.nrmse / top, percent(item.nrmse)),
            percent(item.noise_floor),
            ratio(item),
            quantity(item.peak_error, item.unit),
        ]
        for name, item in found
    ]
    return Rows(HEAD, rows)


def ratio(item: SignalGap) -> str:
    """A signal's gap over its noise floor."""
    whole = known(item.nrmse) and known(item.noise_floor)
    return times(wording.above_floor(item)) if whole else MISSING
