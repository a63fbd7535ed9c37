"""A campaign as one HTML page."""

from __future__ import annotations

from collections.abc import Sequence

from report.campaign import pictures, tables
from report.page import frame, render
from report.text.formats import percent, quantity
from simulation.campaign.course import endured, of
from simulation.campaign.goal import Goal
from simulation.campaign.steps import Diagnosed, PlayedStep, Step

SAID = (
    "Before each test every candidate is simulated in the laboratories as found so far, under each plausible cause. "
    "Its expected information says how many bits it would add to what is known of the cause. A test may be played if "
    "under no plausible cause it passes a limit."
)


def page(goal: Goal, steps: Sequence[Step]) -> str:
    """The page's text."""
    every = of(steps, PlayedStep)
    body = render(
        "campaign.html",
        test=goal.plan.test.name,
        facts=facts(goal, steps),
        sentences=[tables.ending(goal, steps)],
        said=SAID,
        tests=tables.overview(goal, steps),
        files=[(one.file, f"diagnosis-{one.test:02d}.html") for one in every],
        probabilities=pictures.probabilities(steps) if of(steps, Diagnosed) else None,
        causes=tables.causes(steps),
        choices=list(
            zip(
                [one for one in tables.tests(steps) if one.decided.test > 1],
                [tables.choices(goal, one) for one in tables.tests(steps) if one.decided.test > 1],
                pictures.choices(steps),
                strict=True,
            )
        ),
    )
    return frame(f"Campaign: {goal.plan.test.name}", body)


def facts(goal: Goal, steps: Sequence[Step]) -> list[tuple[str, str]]:
    """What was asked, and what it took."""
    through, limits = endured(steps), goal.limits
    asked = [f"cause certain with {percent(goal.head.certain)}"]
    asked += [f"or gap below {percent(goal.head.gap)}"] if goal.head.gap else []
    return [
        ("asked", " ".join(asked)),
        ("tests", f"{len(of(steps, PlayedStep))} of {goal.head.tests} at most, in {goal.head.mode}"),
        ("candidates", f"{len(goal.candidates)}"),
        ("largest drift", f"{quantity(through.drift, 'm')} of {quantity(limits.drift, 'm')} at most"),
        ("absorbed", f"{quantity(through.energy, 'J')} of {quantity(limits.energy, 'J')} at most"),
    ]
