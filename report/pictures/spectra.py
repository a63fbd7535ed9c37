"""Amplitude density over frequency: of the ground motion, the response and the tracking errors.

The density is the square root of the power spectral density by Welch's method (The use of fast Fourier transform for
the estimation of power spectra, IEEE Trans. Audio Electroacoust. 15, 1967), one-sided, so that the integral of its
square is the mean square over the whole test.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from common.recording.run import Run
from common.roles import MASTER
from report.pictures.curves import Curve, Values, curve, interval, labs_of, moving, pairs, planned
from report.pictures.figure import COLOURS
from report.pictures.layout import bound, decades, legend_above, shrink

if TYPE_CHECKING:
    from report.facts.laboratories import LaboratoryFacts

SEGMENT = 10.0  # s: lines 0.1 Hz apart, half the width of a peak at 2 Hz with 5 % of damping
LEAST = 64  # ticks without which no spectrum is drawn: fewer give less than two decades of frequency
HOLES = 4  # longest mean distance of recorded ticks, in intervals: more holes than that make a spectrum meaningless
RANGE = 1e6  # ratio of the ends of the ordinate: lower densities are rounding errors
BANDS = 24  # a decade: 10 % wide, as wide as a peak with 5 % of damping
MODES = 3  # natural frequencies that are marked: more lines would hide the curves
DASHED = (0, (4, 2))
DOTTED = (0, (1, 1))


class SpectrumLine(NamedTuple):
    """One spectrum and how it looks."""

    label: str
    found: Curve
    factor: float
    colour: str
    style: Any


def draw(recording: Run, canvas: Any) -> bool:
    """Accelerations above, displacements and tracking errors below; False where all are lacking or too short."""
    groups = [
        ("acceleration\nm/s²/√Hz", accelerations(recording)),
        ("displacement\nmm/√Hz", displacements(recording)),
    ]
    present = [(label, lines) for label, lines in groups if lines]
    if not present:
        return False
    natural = natural_frequencies(recording)
    shrink(canvas, len(present), len(groups))
    axes = canvas.subplots(len(present), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (label, lines) in zip(axes, present, strict=True):
        densities(axis, lines)
        axis.set_ylabel(label)
        mark(axis, natural, with_label=axis is axes[0])
        legend_above(axis)
    axes[-1].set_xlabel("frequency, Hz")
    decades(axes[-1].xaxis)
    canvas.align_ylabels(axes)
    return True


def accelerations(recording: Run) -> list[SpectrumLine]:
    """Spectra of the ground's acceleration and of those measured in the laboratories."""
    found = [("ground", moving(recording, MASTER, "ground_acceleration"), COLOURS[0], "-")]
    for lab in labs_of(recording):
        measured = [signal.name for signal in lab.channels.measured if signal.unit == "m/s²"]
        for name in measured:
            label = lab.name if len(measured) == 1 else name.replace("_", " ") + lab.letter
            found.append((label, moving(recording, lab.topic, name), *drawn(lab)))
    return [
        SpectrumLine(label, item, 1.0, colour, style)
        for label, item, colour, style in found
        if item is not None and long_enough(item)
    ]


def displacements(recording: Run) -> list[SpectrumLine]:
    """Spectra of the measured displacements and, dotted in the same colour, of their tracking errors."""
    lines = []
    for lab in labs_of(recording):
        item = moving(recording, lab.topic, lab.channels.position)
        if item is not None and long_enough(item):
            lines.append(SpectrumLine(lab.name, item, 1e3, *drawn(lab)))
    for pair in pairs(recording):
        error = Curve(pair.t, pair.error)
        if long_enough(error) and np.nanmax(np.abs(pair.error)) > 0.0:
            lines.append(SpectrumLine(f"error of {pair.lab.name}", error, 1e3, drawn(pair.lab)[0], DOTTED))
    return lines


def drawn(lab: LaboratoryFacts) -> tuple[str, Any]:
    """Colour and style of a laboratory's lines."""
    return (COLOURS[0], "-") if lab.topic == MASTER else (COLOURS[1], DASHED)


def long_enough(item: Curve) -> bool:
    """Whether a signal has ticks enough for a spectrum."""
    return bool(np.isfinite(item.values).sum() >= LEAST)


def densities(axis: Any, lines: list[SpectrumLine]) -> None:
    """The spectra of an axis, over as many decades as mean something."""
    top = 0.0
    for line in lines:
        frequency, density = averaged(*amplitude_density(line.found))
        axis.loglog(
            frequency,
            line.factor * density,
            linestyle=line.style,
            color=line.colour,
            linewidth=0.6,
            label=line.label,
        )
        top = max(top, line.factor * float(density.max()))
        axis.set_xlim(frequency[0], frequency[-1])
    low, _ = axis.get_ylim()
    axis.set_ylim(max(low, top / RANGE), 2.0 * top)
    decades(axis.yaxis)


def amplitude_density(item: Curve) -> tuple[Values, Values]:
    """Frequency (m,) Hz and amplitude density (m,) in the signal's unit per √Hz, without the mean.

    Unknown ticks are bridged by straight lines. Raises ValueError where times leap or stand still.
    """
    from scipy import signal

    known = np.isfinite(item.values)
    step = interval(item.t[known])
    begin, end = item.t[known][[0, -1]]
    if not 0.0 < end - begin <= HOLES * step * known.sum():
        raise ValueError("the times of a signal are not those of regular ticks")
    even = np.interp(
        begin + step * np.arange(round((end - begin) / step) + 1), item.t[known], item.values[known]
    )
    length = min(even.size, round(SEGMENT / step))
    frequency, power = signal.welch(even, 1.0 / step, "hann", length, detrend="constant")
    return frequency[1:], np.sqrt(power[1:])


def averaged(frequency: Values, density: Values) -> tuple[Values, Values]:
    """Mean square densities over bands of equal width on a logarithmic axis, at the mean frequency of each.

    On a logarithmic axis spectral lines lie closer and closer together; single lines scatter by as much as their value,
    so that many of them look like a solid area. A band with one line keeps it unchanged.
    """
    band = np.floor(BANDS * np.log10(frequency)).astype(int)
    starts = np.flatnonzero(np.diff(band, prepend=band[0] - 1))
    count = np.diff(starts, append=frequency.size)
    power = np.add.reduceat(density**2, starts) / count
    return np.add.reduceat(frequency, starts) / count, np.sqrt(power)


def natural_frequencies(recording: Run) -> list[float]:
    """The first natural frequencies (Hz) of the planned building without damping; none without a ground motion."""
    from loop.nominal.partition import matrices
    from models.structures import shear_building

    plan = planned(recording)
    if plan is None or curve(recording, MASTER, "ground_acceleration") is None:
        return []
    periods = shear_building.modes(*matrices(plan)).periods
    return [1.0 / float(period) for period in periods[:MODES] if np.isfinite(period)]


def mark(axis: Any, natural: list[float], *, with_label: bool) -> None:
    """Upright lines at natural frequencies (Hz), the first of which represents all in a legend."""
    text = "natural " + ", ".join(f"{frequency:.2f}" for frequency in natural) + " Hz"
    for place, frequency in enumerate(natural):
        bound(axis, text if with_label and place == 0 else "", x=frequency)
