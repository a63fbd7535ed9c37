"""One HTML page about a blind trial, readable without network."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any, NamedTuple

from report.gap.wording import STATUS
from report.page import data_uri, frame, render
from report.pictures.figure import COLOURS, figure
from report.text.formats import MISSING, quantity
from validation.blind.predicted import results as predictions
from validation.blind.predicted.predict import PredictedCase
from validation.blind.results.measures import (
    Bin,
    Matrix,
    by_size,
    confusion,
    confusion_by_site,
    measures,
    reliability,
)
from validation.blind.results.rows import HEAD, case_rows
from validation.blind.results.scoring import VISIBLE, Outcome

TITLE = "Blind trial of the diagnosis"
CASE = ("case", "kind", "truth", "size", "verdict", "probability", "why")
INCH = 96  # CSS pixels


class Image(NamedTuple):
    """A figure of the page: its data URI, its size in CSS pixels, its caption."""

    source: str
    size: tuple[int, int]
    caption: str


def page(outcomes: Sequence[Outcome], about: str, predicted: Sequence[PredictedCase] = ()) -> str:
    """The HTML text; `about` says how the cases were made, `predicted` are their predictions."""
    wrong = [item for item in outcomes if not item.right]
    body = render(
        "blind.html",
        title=TITLE,
        about=about,
        right=len(outcomes) - len(wrong),
        count=len(outcomes),
        measures=[*measures(outcomes), *(predictions.measures(predicted) if predicted else ())],
        row_head=HEAD,
        rows=[item.cells for item in case_rows(outcomes)],
        predicted_head=predictions.HEAD,
        predicted=[predictions.cells(item) for item in predicted],
        matrices=matrices(outcomes),
        curves=curves(outcomes),
        names=CASE,
        wrong=[case(item) for item in wrong],
    )
    return frame(TITLE, body)


def case(item: Outcome) -> tuple[str, ...]:
    """The cells of a case that is not right."""
    return (
        str(item.index),
        item.kind,
        hidden(item),
        number(item.size),
        f"{' and '.join(item.verdict) or STATUS.get(item.status, item.status)}, site {item.verdict_site or MISSING}",
        number(item.probability),
        item.why,
    )


def hidden(item: Outcome) -> str:
    """The hidden effects of a case, with their parameters."""
    parts = []
    for name, formula in zip(item.truth, item.formulas, strict=True):
        values = ", ".join(f"{key} {value:.4g}" for key, value in item.parameters[name].items())
        parts.append(f"{name} ({values})" + (f" as {formula}" if formula else ""))
    return " and ".join(parts) or "clean"


def number(value: float) -> str:
    """A number, a dash where there is none."""
    return quantity(value, "")


def matrices(outcomes: Sequence[Outcome]) -> list[Image]:
    """Confusion matrices of sites and effects."""
    sites = draw_matrix(confusion_by_site(outcomes))
    effects = draw_matrix(confusion(outcomes))
    return [
        image(sites, "Sites: truth down, first site of the diagnosis across."),
        image(effects, "Effects: truth down, verdict across; single effects only."),
    ]


def curves(outcomes: Sequence[Outcome]) -> list[Image]:
    """Share of right verdicts against size and probability."""
    sizes, stated = draw_sizes(by_size(outcomes)), draw_reliability(reliability(outcomes))
    return [
        image(sizes, "Right verdicts on single effects against residual to noise."),
        image(stated, "Right verdicts against the probability that they state."),
    ]


def image(canvas: Any, caption: str) -> Image:
    """A figure embedded in the page, in the size in which it was drawn."""
    buffer = io.BytesIO()
    canvas.savefig(buffer, format="png")
    width, height = (round(INCH * inches) for inches in canvas.get_size_inches())
    return Image(data_uri(buffer.getvalue()), (width, height), caption)


def draw_matrix(matrix: Matrix) -> Any:
    """A confusion matrix: shares of each row as shades, counts as numbers."""
    import numpy as np

    truths = sorted(matrix)
    verdicts = [*truths, *sorted({name for line in matrix.values() for name in line} - set(truths))]
    counts = np.array([[matrix[true].get(name, 0) for name in verdicts] for true in truths], dtype=float)
    counts = counts.reshape(len(truths), len(verdicts))
    canvas = figure(2.5 + 0.24 * len(verdicts), 2.0 + 0.2 * len(truths))
    axis = canvas.subplots()
    axis.grid(visible=False)
    if counts.size:
        axis.imshow(
            counts / counts.sum(axis=1, keepdims=True), cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto"
        )
    for i, j in zip(*np.nonzero(counts), strict=True):
        dark = counts[i, j] > 0.5 * counts[i].sum()
        colour = "white" if dark else "black"
        axis.text(j, i, f"{counts[i, j]:.0f}", ha="center", va="center", color=colour, fontsize=7)
    axis.set_xticks(range(len(verdicts)), verdicts, rotation=90, fontsize=7)
    axis.set_yticks(range(len(truths)), truths, fontsize=7)
    axis.set(xlabel="diagnosis", ylabel="truth")
    return canvas


def draw_sizes(bins: Sequence[Bin]) -> Any:
    """Accuracy against size."""
    canvas = figure(4.2, 3.6)
    axis = canvas.subplots()
    shares(axis, bins)
    axis.axvline(VISIBLE, color="0.4", linestyle=":", label="size from which an effect counts")
    axis.set(xscale="symlog", xlabel="residual to noise", ylabel="right effect first", ylim=(-0.06, 1.05))
    axis.xaxis.set_major_formatter("{x:g}")
    axis.set_xlim(left=-0.1)
    axis.legend(loc="center right")
    return canvas


def draw_reliability(bins: Sequence[Bin]) -> Any:
    """Stated against observed probability."""
    canvas = figure(4.2, 4.0)
    axis = canvas.subplots()
    axis.plot([0.0, 1.0], [0.0, 1.0], color="0.4", linestyle=":", label="perfectly calibrated")
    shares(axis, bins)
    axis.set(xlabel="probability stated", ylabel="share right", xlim=(0.0, 1.02), ylim=(-0.03, 1.05))
    axis.legend(loc="upper left")
    return canvas


def shares(axis: Any, bins: Sequence[Bin]) -> None:
    """Shares with their intervals, the number of cases beside them."""
    for item in bins:
        axis.plot([item.middle] * 2, [item.share_low, item.share_high], color=COLOURS[0])
        axis.annotate(
            str(item.count), (item.middle, item.share), (4, -9), textcoords="offset points", fontsize=7
        )
    axis.plot(
        [item.middle for item in bins], [item.share for item in bins], "o", color=COLOURS[0], markersize=4
    )
