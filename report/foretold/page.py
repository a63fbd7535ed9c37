"""A prediction as one HTML page."""

from __future__ import annotations

from report.foretold import pictures, tables
from report.page import frame, render
from simulation.foretold.bands import Prediction

SAID = (
    "Each of the laboratories drawn has parameters as sure as the diagnosis found them, sensors as noisy as they were, "
    "and an error as large as what the diagnosis left unexplained; beyond the amplitudes and frequencies that were "
    "seen this error grows. Ninety percent of the time a test shall lie within the band."
)


def page(found: Prediction, source: str) -> str:
    """The page's text; `source` names the file with what was found."""
    plan = found.plan
    facts = [
        ("ground motion", f"{found.motion.describe()}, scaled by {plan.ground_motion.scale:g}"),
        ("duration", f"{plan.test.duration:g} s, {plan.ticks} ticks"),
        ("found", source),
        ("laboratories", f"{found.draws} drawn, {found.diverged} of them unstable"),
    ]
    body = render(
        "predict.html",
        test=plan.test.name,
        facts=facts,
        sentences=[*tables.verdict(found), *found.sentences],
        said=SAID,
        picture=pictures.histories(found),
        peaks=tables.peaks(found),
        limits=tables.limits(found),
        plan=plan.toml(),
    )
    return frame(f"Prediction: {plan.test.name}", body)
