"""Fragility curves as tables of a terminal or a page."""

from __future__ import annotations

import numpy as np

from report.fragility.curves import Curves, FragilityCurve
from report.text.formats import percent, probability, quantity
from report.text.terminal import TitledTable
from simulation.sweep.fragility import Stripe, chance

DOUBTED = 0.01  # probability below which a curve is doubted: one in a hundred true ones is
MOST_STRIPES = 12  # rows of a table of stripes, which a reader takes in at a glance


def asked(found: Curves) -> str:
    """What the curves are of."""
    limit = quantity(found.limit, found.unit)
    return f"chance that {found.quantity} passes {limit}, against {found.intensity}"


def fits(found: Curves) -> TitledTable:
    """Median and dispersion of every curve."""
    rows = [
        [
            one.name or "all tests",
            f"{one.fit.tests:,}",
            f"{one.fit.passed:,}",
            quantity(one.fit.median, found.intensity_unit, one.fit.median_interval),
            quantity(one.fit.dispersion, "", one.fit.dispersion_interval),
        ]
        for one in found.curves
    ]
    head = [
        found.by or "tests of",
        "tests",
        "passed",
        "median (interval of 90 %)",
        "dispersion (interval of 90 %)",
    ]
    return TitledTable("Curves", head, rows)


def missing(found: Curves) -> list[str]:
    """Sentences on the curves that cannot be fitted, or from which the tests lie too far."""
    none = [
        f"No curve{of(one)}: {one.fit.why_not}. Add scales or draws between."
        for one in found.curves
        if not one.fit.fitted
    ]
    far = [
        f"The shares of the tests{of(one)} lie farther from the curve than chance explains (probability "
        f"{probability(one.fit.agreement)}): read the shares, not the curve."
        for one in found.curves
        if one.fit.fitted and one.fit.agreement < DOUBTED
    ]
    return none + far


def of(one: FragilityCurve) -> str:
    """The name of a curve behind a noun."""
    return f" of '{one.name}'" if one.name else ""


def stripes(found: Curves) -> list[TitledTable]:
    """How many tests passed the limit at each intensity, curve by curve."""
    head = [found.intensity, "tests", "passed", "share", "curve"]
    return [
        TitledTable(one.name, head, [stripe_cells(found, one, each) for each in shown(one)])
        for one in found.curves
    ]


def stripe_cells(found: Curves, one: FragilityCurve, each: Stripe) -> list[str]:
    """One row of the table of stripes."""
    curve = probability(float(chance(one.fit, np.array([each.intensity]))[0]) if one.fit.fitted else None)
    return [
        quantity(each.intensity, found.intensity_unit),
        f"{each.tests:,}",
        f"{each.passed:,}",
        percent(each.share),
        curve,
    ]


def shown(one: FragilityCurve) -> list[Stripe]:
    """The stripes of a curve, gathered into at most `MOST_STRIPES` of neighbouring intensities (geometric means)."""
    if len(one.stripes) <= MOST_STRIPES:
        return one.stripes
    found = []
    for place in np.array_split(np.arange(len(one.stripes)), MOST_STRIPES):
        some = [one.stripes[at] for at in place]
        tests = sum(each.tests for each in some)
        mean = float(np.exp(sum(each.tests * np.log(each.intensity) for each in some) / tests))
        found.append(Stripe(mean, tests, sum(each.passed for each in some)))
    return found
