"""How far the gap closes: the waterfall, the worst seconds, the paths of the loop, the tolerances."""

from __future__ import annotations

from report.gap import pictures, wording
from report.gap.blocks import absent, bar, esc, figure, gallery, paragraph, section, table
from report.gap.wording import Report
from report.text.formats import MISSING, as_float, known, percent, quantity, signed, times

PATHS = {"command": "command path", "force": "force path", "exchange": "exchange with the other lab"}
MOST_HISTORIES = 4


def how_far(report: Report) -> str:
    """The section."""
    details = report.get("details") or {}
    drawn = [
        figure(
            pictures.waterfall(details.get("waterfall") or []),
            "The overall gap, step by step down to the noise floor.",
        )
    ]
    drawn += [
        figure(
            pictures.history(item),
            f"{wording.plain(str(item.get('signal'))).capitalize()} at its worst seconds, closed loop.",
        )
        for item in (details.get("histories") or [])[:MOST_HISTORIES]
    ]
    missing = absent("Steps and time histories before and after are not in this report.")
    return section("how-far", "How far", numbers(report), gallery(drawn) or missing, remaining(report))


def numbers(report: Report) -> str:
    """Before, after, closed, floor."""
    far = report.get("how_far") or {}
    if not known(far.get("before")) or not known(far.get("after")):
        return absent("How far the gap closes was not determined.")
    rows = [
        ["nominal models", esc(percent(wording.nominal_gap(report)))],
        ["parameters moved inside their tolerances (before)", esc(percent(far["before"]))],
        ["with the effects named (after)", f"<b>{esc(percent(far['after']))}</b>"],
        ["noise floor", esc(percent(far.get("noise_floor")))],
    ]
    closed = wording.closed(report)
    rows += [["closed, of the gap above the noise", bar(far.get("closed"), closed)]] if closed else []
    kept = rows if known(wording.nominal_gap(report)) else rows[1:]
    judged = f"{wording.judged_on(report)}." if far.get("judged_on") else ""
    return table(("", "overall gap"), kept) + paragraph(judged, "note")


def remaining(report: Report) -> str:
    """What is left and where."""
    found = (report.get("details") or {}).get("remaining") or {}
    if not found:
        return ""
    sites = [
        f"{wording.site(str(item.get('site')))} {times(item.get('residual_to_noise'))} its noise"
        for item in found.get("where") or []
    ]
    place = f", at: {', '.join(sites)}" if sites else ""
    return paragraph(f"What remains: {percent(found.get('overall'))} overall{place}.")


def paths(report: Report) -> str:
    """Delay and damping equivalents of the loop's paths."""
    found = (report.get("details") or {}).get("paths") or {}
    rows = [
        [
            esc(PATHS.get(name, name)),
            esc(quantity(item.get("delay"), "s")),
            esc(quantity(item.get("nominal_delay"), "s")),
            esc(gain(item.get("amplitude"))),
            esc(points(item.get("damping_points"))),
            esc(points(item.get("nominal_damping_points"))),
        ]
        for name, item in found.items()
    ]
    text = (
        "What each path does to the loop, put as a delay, a gain and as damping that it adds (+) or takes (−), in "
        "percentage points of critical damping."
    )
    head = ("path", "delay", "nominal", "gain", "damping, points", "nominal")
    content = (
        paragraph(text) + table(head, rows) if rows else absent("The paths' delays are not in this report.")
    )
    force = wording.force_path(report)
    beside = f"{force} No index of tracking shows this, because tracking compares displacements."
    return section("paths", "Paths of the loop", content, paragraph(beside) if force else "")


def gain(value: object) -> str:
    """A ratio of amplitudes."""
    return f"{as_float(value):.3f}" if known(value) else MISSING


def points(value: object) -> str:
    """Points of damping with their sign."""
    return signed(as_float(value), 2) if known(value) else MISSING


def tolerances(report: Report) -> str:
    """Nominal parameters moved inside their tolerances."""
    entries = wording.by_move(report)
    if not entries:
        return section("tolerances", "Tolerances", absent("No nominal parameter was moved."))
    rows = [
        [
            f"<code>{esc(name)}</code>",
            esc(f"{as_float(item.get('factor')):.4f}" if known(item.get("factor")) else MISSING),
            esc(points(item.get("z"))),
            "notable" if abs(item.get("z") or 0.0) > wording.NOTABLE else "",
        ]
        for name, item in entries
    ]
    text = (
        "No laboratory is known exactly: these moves of nominal parameters are commissioning, not unmodelled "
        "effects. z counts standard deviations of the tolerance; beyond ±1 a move deserves a look."
    )
    picture = figure(pictures.tolerance_moves(entries), "Moves of the nominal parameters.")
    moved = table(("parameter", "factor", "z", ""), rows)
    return section(
        "tolerances", "Tolerances", paragraph(text), f'<div class="beside">{picture}<div>{moved}</div></div>'
    )
