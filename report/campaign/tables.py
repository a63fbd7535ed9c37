"""A campaign as tables and sentences of a terminal or a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from report.text.formats import percent, quantity
from report.text.terminal import TitledTable
from simulation.campaign.choice import named
from simulation.campaign.course import of
from simulation.campaign.goal import Goal
from simulation.campaign.steps import (
    BegunStep,
    DecidedStep,
    DiagnosedStep,
    EndedStep,
    InterruptedStep,
    Option,
    PlayedStep,
    PossibleCause,
    RecordedStep,
    Step,
)

SHOWN = 3  # causes in a line of the terminal
LISTED = 12  # candidates in a table of the page, those that tell most


class TestOfCampaign(NamedTuple):
    """A test with all that the log holds on it."""

    decided: DecidedStep
    options: tuple[Option, ...]  # of the choice that made it
    played: PlayedStep | None = None
    diagnosed: DiagnosedStep | None = None


def tests(steps: Sequence[Step]) -> list[TestOfCampaign]:
    """The tests in their order."""
    played = {one.test: one for one in of(steps, PlayedStep)}
    diagnosed = {one.test: one for one in of(steps, DiagnosedStep)}
    begun = of(steps, BegunStep)
    found = []
    for one in of(steps, DecidedStep):
        before = diagnosed.get(one.test - 1)
        options = before.options if before else begun[0].options
        found.append(TestOfCampaign(one, options, played.get(one.test), diagnosed.get(one.test)))
    return found


def lines(goal: Goal, steps: Sequence[Step]) -> Iterator[str]:
    """The campaign in sentences, test by test."""
    for one in tests(steps):
        yield f"test {one.decided.test}: {goal.candidate(one.decided.candidate).text}"
        yield f"  why: {one.decided.why}"
        if one.played:
            yield f"  played: {one.played.outcome}, {strained(one.played)}"
        if one.diagnosed:
            yield f"  found: {causes_found(one.diagnosed)}"
    for cut in of(steps, InterruptedStep):
        yield f"test {cut.test} was interrupted once: {strained(cut)}; its recording is {cut.file}"
    yield ending(goal, steps)


def ending(goal: Goal, steps: Sequence[Step]) -> str:
    """How the campaign ended, or what a person has to do next."""
    last = steps[-1]
    if isinstance(last, EndedStep):
        return last.text
    test = of(steps, DecidedStep)[-1]
    return (
        f"Play test {test.test}, whose plan is test-{test.test:02d}.toml, and give its recording with --played to the "
        "same command."
    )


def strained(one: RecordedStep) -> str:
    """What a test did to the specimens."""
    return f"drift {quantity(one.drift, 'm')}, {quantity(one.energy, 'J')} absorbed"


def causes_found(one: DiagnosedStep) -> str:
    """Status, gap and causes of a diagnosis."""
    causes = ", ".join(f"{named(each.effects)} {percent(each.probability)}" for each in one.causes[:SHOWN])
    return f"{one.status.replace('_', ' ')}, {percent(one.gap)} of gap left; {causes}"


def overview(goal: Goal, steps: Sequence[Step]) -> TitledTable:
    """A row for each test."""
    rows = []
    for one in tests(steps):
        top = one.diagnosed.causes[0] if one.diagnosed else PossibleCause((), 0.0)
        rows.append(
            [
                str(one.decided.test),
                goal.candidate(one.decided.candidate).text,
                f"{one.decided.bits:.2f}",
                quantity(one.played.drift, "m") if one.played else "–",
                quantity(one.played.energy, "J") if one.played else "–",
                one.diagnosed.status.replace("_", " ") if one.diagnosed else "–",
                percent(one.diagnosed.gap) if one.diagnosed else "–",
                named(top.effects) if one.diagnosed else "–",
                percent(top.probability) if one.diagnosed else "–",
            ]
        )
    head = [
        "test",
        "played",
        "expected bits",
        "drift",
        "absorbed",
        "found",
        "gap left",
        "most probable",
        "with",
    ]
    return TitledTable("", head, rows)


def choices(goal: Goal, one: TestOfCampaign) -> TitledTable:
    """The candidates of a choice, those first that may be played and tell most."""
    order = sorted(one.options, key=lambda each: (bool(each.refused), -each.bits, each.drift))
    rows = [
        [
            goal.candidate(each.candidate).text,
            f"{each.bits:.2f}",
            percent(each.certainty),
            quantity(each.drift, "m"),
            quantity(each.energy, "J"),
            "chosen" if each.candidate == one.decided.candidate else each.refused or "",
        ]
        for each in order[:LISTED]
    ]
    head = ["candidate", "expected bits", "expected certainty", "largest drift", "absorbed", ""]
    return TitledTable(f"Test {one.decided.test}", head, rows)


def causes(steps: Sequence[Step]) -> TitledTable:
    """How the probabilities of the causes moved from test to test."""
    every = of(steps, DiagnosedStep)
    names = list(dict.fromkeys(cause.effects for one in every for cause in one.causes))
    rows = [
        [named(effects), *(percent(chance) if chance else "–" for chance in moved(every, effects))]
        for effects in names
        if max(moved(every, effects)) >= LEAST
    ]
    return TitledTable("", ["cause", *(f"after test {one.test}" for one in every)], rows)


LEAST = 0.005  # probability that a cause must have once to be listed: below, it is never worth a test


def moved(every: Sequence[DiagnosedStep], effects: tuple[str, ...]) -> list[float]:
    """The probability of a cause after each test, 0 where it was not among the causes."""
    return [sum(cause.probability for cause in one.causes if cause.effects == effects) for one in every]
