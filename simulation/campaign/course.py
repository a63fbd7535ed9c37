"""The course of a campaign: test, diagnosis, next test, until it ends; every step is in the log before the next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from common.errors import InputError
from simulation.campaign.choice import Choice
from simulation.campaign.log import CampaignLog
from simulation.campaign.steps import (
    BegunStep,
    DecidedStep,
    DiagnosedStep,
    EndedStep,
    Endured,
    InterruptedStep,
    PlayedStep,
    RecordedStep,
    Step,
)

Kind = TypeVar("Kind", bound=Step | RecordedStep)


class Actions(Protocol):
    """What plays the tests of a campaign and diagnoses them.

    Each method may be called again for a step that was interrupted; it then goes on with the files that are there.
    """

    def begin(self) -> BegunStep:
        """The candidates as the nominal models predict them."""

    def interrupted(self, decided: DecidedStep) -> Sequence[InterruptedStep]:
        """The recordings of a test that did not reach its end."""

    def play(self, decided: DecidedStep) -> PlayedStep | None:
        """Play a test; None where a person still has to play it."""

    def diagnose(self, played: Sequence[PlayedStep], endured: Endured) -> DiagnosedStep:
        """Diagnose all tests so far together."""


def of(steps: Sequence[Step], kind: type[Kind]) -> list[Kind]:
    """The steps of a kind."""
    return [one for one in steps if isinstance(one, kind)]


def go_on(
    log: CampaignLog, actions: Actions, choose: Choice, tell: Callable[[Step], None] = lambda _: None
) -> EndedStep | DecidedStep:
    """Go on with a campaign until it ends; the test that was decided where a person has to play it.

    Raises:
        InputError: the log is of another campaign; and whatever the actions raise.
    """
    while True:
        last = log.steps[-1] if log.steps else None
        if isinstance(last, EndedStep):
            return last
        made = next_step(log.steps, actions, choose)
        if made is None:
            return of(log.steps, DecidedStep)[-1]
        log.append(made)
        tell(made)


def next_step(steps: Sequence[Step], actions: Actions, choose: Choice) -> Step | None:
    """The step after those of a log; None where a person has to act."""
    if not steps:
        return actions.begin()
    last = steps[-1]
    if isinstance(last, BegunStep | DiagnosedStep):
        return choose(steps)
    if isinstance(last, DecidedStep | InterruptedStep):
        decided = of(steps, DecidedStep)[-1]
        known = {one.file for one in of(steps, InterruptedStep)}
        new = [one for one in actions.interrupted(decided) if one.file not in known]
        return new[0] if new else actions.play(decided)
    return actions.diagnose(of(steps, PlayedStep), endured(steps))


def endured(steps: Sequence[Step]) -> Endured:
    """What the specimens have been through in all tests, those that were interrupted included."""
    rows = of(steps, RecordedStep)
    return Endured(max((one.drift for one in rows), default=0.0), sum(one.energy for one in rows))


def check(steps: Sequence[Step], goal: str) -> None:
    """Raise InputError where a log is that of another campaign; `goal` is the digest of this one."""
    begun = of(steps, BegunStep)
    if begun and begun[0].goal != goal:
        raise InputError(
            "The folder holds a campaign with another plan, other candidates, limits or another goal: give another "
            "folder with -o, or the file as it was."
        )
