"""One HTML page about a blind trial, readable without network."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterable, Sequence
from typing import Any

from rths.figure import COLOURS, figure
from rths.trial.measures import (
    Bin,
    Matrix,
    Measure,
    by_size,
    confusion,
    confusion_by_site,
    measures,
    reliability,
)
from rths.trial.scoring import VISIBLE, Outcome

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; width: 100%; font-size: 13px; }
th, td { text-align: left; vertical-align: top; padding: .35rem .5rem; border-bottom: 1px solid #ccc; }
.pass { color: #00694b; font-weight: 600; } .fail { color: #b33000; font-weight: 600; }
small { color: #555; } figure { margin: 2rem 0; break-inside: avoid; } img { max-width: 100%; }
figcaption { font-size: 13px; color: #444; }
"""
WORDS = {True: '<span class="pass">pass</span>', False: '<span class="fail">fail</span>', None: ""}


def page(outcomes: Sequence[Outcome], about: str) -> str:
    """The page's text; `about` says how the cases were made."""
    wrong = [item for item in outcomes if not item.right]
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Blind trial of the diagnosis</title><style>{STYLE}</style></head>
<body><h1>Blind trial of the diagnosis</h1>
<p>{html.escape(about)} The process that diagnosed was given the recordings only.
{len(outcomes) - len(wrong)} of {len(outcomes)} cases right. Brackets: Wilson 95 % interval of a share, range of the
middle 80 % of anything else.</p>
{table(("measure", "value", "cases", "goal", ""), map(row, measures(outcomes)))}
{pictures(outcomes)}
<h2>Cases that are not right</h2>
{table(("case", "kind", "truth", "size", "verdict", "probability", "why"), map(case_row, wrong))}
</body></html>
"""


def table(heads: Iterable[str], rows: Iterable[str]) -> str:
    """A table of ready rows."""
    head = "".join(f"<th>{html.escape(text)}</th>" for text in heads)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def cells(texts: Iterable[str]) -> str:
    """Texts as the cells of a row."""
    return "".join(f"<td>{html.escape(text)}</td>" for text in texts)


def row(item: Measure) -> str:
    """One measure."""
    return (
        f"<tr>{cells((item.name, item.text, str(item.count), item.goal))}<td>{WORDS[item.passed]}</td></tr>\n"
    )


def case_row(item: Outcome) -> str:
    """One case that is not right."""
    texts = (
        str(item.index),
        item.kind,
        hidden(item),
        number(item.size),
        f"{' and '.join(item.verdict) or item.status}, site {item.verdict_site or '–'}",
        number(item.probability),
        item.why,
    )
    return f"<tr>{cells(texts)}</tr>\n"


def hidden(item: Outcome) -> str:
    """What a case hid, with its parameters."""
    parts = []
    for name, formula in zip(item.truth, item.formulas, strict=True):
        values = ", ".join(f"{key} {value:.4g}" for key, value in item.parameters[name].items())
        parts.append(f"{name} ({values})" + (f" as {formula}" if formula else ""))
    return " and ".join(parts) or "clean"


def number(value: float) -> str:
    """A number, a dash where there is none."""
    return "–" if value != value else f"{value:.3g}"  # noqa: PLR0124 - NaN is not itself


def pictures(outcomes: Sequence[Outcome]) -> str:
    """All figures."""
    drawn = (
        (draw_matrix(confusion_by_site(outcomes)), "Sites: truth down, first site of the diagnosis across."),
        (draw_matrix(confusion(outcomes)), "Effects: truth down, verdict across; single effects only."),
        (draw_sizes(by_size(outcomes)), "Right verdicts on single effects against residual to noise."),
        (draw_reliability(reliability(outcomes)), "Right verdicts against the probability that they state."),
    )
    return "\n".join(picture(data, caption) for data, caption in drawn)


def picture(data: bytes, caption: str) -> str:
    """One figure with its caption."""
    text = html.escape(caption)
    image = f'<img alt="{text}" src="data:image/png;base64,{base64.b64encode(data).decode()}">'
    return f"<figure>{image}<figcaption>{text}</figcaption></figure>"


def draw_matrix(matrix: Matrix) -> bytes:
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
    return as_png(canvas)


def draw_sizes(bins: Sequence[Bin]) -> bytes:
    """Accuracy against size."""
    canvas = figure(6.0, 3.2)
    axis = canvas.subplots()
    shares(axis, bins)
    axis.axvline(VISIBLE, color="0.4", linestyle=":", label="size from which an effect counts")
    axis.set(xscale="symlog", xlabel="residual to noise", ylabel="right effect first", ylim=(-0.06, 1.05))
    axis.set_xlim(left=-0.1)
    axis.legend(loc="center right")
    return as_png(canvas)


def draw_reliability(bins: Sequence[Bin]) -> bytes:
    """Stated against observed probability."""
    canvas = figure(4.2, 4.0)
    axis = canvas.subplots()
    axis.plot([0.0, 1.0], [0.0, 1.0], color="0.4", linestyle=":", label="perfectly calibrated")
    shares(axis, bins)
    axis.set(xlabel="probability stated", ylabel="share right", xlim=(0.0, 1.02), ylim=(-0.03, 1.05))
    axis.legend(loc="upper left")
    return as_png(canvas)


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


def as_png(canvas: Any) -> bytes:
    """A figure as a picture."""
    buffer = io.BytesIO()
    canvas.savefig(buffer, format="png")
    return buffer.getvalue()
