"""A run as one HTML page."""

from __future__ import annotations

from common.lab.preflight import ACCEPTED, LINK, PASSED, SENSORS
from common.recording.run import Run
from report.facts.machine import own_plan
from report.page import frame, render
from report.run import tables, verdict
from report.run.drawing import Pictures
from report.run.verdict import Summary
from report.text import formats

BEFORE = (PASSED, SENSORS, LINK, ACCEPTED)


def page(run: Run, summary: Summary, drawn: Pictures, left_out: dict[str, str]) -> str:
    """The page's text; `summary` is that of `rths inspect`."""
    body = render(
        "run.html",
        test=summary["test"],
        lost=verdict.lost(summary),
        facts=tables.facts(run, summary),
        sentences=verdict.sentences(run, summary),
        pictures=[(tables.slave_title(role), several) for role, several in drawn.items() if several],
        left_out=left_out,
        completeness=tables.completeness(summary),
        peaks=tables.peaks(summary),
        storeys=tables.storeys(summary),
        modes=formats.modes(summary["modes"]),
        limits=tables.limits(verdict.margins(run, summary)),
        tracking=tables.tracking(summary),
        force_path=tables.force_path(summary),
        latency=tables.latency(summary),
        exchange=tables.exchange(summary),
        rejected=tables.rejected(summary),
        machines=tables.machines(run),
        calibration=tables.calibration(run),
        preflight=tables.events(run, *BEFORE),
        events=tables.events(run),
        plan=own_plan(run),
        provenance=tables.provenance(run, summary),
        kept=tables.kept(run),
    )
    return frame(f"Test report: {summary['test']}", body)
