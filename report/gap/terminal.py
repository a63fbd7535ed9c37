"""The summary of a diagnosis on the terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from diagnosis.report.records import Report
from report.gap import wording
from report.text.formats import as_float, blocks, percent, percent_interval, probability, span, times

WIDTH = 100  # columns of the summary, which a usual terminal window has
LABEL = 12  # columns of the labels on the left
NAME = 22  # least columns of the name of a signal or a site
BAR = 16  # columns of a bar
FIRST = 4  # lines of the foremost candidate
MOST = 25  # lines of the summary: one screen
UNBROKEN = "\u00a0%"


def summary(report: Report) -> str:
    """The summary as text of at most 25 lines."""
    lines = [
        *verdict(report),
        *gap(report),
        *where(report),
        *row("force path", wording.force_path(report), 2),
        *which(report),
        *how_far(report),
        *tolerances(report),
        *equivalents(report),
        *not_exercised(report),
        *row("next test", report.next_test or "", 2),
    ]
    return "\n".join([*lines, *warnings(report, MOST - len(lines))][:MOST])


def row(label: str, text: str, most: int = 1) -> list[str]:
    """A labelled text of at most this many lines; nothing where there is no text."""
    if not text:
        return []
    lines = textwrap.wrap(
        text.replace(" %", UNBROKEN),  # a number and its sign stay on one line
        WIDTH - LABEL,
        max_lines=most,
        placeholder=" …",
        break_long_words=True,
        break_on_hyphens=False,
    )
    return [
        (label if place == 0 else "").ljust(LABEL) + line.replace(UNBROKEN, " %")
        for place, line in enumerate(lines)
    ]


def rows(label: str, texts: Sequence[str]) -> list[str]:
    """One line per text, the label before the first."""
    return [(label if place == 0 else "").ljust(LABEL) + text for place, text in enumerate(texts) if text]


def verdict(report: Report) -> list[str]:
    """Status and sentence."""
    text = f"{wording.STATUS[report.status].upper()}: {wording.verdict(report)}"
    return textwrap.wrap(text, WIDTH, max_lines=3, placeholder=" …")


def gap(report: Report) -> list[str]:
    """Overall gap and the signals farthest above their noise, each beside its floor."""
    entries = [("overall", report.gap.overall, report.gap.overall_noise_floor)]
    entries += [
        (wording.plain(name), item.nrmse, item.noise_floor) for name, item in wording.by_floor(report)[:4]
    ]
    width = max(NAME, *(len(name) for name, _, _ in entries))
    lines = [
        f"{name:<{width}} {percent(value):>7}   noise floor {percent(floor)}"
        for name, value, floor in entries
        if value is not None
    ]
    return rows("gap", lines or ["not determined"])


def where(report: Report) -> list[str]:
    """The foremost sites with their shares."""
    lines = []
    width = max([NAME, *(len(wording.site(item.site)) for item in report.where[:3])])
    for item in report.where[:3]:
        facts = [f"{times(item.residual_to_noise)} noise" if item.residual_to_noise is not None else ""]
        facts += [span(window, "s") for window in item.when[:2]]
        facts.append(span(item.frequency_band, "Hz"))
        interval = percent_interval(item.share_interval)
        head = f"{wording.site(item.site):<{width}} {blocks(item.share or 0.0, BAR)} {percent(item.share)}"
        lines.append(
            head + (f" ({interval})" if interval else "") + "".join(f"  {fact}" for fact in facts if fact)
        )
    return rows(
        "where", lines or ["no site has a gap beyond its noise" if placed(report) else "not determined"]
    )


def placed(report: Report) -> bool:
    """Whether an empty list of sites means that there is no gap."""
    return report.status in wording.QUIET


def which(report: Report) -> list[str]:
    """The foremost candidates with probability and parameters."""
    lines: list[str] = []
    if report.status == "not_enough_data":
        return row("which", "not determined")
    for place, item in enumerate(wording.ranked(report.which)[:3]):
        # the law says what the other parameters mean, and must not be cut off
        order = list(item.parameters)
        found = sorted(wording.parameters(item), key=lambda one: (order.index(one[0]), one[1] != "law"))
        several = len(item.effects) > 1
        texts = [setting(*each, several=several) for each in found]
        head = f"{probability(item.probability):>6}  {wording.candidate(item.effects, report.status)}"
        text = head + (": " + ", ".join(texts) if texts else "")
        lines += textwrap.wrap(
            text,
            WIDTH - LABEL,
            max_lines=2 if place else FIRST,
            placeholder=" …",
            subsequent_indent=" " * 8,
            drop_whitespace=True,
            initial_indent="",
        )
    return rows("which", lines) if lines else row("which", "no effect of the catalogue is named")


def setting(name: str, parameter: str, value: str, *, several: bool) -> str:
    """A parameter's value behind the names of a candidate's effects, with its own effect where they are `several`."""
    own = wording.effect(name) if several else ""
    return " ".join(filter(None, (own, wording.called(name, parameter), value)))


def how_far(report: Report) -> list[str]:
    """Gap before and after, the closed share, and what it was judged on."""
    found = report.how_far
    if found.before is None or found.after is None:
        return row("how far", "not determined")
    before, after = percent(found.before), percent(found.after)
    verb = "falls" if found.after < found.before else "goes"
    text = f"{wording.judged_on(report)}, the gap {verb} from {before} to {after} "
    text += f"(noise {percent(found.noise_floor)})"
    closed = wording.closed(report)
    text += f"; closed {closed}" if closed else ""
    nominal = wording.nominal_gap(report)
    if nominal is not None and percent(nominal) != before:
        text += f"; {percent(nominal)} before parameters were moved"
    return [*row("how far", f"{text}.", 3), *row("learned", wording.learned(report), 3)]


def tolerances(report: Report) -> list[str]:
    """Parameters that moved notably inside their tolerances."""
    moved = [
        f"{name} ×{as_float(item.factor):.4g} (z {as_float(item.z):+.1f})"
        for name, item in wording.notable(report)
    ]
    return row("tolerances", ", ".join(moved[:4]) + (f", {len(moved) - 4} more" if len(moved) > 4 else ""), 2)


def equivalents(report: Report) -> list[str]:
    """Sentences on effects that these signals cannot separate."""
    found = wording.sets(report)
    return row("equivalent", " ".join(map(wording.equivalent, found)), 2)


def not_exercised(report: Report) -> list[str]:
    """Effects that the recording could not have shown."""
    names = list(dict.fromkeys(map(wording.effect, report.not_exercised)))
    return row("not shown", f"this motion could not have shown: {', '.join(names)}" if names else "", 2)


def warnings(report: Report, most: int) -> list[str]:
    """As many of the warnings as go whole into so many lines, the first one cut where it alone does not.

    What a reader should do stands at the end of a warning.
    """
    lines, left = list[str](), len(report.warnings)
    for text in report.warnings:
        others = 1 if left > 1 else 0  # the line that counts them
        whole = row("warning", text, max(1, most - others if not lines else MOST))
        if lines and len(lines) + len(whole) + others > most:
            break
        lines, left = [*lines, *whole], left - 1
    return [*lines, " " * LABEL + f"{left} more in the report"] if left else lines
