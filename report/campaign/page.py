"""A campaign as one HTML page."""

from __future__ import annotations

from collections.abc import Sequence

from report.campaign import pictures, tables
from report.page import frame, render
from report.text.formats import percent, quantity
from simulation.campaign.course import endured, of
from simulation.campaign.goal import BY_HAND, REAL_TIME, VIRTUAL, Goal
from simulation.campaign.steps import DiagnosedStep, PlayedStep, Step

METHOD = (
    "Before each test every candidate is simulated in the laboratories as found so far, under each plausible cause. "
    "Its expected information says how many bits it would add to what is known of the cause. A test may be played if "
    "under no plausible cause it passes a limit."
)

PLAYED = {VIRTUAL: "in virtual time", REAL_TIME: "in real time", BY_HAND: "by hand"}


def page(goal: Goal, steps: Sequence[Step]) -> str:
    """The page's text."""
    every = of(steps, PlayedStep)
    body = render(
        "campaign.html",
        test=goal.plan.test.name,
        facts=facts(goal, steps),
        sentences=[tables.ending(goal, steps)],
        method=METHOD,
        tests=tables.overview(goal, steps),
        files=[(one.file, diagnoses(goal, one.test)) for one in every],
        probabilities=pictures.probabilities(steps) if of(steps, DiagnosedStep) else None,
        causes=tables.causes(steps),
        choices=list(
            zip(
                tables.tests(steps),
                [tables.choices(goal, one) for one in tables.tests(steps)],
                pictures.choices(steps),
                strict=True,
            )
        ),
    )
    return frame(f"Campaign: {goal.plan.test.name}", body)


def diagnoses(goal: Goal, test: int) -> list[str]:
    """The pages of a test's diagnosis, one for each named slave."""
    names = [f"-{name}" for name in goal.plan.slaves] or [""]
    return [f"diagnosis-{test:02d}{name}.html" for name in names]


def facts(goal: Goal, steps: Sequence[Step]) -> list[tuple[str, str]]:
    """What was asked, and what it took."""
    through, limits = endured(steps), goal.limits
    asked = [f"cause certain with {percent(goal.head.certain)}"]
    asked += [f"or gap below {percent(goal.head.gap)}"] if goal.head.gap else []
    return [
        ("asked", " ".join(asked)),
        ("tests", f"{len(of(steps, PlayedStep))} of {goal.head.tests} at most, {PLAYED[goal.head.mode]}"),
        ("candidates", f"{len(goal.candidates)}"),
        ("largest drift", f"{quantity(through.drift, 'm')} of {quantity(limits.drift, 'm')} at most"),
        ("absorbed", f"{quantity(through.energy, 'J')} of {quantity(limits.energy, 'J')} at most"),
    ]
