"""The pictures of a campaign: how the probabilities moved, and what each choice was between."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

from report.campaign.tables import TestOfCampaign, moved, tests
from report.page import data_uri
from report.pictures import figure
from report.run.drawing import INCH, DrawnPicture
from simulation.campaign.choice import named
from simulation.campaign.course import of
from simulation.campaign.steps import DiagnosedStep, Step

HIGH = 2.8  # inches
CURVES = 6  # causes with a curve: the most probable ones, for which there are colours


def probabilities(steps: Sequence[Step]) -> DrawnPicture:
    """The probability of each cause after each test."""
    every = of(steps, DiagnosedStep)
    names = list(dict.fromkeys(cause.effects for one in every for cause in one.causes))
    names.sort(key=lambda effects: -max(moved(every, effects)))

    def draw(axes: Any) -> None:
        for place, effects in enumerate(names[:CURVES]):
            axes.plot(
                [one.test for one in every],
                moved(every, effects),
                "o-",
                color=figure.COLOURS[place % len(figure.COLOURS)],
                markersize=3.5,
                label=named(effects),
            )
        axes.set_xlabel("after test")
        axes.set_ylabel("probability")
        axes.set_xticks([one.test for one in every])
        axes.set_ylim(-0.03, 1.03)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))

    return drawn("probabilities", draw, "How the probabilities of the causes moved from test to test.")


def choices(steps: Sequence[Step]) -> list[DrawnPicture]:
    """For each choice the candidates by drift and expected information."""
    return [choice(one) for one in tests(steps)]


def choice(one: TestOfCampaign) -> DrawnPicture:
    """The candidates of one choice."""

    def draw(axes: Any) -> None:
        groups = (
            ("within the limits", [each for each in one.options if not each.refused], figure.COLOURS[0], "o"),
            ("beyond a limit", [each for each in one.options if each.refused], figure.COLOURS[1], "x"),
        )
        for label, group, colour, mark in groups:
            if group:
                axes.plot(
                    [1e3 * each.drift for each in group],
                    [each.bits for each in group],
                    mark,
                    color=colour,
                    label=label,
                )
        chosen = next(each for each in one.options if each.candidate == one.decided.candidate)
        axes.plot(
            [1e3 * chosen.drift], [chosen.bits], "o", color="none", markeredgecolor="black", markersize=11
        )
        axes.set_xlabel("largest predicted drift, mm")
        axes.set_ylabel("expected information, bits")
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        axes.legend()

    return drawn(
        f"choice-{one.decided.test}", draw, f"The choice of test {one.decided.test}, which has a ring."
    )


def drawn(name: str, draw: Any, caption: str) -> DrawnPicture:
    """A picture with one pair of axes, narrow and wide."""
    (narrow, size), (wide, _) = (png(draw, width) for width in (figure.SINGLE, figure.DOUBLE))
    return DrawnPicture(name, data_uri(narrow), size, caption, caption, data_uri(wide))


def png(draw: Any, width: float) -> tuple[bytes, tuple[int, int]]:
    """The picture's file and its CSS pixels."""
    canvas = figure.figure(width, HIGH)
    draw(canvas.subplots())
    stream = io.BytesIO()
    canvas.savefig(stream, format="png", dpi=figure.DOTS, metadata=figure.STAMPS[".png"])
    across, high = (round(INCH * float(inches)) for inches in canvas.get_size_inches())
    return stream.getvalue(), (across, high)
