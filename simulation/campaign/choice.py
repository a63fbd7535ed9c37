"""The choice of the next test, or of the end of the campaign."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from simulation.campaign.goal import GoalTable
from simulation.campaign.steps import BegunStep, DecidedStep, DiagnosedStep, EndedStep, Option, Step

Choice = Callable[[Sequence[Step]], DecidedStep | EndedStep]
Pick = Callable[
    [Sequence[Option], int], Option
]  # of the options that may be played, for the test of a number

# Share of the best test's information within which another one tells as much: then the one that strains the specimens
# least is played. More would leave weak effects unseen, for which a clean laboratory then needs a further test.
AS_MUCH = 0.01
# Bits below which no test tells anything: it would change a probability of 95 % by less than one point.
LEAST = 0.01

# Statuses of a diagnosis that leaves a gap without a cause.
LEAVING = ("partly_explained", "unknown_effect")

FROM_THE_LEAST = (
    "It has the smallest drift, from which the drift may grow by the factor that the limits allow."
)

TO_LOOK = (
    "The diagnosis leaves a gap for which its catalogue has no cause, so that it cannot be predicted which test tells "
    "more; of the tests within the limits this one has the largest drift."
)

CERTAIN, INSEPARABLE, GAP, TESTS, LIMITS, SILENT = (
    "certain",
    "inseparable",
    "gap",
    "tests",
    "limits",
    "silent",
)


def best(options: Sequence[Option], _test: int) -> Option:
    """The option that tells most; of several that tell as much, the one with the smallest drift."""
    most = max(one.bits for one in options)
    return min(
        (one for one in options if one.bits >= (1.0 - AS_MUCH) * most),
        key=lambda one: (one.drift, -one.bits, one.candidate),
    )


def least(options: Sequence[Option], _test: int) -> Option:
    """The option with the smallest drift."""
    return min(options, key=lambda one: (one.drift, one.candidate))


def farthest(options: Sequence[Option]) -> Option:
    """The option with the largest drift."""
    return max(options, key=lambda one: (one.drift, -one.candidate))


def at_random(seed: int, options: Sequence[Option], test: int) -> Option:
    """An option at random, the same for the same seed and number of the test."""
    return options[int(np.random.default_rng([seed, test]).integers(len(options)))]


def choosing(head: GoalTable, pick: Pick = best, *, gentle: bool = False) -> Choice:
    """The choice for a goal; a `gentle` campaign begins with the smallest drift."""
    return partial(choose, head, pick, gentle)


def choose(head: GoalTable, pick: Pick, gentle: bool, steps: Sequence[Step]) -> DecidedStep | EndedStep:
    """The next test after the steps of a log, which end with `Begun` or `Diagnosed`, or the end."""
    last = steps[-1]
    if isinstance(last, BegunStep):
        return first(least if gentle else pick, last)
    assert isinstance(last, DiagnosedStep)  # noqa: S101 - no other step asks for a choice
    look = newly_left(steps)
    return end(head, last) or (None if look else settled(head, last)) or following(pick, steps, last, look)


def newly_left(steps: Sequence[Step]) -> bool:
    """Whether the last diagnosis leaves a gap without a cause, and the one before it did not.

    What one motion leaves may be a wrong cause or an effect that a further test shows, so no campaign ends on it.
    """
    left = [leaves(one) for one in steps if isinstance(one, DiagnosedStep)]
    return left[-1] and not any(left[-2:-1])


def leaves(one: DiagnosedStep) -> bool:
    """Whether a diagnosis leaves a gap without a cause."""
    return any(status in one.status for status in LEAVING)


def first(pick: Pick, begun: BegunStep) -> DecidedStep | EndedStep:
    """The first test."""
    left = [one for one in begun.options if not one.refused]
    if not left:
        return none_left(begun.options)
    chosen = pick(left, 1)
    why = FROM_THE_LEAST if pick is least else reason(chosen, left)
    return DecidedStep(1, chosen.candidate, chosen.bits, why)


def end(head: GoalTable, last: DiagnosedStep) -> EndedStep | None:
    """The end that a diagnosis makes whatever was before it; None where another test is asked for."""
    if head.gap > 0.0 and last.gap <= head.gap:
        return EndedStep(
            GAP,
            f"The gap that is left, {100.0 * last.gap:.2g} %, is within the {100.0 * head.gap:.2g} % asked for.",
        )
    played = last.test >= head.tests
    found = settled(head, last) if played or not leaves(last) else None
    if found is None and played:
        return EndedStep(
            TESTS, f"All {head.tests} tests are played; the most probable cause is {likely(last)}."
        )
    return found


def settled(head: GoalTable, last: DiagnosedStep) -> EndedStep | None:
    """The end where the cause, or a set of causes that no test tells apart, has the probability that was asked for."""
    top = last.causes[0]
    if top.probability >= head.certain:
        return EndedStep(
            CERTAIN, f"The cause is certain: {named(top.effects)}, with {percent(top.probability)}."
        )
    if len(last.same) > 1 and last.together >= head.certain:
        return EndedStep(
            INSEPARABLE,
            f"No test within these limits can tell {' from '.join(map(named, last.same))}; one of them is the cause, "
            f"with {percent(last.together)}.",
        )
    return None


def following(pick: Pick, steps: Sequence[Step], last: DiagnosedStep, look: bool) -> DecidedStep | EndedStep:
    """The next test, or the end where none may be played or none tells anything.

    Of a gap without a cause nothing can be predicted: with `look` it is looked at in the test that shows most.
    """
    played = {one.candidate for one in steps if isinstance(one, DecidedStep)}
    new = [one for one in last.options if one.candidate not in played]
    left = [one for one in new if not one.refused]
    if not left:
        return none_left(new)
    if max(one.bits for one in left) < LEAST:
        if look:
            chosen = farthest(left) if pick is best else pick(left, last.test + 1)
            return DecidedStep(last.test + 1, chosen.candidate, chosen.bits, TO_LOOK)
        return EndedStep(
            SILENT,
            "No test within these limits tells more about the cause than is known; the most probable one is "
            f"{likely(last)}.{without_cause(last)}",
        )
    chosen = pick(left, last.test + 1)
    return DecidedStep(last.test + 1, chosen.candidate, chosen.bits, reason(chosen, left))


def without_cause(last: DiagnosedStep) -> str:
    """Why no further test helps where a diagnosis leaves a gap without a cause; empty where it leaves none."""
    if not leaves(last):
        return ""
    return (
        f" The diagnosis leaves a gap, of up to {percent(last.gap)}, for which its catalogue has no cause. What a test "
        "would show of such a cause cannot be predicted, so that no test is chosen for it: give an effect of your own, "
        "or play a test of your choice."
    )


def none_left(options: Sequence[Option]) -> EndedStep:
    """The end where no candidate may be played."""
    reasons = sorted({one.refused for one in options})
    if not reasons:
        return EndedStep(LIMITS, "Every test of the list is played.")
    return EndedStep(LIMITS, f"No test of the list is left within the limits: {'; '.join(reasons)}.")


def reason(chosen: Option, left: Sequence[Option]) -> str:
    """Why a test is next, in a sentence."""
    most = max(one.bits for one in left)
    text = (
        f"It is expected to tell {chosen.bits:.2g} bits about the cause and to bring the true one to "
        f"{percent(chosen.certainty)}"
    )
    if chosen.bits < most:
        return f"{text}; no test within the limits tells more than {most:.2g} bits, and this one has a smaller drift."
    return f"{text}, the most of {len(left)} tests within the limits."


def likely(last: DiagnosedStep) -> str:
    """The most probable cause with its probability."""
    return f"{named(last.causes[0].effects)}, with {percent(last.causes[0].probability)}"


def named(effects: Sequence[str]) -> str:
    """A cause in words."""
    return " and ".join(effects) or "nothing beyond the tolerances"


def percent(share: float) -> str:
    """A share in per cent."""
    return f"{100.0 * share:.3g} %"
