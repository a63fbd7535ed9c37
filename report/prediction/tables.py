"""Peaks with their bands and the chance that a limit is passed, as tables of a terminal or a page."""

from __future__ import annotations

from report.text.formats import quantity
from report.text.terminal import TitledTable
from simulation.prediction.bands import LimitChance, PeakBand, Prediction

NEAR = 0.5  # share of a limit that the upper end of a peak's band must reach for its row to be shown


def banded(band: PeakBand) -> str:
    """A median with its band."""
    return quantity(band.median, band.unit, (band.low, band.high))


def peaks(found: Prediction) -> TitledTable:
    """Peaks of drifts and signals."""
    rows = [
        ["peak drift" if len(found.drifts) == 1 else f"peak drift of storey {storey}", banded(one)]
        for storey, one in found.drifts.items()
    ]
    rows += [[name, banded(one)] for name, one in found.peaks.items()]
    return TitledTable("", ["peak of", "median (band of 90 %)"], rows)


def limits(found: Prediction) -> TitledTable:
    """Limits that the test comes near to, and the chance that it passes them."""
    near = {name: one for name, one in found.limits.items() if one.passed or one.peak.high > NEAR * one.limit}
    rows = [
        [name, quantity(one.limit, one.peak.unit), banded(one.peak), chance(one, found)]
        for name, one in near.items()
    ]
    head = ["limit", "at", "peak (band of 90 %)", "passed in"]
    return TitledTable("", head, rows or [["no limit is reached by half", "–", "–", "–"]])


def chance(one: LimitChance, found: Prediction) -> str:
    """How many of the laboratories drawn pass a limit."""
    return f"{one.passed} of {found.draws}"


def verdict(found: Prediction) -> list[str]:
    """Whether the test stays within the plan's limits, in a sentence."""
    worst = max(found.limits.items(), key=lambda one: one[1].passed, default=None)
    if worst is None or not worst[1].passed:
        return [
            f"No limit of the plan is passed in any of the {found.draws} laboratories drawn: the chance is below "
            f"{100.0 * 3.0 / found.draws:.0f} %."
        ]
    name, one = worst
    share = 100.0 * one.passed / found.draws
    return [
        f"{name} passes its limit of {quantity(one.limit, one.peak.unit)} in {one.passed} of {found.draws} "
        f"laboratories drawn: the chance is about {share:.0f} %."
    ]
