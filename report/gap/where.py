"""Where the gap arises: the rig coloured by share, and the residual over time, frequency and amplitude."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from report.gap import pictures, wording
from report.gap.blocks import absent, bar, esc, figure, gallery, heading, paragraph, section, table
from report.gap.rig import rig
from report.gap.wording import Report
from report.text.formats import MISSING, percent, percent_interval, span, times

MOST_PARTS = 4
MOST_WINDOWS = 4


def where(report: Report) -> str:
    """The section."""
    details = report.get("details") or {}
    caption = "The rig: sites coloured by their share of the gap; small circles are sensors."
    diagram = f"<figure>{rig(report)}<figcaption>{esc(caption)}</figcaption></figure>"
    return section(
        "where",
        "Where",
        f'<div class="beside">{diagram}<div>{sites(report)}</div></div>',
        residuals(details),
        loop_shares(details),
        ceiling(details),
    )


def sites(report: Report) -> str:
    """The sites with a gap."""
    rows = [
        [
            f"<b>{esc(wording.site(str(item['site'])))}</b>",
            bar(item.get("share"))
            + f'<small class="block">{esc(percent_interval(item.get("share_interval")))}</small>',
            esc(times(item.get("residual_to_noise"))),
            windows(item),
            f'<span class="whole">{esc(span(item.get("frequency_band"), "Hz") or MISSING)}</span>',
        ]
        for item in report.get("where") or []
    ]
    if not rows and report.get("status") == "no_gap":
        return absent("No part leaves a residual above its noise: there is nothing to place.")
    if not rows:
        return absent(
            "The gap could not be placed, because the recording holds input and output together of no part that "
            "has a gap."
        )
    return table(("site", "share of the gap", "residual / noise", "when", "frequencies"), rows)


def windows(item: Mapping[str, Any]) -> str:
    """The first windows of time in which a site shows a gap."""
    found = [span(window, "s") for window in (item.get("when") or [])[:MOST_WINDOWS]]
    return "<br>".join(f'<span class="whole">{esc(text)}</span>' for text in found if text) or MISSING


def residuals(details: Mapping[str, Any]) -> str:
    """Pictures of what each part's model leaves over when it is fed the recorded input."""
    parts = list(details.get("parts") or [])
    if not parts:
        return absent("Residuals of single parts are not in this report.")
    names = ", ".join(wording.site(str(part.get("site"))) for part in parts)
    drawn = [
        figure(
            pictures.residual_time(parts), "Residual of each part over time, in multiples of its noise floor."
        ),
        figure(pictures.residual_amplitude(parts), "Residual against the amplitude of the motion."),
    ]
    for part in parts[:MOST_PARTS]:
        name = wording.site(str(part.get("site")))
        drawn.append(figure(pictures.residual_frequency(part), f"Residual of the {name} over frequency."))
    text = (
        "Each part's nominal model is driven by the recorded input; the residual is the recorded output minus its "
        f"prediction. Parts with input and output recorded: {names}."
    )
    missing = (
        absent("Their residuals over time and frequency are not in this report.") if not any(drawn) else ""
    )
    return heading("Residuals, part by part") + paragraph(text) + gallery(drawn) + missing


def loop_shares(details: Mapping[str, Any]) -> str:
    """What each site adds to the gap of the closed loop."""
    rows = [
        [
            esc(wording.site(str(item.get("site")))),
            bar(item.get("shapley")),
            esc(percent_interval(item.get("interval")) or MISSING),
            esc(percent(item.get("first_in"))),
            esc(percent(item.get("last_out"))),
        ]
        for item in details.get("loop_shares") or []
    ]
    if not rows:
        return ""
    text = (
        "In the closed loop a fault spreads to every signal. These shares come from correcting the sites one by one in "
        "every order; “alone” corrects only this site, “last” corrects it after all others."
    )
    head = ("site", "share of the loop's gap", "interval", "alone", "last")
    return heading("Shares in the closed loop") + paragraph(text) + table(head, rows)


def ceiling(details: Mapping[str, Any]) -> str:
    """How much of the residual the catalogue explains beside a model that may be anything."""
    rows = [
        [esc(wording.site(str(item.get("site")))), bar(item.get("flexible")), bar(item.get("catalogue"))]
        for item in details.get("ceiling") or []
    ]
    if not rows:
        return ""
    text = (
        "Share of the residual's energy that is explained on data not used for the fit. Where a flexible model "
        "explains much more than the catalogue, something is at work that the catalogue lacks."
    )
    head = ("site", "by a flexible model", "by the catalogue's best effects")
    return heading("What could be explained at all") + paragraph(text) + table(head, rows)
