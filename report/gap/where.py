"""Where the gap arises: the sites, and the residual over time, frequency and amplitude."""

from __future__ import annotations

from diagnosis.report.records import Place, Report
from report import page
from report.gap import pictures, wording
from report.gap.blocks import Drawing, Rows, bar, drawings, lines, strong
from report.text.formats import MISSING, percent, percent_interval, span, times

MOST_PARTS = 4  # pictures of residuals over frequency: two rows of the page
MOST_WINDOWS = 4  # windows of time in a cell of the table


def sites(report: Report) -> Rows:
    """The sites with a gap; when, and at which frequencies, only where times have a meaning."""
    static = report.details.test.static
    rows = [
        [
            strong(wording.site(item.site)),
            page.block("share", bar(item.share), percent_interval(item.share_interval)),
            times(item.residual_to_noise),
            *([] if static else [windows(item), lines([span(item.frequency_band, "Hz") or MISSING])]),
        ]
        for item in report.where
    ]
    over = () if static else ("when", "frequencies")
    return Rows(("site", "share of the gap", "residual / noise", *over), rows)


def unplaced(report: Report) -> str:
    """The sentence on why no site is listed."""
    if report.status in wording.QUIET:
        return "No part leaves a residual above its noise, so that there is no gap to locate."
    return (
        "The gap could not be located, because the recording does not hold both input and output of any part with "
        "a gap."
    )


def windows(item: Place) -> str:
    """The first windows of time in which a site shows a gap."""
    found = [text for text in (span(window, "s") for window in item.when[:MOST_WINDOWS]) if text]
    return lines(found) if found else MISSING


def parts(report: Report) -> str:
    """The names of the parts with residuals."""
    return ", ".join(wording.site(part.site) for part in report.details.parts)


def residuals(report: Report) -> list[Drawing]:
    """Pictures of what each part's model leaves over when it is fed the recorded input."""
    found = report.details.parts
    return drawings(
        (
            pictures.residual_time(found),
            "Residual of each part over time, in multiples of its noise floor.",
        ),
        (pictures.residual_amplitude(found), "Residual against the amplitude of the motion."),
        *(
            (
                pictures.residual_frequency(part),
                f"Residual of the {wording.site(part.site)} over frequency.",
            )
            for part in found[:MOST_PARTS]
        ),
    )


def loop_shares(report: Report) -> Rows:
    """What each site adds to the gap of the closed loop."""
    rows = [
        [
            wording.site(item.site),
            bar(item.shapley),
            percent_interval(item.interval) or MISSING,
            percent(item.first_in),
            percent(item.last_out),
        ]
        for item in report.details.loop_shares
    ]
    return Rows(("site", "share of the loop's gap", "interval", "alone", "last"), rows)


def ceiling(report: Report) -> Rows:
    """The share of the residual that a flexible model explains, beside that of the catalogue's best effects."""
    rows = [
        [wording.site(item.site), bar(item.flexible), bar(item.catalogue)] for item in report.details.ceiling
    ]
    return Rows(("site", "by a flexible model", "by the catalogue's best effects"), rows)
