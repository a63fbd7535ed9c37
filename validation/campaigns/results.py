"""Chosen tests beside random ones, over many hidden laboratories."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from report.text.formats import percent
from simulation.campaign.goal import Goal
from validation.campaigns.compare import ComparedCase, PlayedCampaign

# The goal: chosen tests over random ones.
HALF = 0.5


def summary(goal: Goal, cases: Sequence[ComparedCase]) -> dict[str, Any]:
    """The figures; a ratio is None where there is nothing to count.

    `both`: laboratories in which all campaigns ended certain of the right cause; `open`: those of them in which the
    test with the smallest drift would not have been enough. `all`: every laboratory in which one campaign ended so;
    another one counts as all tests that the goal allows.
    """
    both = [one for one in cases if one.chosen.right and all(each.right for each in one.random)]
    some = [one for one in cases if one.chosen.right or any(each.right for each in one.random)]
    return {
        "laboratories": len(cases),
        "chosen": {"right": share([one.chosen for one in cases])} | wrong([one.chosen for one in cases]),
        "random": {"right": share([each for one in cases for each in one.random])}
        | wrong([each for one in cases for each in one.random]),
        "both": counts(both, goal.head.tests),
        "open": counts([one for one in both if not one.gentle], goal.head.tests),
        "all": counts(some, goal.head.tests),
    }


def share(played: Sequence[PlayedCampaign]) -> float:
    """Share of the campaigns that ended certain of the right cause."""
    return float(np.mean([one.right for one in played])) if played else math.nan


def wrong(played: Sequence[PlayedCampaign]) -> dict[str, float]:
    """Share of the campaigns that ended certain of a wrong cause."""
    return {"wrong": float(np.mean([one.wrong for one in played])) if played else math.nan}


def counts(cases: Sequence[ComparedCase], most: int) -> dict[str, float | int | None]:
    """Mean tests with chosen and with random ones, and their ratio."""
    chosen = [until(one.chosen, most) for one in cases]
    random = [float(np.mean([until(each, most) for each in one.random])) for one in cases]
    if not cases:
        return {"laboratories": 0, "chosen": None, "random": None, "ratio": None}
    one, other = float(np.mean(chosen)), float(np.mean(random))
    return {"laboratories": len(cases), "chosen": one, "random": other, "ratio": one / other}


def until(one: PlayedCampaign, most: int) -> int:
    """The tests until a campaign was certain of the right cause; all that are allowed where it never was."""
    return one.tests if one.right else most


def rows(cases: Sequence[ComparedCase]) -> list[list[str]]:
    """A row for each laboratory, with a head."""
    found = [["case", "kind", "hidden", "chosen tests", "random tests"]]
    for one in sorted(cases, key=lambda each: each.index):
        found.append(
            [
                str(one.index),
                one.kind,
                " and ".join(one.truth) or "nothing",
                cell(one.chosen),
                ", ".join(map(cell, one.random)),
            ]
        )
    return found


def cell(one: PlayedCampaign) -> str:
    """The tests of a campaign, and how it ended where it was not certain of the right cause."""
    return f"{one.tests}" if one.right else f"{one.tests} ({'wrong' if one.wrong else one.outcome})"


def sentences(goal: Goal, cases: Sequence[ComparedCase]) -> list[str]:
    """The figures in words."""
    told = summary(goal, cases)
    found = [
        f"Certain of the right cause in the end: {percent(told['chosen']['right'])} of the campaigns with chosen "
        f"tests, {percent(told['random']['right'])} of those with random ones; of a wrong one: "
        f"{percent(told['chosen']['wrong'])} and {percent(told['random']['wrong'])}."
    ]
    texts = {
        "both": "Where all campaigns were certain of the right cause",
        "open": "Of these, where the test with the smallest drift is not enough",
        "all": f"Where one was at least, the others counting as {goal.head.tests} tests",
    }
    for name, text in texts.items():
        one = told[name]
        if not one["laboratories"]:
            found.append(f"{text}: no laboratory.")
            continue
        found.append(
            f"{text} ({one['laboratories']} laboratories): {one['chosen']:.2f} chosen tests, {one['random']:.2f} "
            f"random tests, ratio {one['ratio']:.2f}."
        )
    return found


def plain(goal: Goal, cases: Sequence[ComparedCase]) -> dict[str, Any]:
    """Everything that is written as JSON."""
    ordered = sorted(cases, key=lambda each: each.index)
    return {"goal": goal.digest, "summary": summary(goal, cases), "cases": [asdict(one) for one in ordered]}
