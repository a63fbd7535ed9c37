"""The pictures of the benchmark: compensators, a late force, one test's motion."""

from __future__ import annotations

import math
from typing import Any

from report.pictures.figure import COLOURS, REFERENCE, TEXT
from report.pictures.layout import legend_above
from report.text.formats import percent
from validation.benchmark2020.criteria import MEANINGS
from validation.benchmark2020.evidence import (
    CELL,
    DELAY_CELL,
    NOMINAL_GOAL,
    PLANTS_GOAL,
    BenchmarkEvidence,
    sample_cells,
)
from validation.benchmark2020.runs import NOMINAL
from validation.proof import ProofFigure

MOST = 300.0  # %, end of the axis: an error of three times the response is a failed test, however large it is


def compensators(evidence: BenchmarkEvidence, canvas: Any) -> None:
    """J4 of every test of every setting; unstable ones are drawn at the end of the axis."""
    order = sorted(evidence.summaries, key=lambda item: item.order, reverse=True)
    places = {item.setting: place for place, item in enumerate(order)}
    axis = canvas.subplots()
    for drawn, label, marker, size, below in (
        (True, "drawn plants", "|", 5, 0.25),
        (False, "nominal plant", "o", 3, 0.0),
    ):
        some = [item for item in evidence.results if (item.plant != NOMINAL) == drawn]
        if some:
            x = [min(item.j4 * 1e2, MOST) for item in some]
            y = [places[item.setting] - below for item in some]
            axis.plot(
                x, y, marker, color=COLOURS[drawn], markersize=size, label=label, linestyle="none", alpha=0.6
            )
    for goal, line in ((NOMINAL_GOAL, "--"), (PLANTS_GOAL, ":")):
        axis.axvline(goal * 1e2, color=REFERENCE, linestyle=line, linewidth=0.8)
    axis.set_xscale("log")
    axis.set(xlabel="J4, % (300: more, or unstable)", yticks=list(places.values()), xlim=(2.0, MOST * 1.1))
    axis.set_yticklabels(list(places))
    axis.set_xticks([2, 5, 10, 20, 50, 100, 300], ["2", "5", "10", "20", "50", "100", "300"], minor=False)
    axis.minorticks_off()
    legend_above(axis)


def late_force(evidence: BenchmarkEvidence, canvas: Any) -> None:
    """Which criteria show a late force, and which do not."""
    upper, lower = canvas.subplots(2, 1, sharex=True)
    cases = sorted({item.result.case for item in evidence.late})
    for case in (cases[0], cases[-1]):
        some = [item for item in evidence.late if item.result.case == case and item.result.found]
        found = [item.result.found for item in some if item.result.found]
        colour = COLOURS[0] if case == cases[0] else COLOURS[1]
        x = [item.delay * 1e3 for item in some]
        j4 = [item.result.j4 * 1e2 for item in some]
        upper.plot(x, j4, "o-", color=colour, markersize=3, label=f"J4, case {case}")
        upper.plot(
            x, [one.j2 * 1e2 for one in found], "s:", color=colour, markersize=3, label=f"J2, case {case}"
        )
        said = [(item.delay * 1e3, item.path.delay * 1e3) for item in some if item.path]
        at, read = [delay for delay, _ in said], [found for _, found in said]
        lower.plot(at, read, "o", color=colour, markersize=3, label=f"force path, case {case}")
        lower.plot(
            x, [one.j1 * 1e3 for one in found], "s:", color=colour, markersize=3, label=f"J1, case {case}"
        )
    upper.set(ylabel="J2, J4, %", yscale="log")
    upper.yaxis.set_major_formatter("{x:g}")
    lower.set(xlabel="delay of the measured force, ms", ylabel="read, ms")
    legend_above(upper)
    legend_above(lower)


def table_3(evidence: BenchmarkEvidence, canvas: Any) -> None:
    """The deviation of every cell from the published one."""
    found = sample_cells(evidence)
    width = len(MEANINGS)
    axis = canvas.subplots()
    for row in range(len(found) // width):
        shares = [difference / most for difference, most in found[row * width : (row + 1) * width]]
        places = [place + 0.12 * (row - 1.5) for place in range(width)]
        axis.plot(places, shares, "o", markersize=3, label=f"case {row + 1}")
    for bound in (-1.0, 1.0):
        axis.axhline(bound, color=REFERENCE, linestyle="--", linewidth=0.8)
    axis.set(
        xticks=range(width),
        ylabel=f"deviation / allowed deviation\n({percent(CELL)}, {DELAY_CELL * 1e3:g} ms)",
    )
    axis.set_xticklabels(list(MEANINGS))
    if any(not math.isfinite(difference) for difference, _ in found):
        axis.set_title("unstable cases are not drawn", fontsize=TEXT)
    legend_above(axis)


FIGURES = (
    ProofFigure(
        "compensators.png",
        "J4 of every test of every setting, log scale: 4 cases × 3 motions on the nominal plant and on drawn plants; "
        "the goals, 5 and 6 %, are dashed and dotted",
        compensators,
        3.4,
    ),
    ProofFigure(
        "late_force.png",
        "A force that arrives late, with the adaptive model-based compensator: J1 and J2 hardly change, J4 grows; the "
        "indicator of the force path reads the delay",
        late_force,
        4.2,
    ),
    ProofFigure(
        "table3.png",
        "Deviation of the 36 cells from the published Table 3, over the allowed deviation",
        table_3,
        2.6,
    ),
)


def wanted(evidence: BenchmarkEvidence) -> list[ProofFigure]:
    """Every picture that there are tests for."""
    return [item for item in FIGURES if item.draw is not table_3 or sample_cells(evidence)]
