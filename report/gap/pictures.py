"""The pictures of a diagnosis: each function takes its part of the report and returns one SVG."""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.report.evidence import History, NaturalCurve, PartSeen, Reading, Step
from diagnosis.report.fields import Series
from diagnosis.report.records import Tolerance
from report.gap import wording
from report.pictures.figure import COLOURS, STAMPS, figure, fit_labels
from report.text.formats import axis_unit, bare_percent, known, scale

Values = NDArray[np.float64]

WIDTH = 3.6  # inches: one column of the page, or a phone's screen, so that text keeps its size
BLUE, ORANGE, GREEN = COLOURS[:3]
INK = "black"  # becomes the page's own text colour
GREY = "#808080"
RECORDED, BEFORE, AFTER = INK, ORANGE, BLUE
MOST_PARTS = len(COLOURS)
TIME, ROWS = "time, s", "row"  # abscissas of histories
LEVEL = "noise"  # beginning of the label of a step that is a level, not a change
# S around the largest error: eight periods of a building of 2 Hz, in which single cycles can be seen.
ZOOM = 4.0


def svg(canvas: Any) -> str:
    """A figure as SVG for a page: black and blue follow the page's colours, and there is no background."""
    if not fit_labels(canvas):
        canvas.set_layout_engine("none")  # or saving draws it once more to place its axes
    stream = io.StringIO()
    canvas.savefig(stream, format="svg", transparent=True, metadata=STAMPS[".svg"])
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r'<g id="[^"]*"', "<g", text)
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    text = text.replace("<svg ", '<svg fill="currentColor" aria-hidden="true" ', 1)
    text = text.replace(": #000000", ": currentColor")
    return text.replace(f": {BLUE.lower()}", f": var(--curve, {BLUE.lower()})")


def values(numbers: Sequence[object]) -> Values:
    """Numbers of a report as an array, NaN where one is missing."""
    return np.array([item if known(item) else np.nan for item in numbers], dtype=float)


def pair(first: Sequence[object], second: Sequence[object]) -> tuple[Values, Values]:
    """Two series of one length; both empty where one is absent or holds no number."""
    one, two = values(first), values(second)
    size = min(one.size, two.size)
    usable = bool(np.isfinite(one[:size] + two[:size]).any())
    return (one[:size], two[:size]) if usable else (one[:0], two[:0])


def literal(text: str) -> str:
    """Text without characters that the drawing library would interpret."""
    return text.replace("$", r"\$")


def wrapped(text: str, width: int) -> str:
    """Text in lines of at most this many characters."""
    return literal("\n".join(textwrap.wrap(text, width)))


def legend(canvas: Any, *axes: Any) -> None:
    """A legend above the axes, where no curve runs."""
    found = [axis.get_legend_handles_labels() for axis in dict.fromkeys(axes)]
    handles = [handle for item in found for handle in item[0]]
    labels = [label for item in found for label in item[1]]
    if handles:
        columns = 3 if len(handles) != 4 else 2
        place = "outside upper left"
        canvas.legend(
            handles, labels, loc=place, ncols=columns, handlelength=1.6, borderpad=0.1, markerscale=2.0
        )


def floor_line(axis: Any, level: float, label: str) -> None:
    """A noise floor, named at the line."""
    axis.axhline(level, color=GREY, linestyle="--", linewidth=0.9)
    axis.annotate(
        label,
        (1.0, level),
        (0, -2),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="right",
        va="top",
        color=GREY,
        fontsize=7,
    )


def logarithmic(axis: Any, lowest: float | None = None) -> None:
    """A logarithmic ordinate of at least a decade, with plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_yscale("log")
    low, high = axis.get_ylim()
    low = low if lowest is None else lowest
    high = max(1.3 * high, 12.0 * low)
    axis.set_ylim(low, high)
    axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0) if high / low < 1e3 else (1.0,)))
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))
    axis.yaxis.set_minor_formatter(NullFormatter())


def residual_time(parts: Sequence[PartSeen]) -> str:
    """Residual over noise of every part over time; empty where no part has windows."""
    return ratios([(part.site, *pair(part.windows.t, part.windows.ratio)) for part in parts], TIME)


def residual_amplitude(parts: Sequence[PartSeen]) -> str:
    """Residual over noise against the amplitude of the motion; empty where no part has it."""
    found = [(part.site, *pair(part.amplitudes.amplitude, part.amplitudes.ratio)) for part in parts]
    shares = [
        (site, 100.0 * x / (np.nanmax(np.abs(x), initial=0.0) or 1.0), ratio) for site, x, ratio in found
    ]
    return ratios(shares, "amplitude of the part's motion, % of its largest")


def ratios(curves: Sequence[tuple[str, Values, Values]], across: str) -> str:
    """Residual over noise of sites over the quantity named `across`; empty where no site has values."""
    drawn = [curve for curve in curves if curve[1].size][:MOST_PARTS]
    if not drawn:
        return ""
    canvas = figure(WIDTH, 2.4)
    axis = canvas.subplots()
    for site, x, ratio in drawn:
        axis.plot(x, ratio, "o-" if x.size < 40 else "-", markersize=3, label=literal(wording.site(site)))
    axis.set(xlabel=across, ylabel="residual / noise floor")
    logarithmic(axis, 0.3)
    floor_line(axis, 1.0, "noise floor")
    legend(canvas, axis)
    return svg(canvas)


def residual_frequency(part: PartSeen) -> str:
    """Residual and noise of one part over frequency; empty where there is none."""
    bands = part.bands
    frequency, residual = pair(bands.frequency, bands.residual)
    if not frequency.size:
        return ""
    canvas = figure(WIDTH, 2.4)
    axis = canvas.subplots()
    factor, unit = density_unit(part, float(np.max(residual)))
    residual = factor * residual
    axis.plot(frequency, residual, color=ORANGE, label="residual")
    spots, noise = pair(bands.frequency, bands.noise)
    noise = factor * noise
    if spots.size:
        axis.plot(spots, noise, color=GREY, linestyle="--", label="noise floor")
        size = min(residual.size, noise.size)
        above = residual[:size] > noise[:size]
        axis.fill_between(spots[:size], noise[:size], residual[:size], where=above, color=ORANGE, alpha=0.2)
    axis.set(xlabel="frequency, Hz", ylabel=f"amplitude density\n{literal(unit)}")
    logarithmic(axis)
    legend(canvas, axis)
    return svg(canvas)


def density_unit(part: PartSeen, most: float) -> tuple[float, str]:
    """Factor and unit in which a part's amplitude density reads well, if its signals have a unit in common."""
    units = {item.unit for item in part.signals}
    if len(units) != 1:
        return 1.0, "SI"
    factor, unit = scale(most, units.pop())
    return factor, f"{unit or '1'}/√Hz"


def worst(t: Values, error: Values) -> slice:
    """The stretch of `ZOOM` s with the largest error, `t` in s."""
    steps = np.diff(t)
    usual = float(np.nanmedian(steps)) if steps.size else 0.0
    count = round(ZOOM / usual) if usual > 0.0 else t.size
    if not 1 < count < t.size:
        return slice(0, t.size)
    energy = np.concatenate(([0.0], np.cumsum(np.nan_to_num(error) ** 2)))
    begin = int(np.argmax(energy[count:] - energy[:-count]))
    return slice(begin, begin + count)


def prediction(item: Reading, across: str = TIME) -> str:
    """A part's reading beside its model's prediction without and with the effect, and the errors of both."""
    models = (
        (item.nominal, BEFORE, "without the effect"),
        (item.corrected, AFTER, "with the effect"),
    )
    return overlay(item, across, models, item.noise_floor)


def history(item: History, across: str = TIME) -> str:
    """A signal of the whole test as recorded, simulated before and after, at the worst seconds."""
    models = ((item.before, BEFORE, "simulated before"), (item.after, AFTER, "simulated after"))
    return overlay(item, across, models)


def overlay(
    item: Reading | History,
    across: str,
    models: Sequence[tuple[Series, str, str]],
    noise: float | None = None,
) -> str:
    """Curves above, their errors below with the noise floor; empty where nothing is recorded.

    `across` names the abscissa; over anything but time all of it is drawn.
    """
    called, truth = ("measured", item.measured) if isinstance(item, Reading) else ("recorded", item.recorded)
    t, recorded = pair(item.t, truth)
    if not t.size:
        return ""
    curves = [(values(series), colour, label) for series, colour, label in models]
    drawn = [(curve, colour, label) for curve, colour, label in curves if curve.size == t.size]
    timed = bool(drawn) and across == TIME
    part = worst(t, drawn[0][0] - recorded) if timed else slice(0, t.size)
    factor, unit = scale(float(np.nanmax(np.abs(recorded[part]))), item.unit)
    canvas = figure(WIDTH, 3.2 if drawn else 2.0)
    upper, lower = panels(canvas, bool(drawn))
    upper.plot(t[part], factor * recorded[part], color=RECORDED, linewidth=2.6, alpha=0.45, label=called)
    for curve, colour, label in drawn:
        style = "--" if colour == BEFORE else "-"
        upper.plot(t[part], factor * curve[part], style, color=colour, label=label)
        lower.plot(t[part], factor * (recorded - curve)[part], style, color=colour, linewidth=0.8)
    upper.set_ylabel(literal(f"{wording.plain(item.signal)}\n{unit}"))
    lower.set_xlabel(across)
    finish_errors(lower, factor, unit, noise, bool(drawn))
    legend(canvas, upper, lower)
    return svg(canvas)


def panels(canvas: Any, errors: bool) -> tuple[Any, Any]:
    """Axes for the curves and for their errors; the same where there are no errors."""
    if errors:
        upper, lower = canvas.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        return upper, lower
    axis = canvas.subplots()
    return axis, axis


def finish_errors(axis: Any, factor: float, unit: str, noise: float | None, errors: bool) -> None:
    """The label of the axes of errors, and the noise floor as a band."""
    if not errors:
        return
    if noise is not None:
        axis.axhspan(
            -factor * noise, factor * noise, color=GREY, alpha=0.35, linewidth=0, label="noise floor"
        )
    axis.set_ylabel(literal(f"residual\n{unit}"))


def curve(item: NaturalCurve, names: tuple[str, str] = ("without the effect", "with the effect")) -> str:
    """A relation in its natural coordinates: measured, before, after; empty where nothing is measured."""
    x = values(item.x.values)
    series = [
        (values(item.measured), GREY, "measured"),
        (values(item.before), BEFORE, names[0]),
        (values(item.after), AFTER, names[1]),
    ]
    drawn = [found for found in series if found[0].size == x.size and np.isfinite(found[0]).any()]
    if not x.size or not drawn:
        return ""
    x_factor, x_label = axis_unit(item.x.label, float(np.nanmax(np.abs(x))))
    most = max(float(np.nanmax(np.abs(y))) for y, _colour, _label in drawn)
    y_factor, y_label = axis_unit(item.y.label, most)
    x, drawn = x_factor * x, [(y_factor * y, colour, label) for y, colour, label in drawn]
    canvas = figure(WIDTH, 3.0)
    axis = canvas.subplots()
    low, high = (y_factor * values(series) for series in (item.low, item.high))
    if low.size == high.size == x.size:
        axis.vlines(x, low, high, color=AFTER, alpha=0.05, linewidth=1.2, rasterized=True)
        axis.plot([], [], color=AFTER, alpha=0.3, linewidth=5, label="band of 95 %")
    steady = bool(np.all(np.diff(x) >= 0.0))
    for y, colour, label in drawn:
        if steady and colour != GREY:
            axis.plot(x, y, color=colour, label=label, linewidth=1.4)
        else:
            size = 9 if colour == GREY else 3
            axis.scatter(x, y, size, color=colour, label=label, linewidths=0, rasterized=True)
    axis.set(xlabel=literal(x_label))
    axis.set_ylabel(literal(y_label))
    legend(canvas, axis)
    return svg(canvas)


def waterfall(steps: Sequence[Step]) -> str:
    """The overall gap after each step, down to the noise floor; empty where there are no steps."""
    found = [(item.label, item.value) for item in steps if item.value is not None]
    if not found:
        return ""
    canvas = figure(WIDTH, 0.7 + 0.36 * len(found))
    axis = canvas.subplots()
    previous = 0.0
    top = max(value for _label, value in found)
    for place, (label, value) in enumerate(found):
        low, high, colour = block(label, value, previous)
        axis.barh(place, 100.0 * (high - low), left=100.0 * low, height=0.62, color=colour)
        if place and not label.startswith(LEVEL):
            axis.plot([100.0 * previous] * 2, [place - 0.69, place + 0.31], color=GREY, linewidth=0.7)
        axis.text(
            100.0 * (max(high, value) + 0.015 * top), place, literal(f"{bare_percent(value)} %"), va="center"
        )
        previous = value
    axis.set_yticks(range(len(found)), [wrapped(label, 24) for label, _value in found])
    axis.set(xlabel="overall gap, % of the recorded signals (rms)", xlim=(0.0, 118.0 * top or 1.0))
    axis.invert_yaxis()
    axis.grid(visible=False, axis="y")
    return svg(canvas)


def block(label: str, value: float, previous: float) -> tuple[float, float, str]:
    """A bar's ends and colour: whole for a level, the change for a step."""
    if label.startswith(LEVEL):
        return 0.0, value, GREY
    if not previous:
        return 0.0, value, ORANGE
    return min(value, previous), max(value, previous), GREEN if value <= previous else ORANGE


def tolerance_moves(entries: Sequence[tuple[str, Tolerance]]) -> str:
    """How far nominal parameters moved, in standard deviations of their tolerances."""
    found = [(name, item.z) for name, item in entries if item.z is not None][:12]
    if not found:
        return ""
    canvas = figure(WIDTH, 0.7 + 0.22 * len(found))
    axis = canvas.subplots()
    axis.axvspan(-1.0, 1.0, color=GREY, alpha=0.2, linewidth=0)
    for place, (_name, z) in enumerate(found):
        colour = BLUE if abs(z) <= wording.NOTABLE else ORANGE
        axis.plot([0.0, z], [place, place], color=colour, linewidth=1.2)
        axis.plot(z, place, "o", color=colour, markersize=4)
    axis.set_yticks(range(len(found)), [literal(name) for name, _z in found])
    reach = max(3.0, *(1.1 * abs(z) for _name, z in found))
    limits = {"xlim": (-reach, reach), "ylim": (len(found) - 0.5, -0.5)}
    axis.set(xlabel="move, standard deviations of the tolerance", **limits)
    return svg(canvas)
