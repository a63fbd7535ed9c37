"""A diagnosis as one HTML page, readable without network, on a phone and on paper."""

from __future__ import annotations

from typing import Any

from diagnosis.report.records import Report
from report.gap import how_far, limits, overview, where, which, wording
from report.gap.rig import rig
from report.page import frame, render


def page(report: Report) -> str:
    """The page's text; pictures stand inside."""
    name = report.details.test.name
    body = render(
        "gap.html",
        status=report.status,
        status_text=wording.STATUS[report.status],
        verdict=wording.verdict(report),
        tiles=overview.tiles(report),
        facts=overview.facts(report),
        overall=overview.overall(report),
        signals=overview.signals(report),
        **placed(report),
        **named(report),
        **shrunk(report),
        equivalents=limits.equivalents(report),
        not_exercised=limits.not_exercised(report),
        next_test=report.next_test,
        tests=limits.tests(report),
        warnings=report.warnings,
        glossary=limits.GLOSSARY,
    )
    return frame("Sim-to-real gap" + (f": {name}" if name else ""), body)


def placed(report: Report) -> dict[str, Any]:
    """What the section on where the gap lies takes."""
    return {
        "rig": rig(report),
        "sites": where.sites(report),
        "unplaced": where.unplaced(report),
        "parts": where.parts(report),
        "residuals": where.residuals(report),
        "loop_shares": where.loop_shares(report),
        "ceiling": where.ceiling(report),
    }


def named(report: Report) -> dict[str, Any]:
    """What the section on effects takes."""
    details = report.details
    strange = details.unknowns or ((details.unknown,) if details.unknown else ())
    return {
        "kinds": which.kinds(report),
        "nothing": which.nothing(report),
        "unknowns": [which.unknown(one, static=details.test.static) for one in strange],
        "learned": which.learned(report),
        "learned_text": wording.learned(report),
        "predictions": which.predictions(report),
        "curves": which.curves(report),
    }


def shrunk(report: Report) -> dict[str, Any]:
    """What the sections on how far the gap closes, on paths and tolerances take."""
    return {
        "numbers": how_far.numbers(report),
        "judged_on": wording.judged_on(report) if report.how_far.judged_on else "",
        "steps": how_far.steps(report),
        "remaining": how_far.remaining(report),
        "made_of": how_far.made_of(report),
        "noises": how_far.noises(report),
        "paths": how_far.paths(report),
        "force_path": wording.force_path(report),
        "tolerances": how_far.tolerances(report),
        "moves": how_far.moves(report),
    }
