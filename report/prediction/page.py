"""A prediction as one HTML page."""

from __future__ import annotations

from report.page import frame, render
from report.prediction import pictures, tables
from simulation.prediction.bands import Prediction

METHOD = (
    "The parameters of each laboratory are drawn from the uncertainty of the diagnosis, and its sensors have the noise "
    "that was found. Each signal has an error as large as the part of the gap that the diagnosis left unexplained; the "
    "error grows beyond the amplitudes and frequencies of the diagnosed recording. A test should lie within the band "
    "for 90 % of the time."
)


def page(found: Prediction, source: str) -> str:
    """The page's text; `source` names the file with the findings."""
    plan = found.plan
    facts = [
        ("ground motion", f"{found.motion.describe()}, scaled by {plan.ground_motion.scale:g}"),
        ("duration", f"{plan.test.duration:g} s, {plan.ticks} ticks"),
        ("findings", source),
        ("laboratories", f"{found.draws} drawn, {found.diverged} of them unstable"),
    ]
    body = render(
        "predict.html",
        test=plan.test.name,
        facts=facts,
        sentences=[*tables.verdict(found), *found.sentences],
        method=METHOD,
        picture=pictures.histories(found),
        peaks=tables.peaks(found),
        limits=tables.limits(found),
        plan=plan.toml(),
    )
    return frame(f"Prediction: {plan.test.name}", body)
