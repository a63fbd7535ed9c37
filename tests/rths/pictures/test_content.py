"""The pictures show the contents of the recording."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pytest

from common.recording.run import Run
from common.roles import SLAVE
from report.facts.laboratories import laboratories
from report.facts.summary import SEGMENTS, tracking
from report.pictures import PICTURES, curves, hysteresis, spectra
from report.pictures.figure import COLOURS
from rths.examine import plot
from tests.rths.pictures.made_up import INTERVAL, made_up, sinusoid, with_latency


def drawn(run: Run, name: str) -> Any:
    """The figure of a picture, laid out."""
    canvas = plot.draw(run, SLAVE, PICTURES[name])
    assert canvas is not None
    canvas.draw_without_rendering()
    return canvas


@pytest.mark.parametrize("storeys", [2, 3, 12])
def test_every_floor_has_its_own_number_and_colour(storeys: int) -> None:
    canvas = drawn(made_up(storeys), "histories")
    (axis,) = [axis for axis in canvas.axes if axis.get_ylabel().startswith("floor")]
    legend = axis.get_legend()
    colours = [line.get_color() for line in axis.lines]
    assert legend.get_title().get_text() == "floor"
    assert [text.get_text() for text in legend.get_texts()] == [str(place + 1) for place in range(storeys)]
    assert [line.get_color() for line in legend.get_lines()] == colours
    assert len({str(colour) for colour in colours}) == storeys
    assert (colours[0] == COLOURS[0]) == (storeys <= len(COLOURS))
    heights = [line.get_zorder() for line in axis.lines]
    assert heights == sorted(heights, reverse=True)
    texts = [text.get_window_extent() for text in legend.get_texts()]
    assert min(box.y0 for box in texts) >= axis.bbox.y1
    assert max(box.x1 for box in texts) <= canvas.bbox.x1


def test_one_storey_needs_no_legend() -> None:
    assert all(axis.get_legend() is None for axis in drawn(made_up(1), "histories").axes)


@pytest.mark.parametrize("name", ["tracking", "synchronisation", "spectra"])
def test_legends_are_above_the_curves(name: str) -> None:
    canvas = drawn(made_up(), name)
    legends = [(axis, axis.get_legend()) for axis in canvas.axes if axis.get_legend()]
    assert legends
    for axis, legend in legends:
        texts = [text.get_window_extent() for text in legend.get_texts()]
        assert min(box.y0 for box in texts) >= axis.bbox.y1
        assert max(box.x1 for box in texts) <= canvas.bbox.x1


def test_exact_tracking_gives_no_error_whatever_tick_a_target_belongs_to() -> None:
    column, table = curves.pairs(sinusoid(2.0, 5e-3))
    assert np.max(np.abs(column.error)) == 0.0
    assert np.max(np.abs(table.error)) < 1e-15
    assert table.t.size == column.t.size - 1
    assert table.t[0] == INTERVAL


@pytest.mark.parametrize(("delay", "gain"), [(0.0, 1.1), (0.02, 1.0), (0.012, 0.93)])
def test_the_synchronisation_plots_slope_shows_the_amplitude_and_its_area_the_delay(
    delay: float, gain: float
) -> None:
    run = sinusoid(2.0, 5e-3, delay, gain)
    phase = 2.0 * math.pi * 2.0 * delay
    for axis in drawn(run, "synchronisation").axes:
        whole = axis.lines[0]
        x, y = whole.get_xdata(), whole.get_ydata()
        centre = np.interp(0.0, *np.array(sorted(zip(x[:250], y[:250], strict=True))).T)
        assert np.max(np.abs(y)) / np.max(np.abs(x)) == pytest.approx(gain, rel=1e-3)
        assert np.polyfit(x, y, 1)[0] == pytest.approx(gain * math.cos(phase), rel=1e-3)
        area = abs(np.trapezoid(y[:251], x[:251]))  # one period
        assert area == pytest.approx(math.pi * 25.0 * gain * math.sin(phase), rel=1e-3, abs=1e-6)
        assert abs(centre) <= 5.0 * gain * math.sin(phase) * 1.01 + 1e-9


def test_the_synchronisation_plot_and_inspect_give_the_same_figures() -> None:
    run = sinusoid(2.0, 5e-3, 0.018, 0.97)
    found: dict[str, Any] = tracking(run, laboratories(run))
    for axis, part in zip(drawn(run, "synchronisation").axes, ("actuator", "table"), strict=True):
        said = " ".join(text.get_text() for text in axis.texts)
        assert f"delay {1e3 * found[part]['delay']:.2f} ms" in said
        assert f"amplitude {found[part]['amplitude']:.3f}" in said
        assert f"NRMSE {100.0 * found[part]['nrmse']:.1f} %" in said
        assert found[part]["delay"] == pytest.approx(0.018, abs=1e-4)


def test_missing_ticks_do_not_shift_targets() -> None:
    run = sinusoid(2.0, 5e-3)
    keep = np.delete(np.arange(20_000), np.arange(3_000, 3_100))
    for topic, columns in run.columns.items():
        run.columns[topic] = {name: values[keep] for name, values in columns.items()}
        run.sequences[topic] = keep
    column, table = curves.pairs(run)
    assert column.t.size == keep.size
    assert table.t.size == keep.size - 2  # the first and the one behind the hole have no target
    assert np.max(np.abs(table.error)) < 1e-15


def test_without_targets_the_command_is_shown_at_its_own_tick() -> None:
    run = sinusoid(2.0, 5e-3)
    master, slave = run.columns["master"], run.columns["slave"]
    del master["column_target"]
    master["actuator_command"] = slave["table_command"] = slave.pop("table_target")
    found = curves.pairs(run)
    assert [pair.word for pair in found] == ["command", "command"]
    assert all(np.max(np.abs(pair.error)) < 1e-15 for pair in found)
    axis = drawn(run, "tracking").axes[0]
    assert [text.get_text() for text in axis.get_legend().get_texts()] == ["command", "measured"]


@pytest.mark.parametrize("frequency", [0.7, 2.0, 13.3])
def test_a_spectrum_has_the_frequency_and_the_mean_square_of_the_sinusoid(frequency: float) -> None:
    run = sinusoid(frequency, 5e-3, 0.01)
    shown = {line.get_label(): line for line in drawn(run, "spectra").axes[0].lines}
    lines = {line.label: line for line in spectra.displacements(run)}
    assert shown.keys() == lines.keys() == {"column", "table", "error of column", "error of table"}
    error = 2.0 * math.sin(math.pi * frequency * 0.01) * 5.0
    for label, amplitude in (
        ("column", 5.0),
        ("table", 5.0),
        ("error of column", error),
        ("error of table", error),
    ):
        f, density = spectra.amplitude_density(lines[label].found)
        density *= 1e3
        step = f[1] - f[0]
        assert step == pytest.approx(0.1)
        assert f[np.argmax(density)] == pytest.approx(frequency, abs=0.5 * step)
        mean_square = float(np.sum(density**2) * step)
        assert math.sqrt(2.0 * mean_square) == pytest.approx(amplitude, rel=5e-3)
        place = int(np.argmax(shown[label].get_ydata()))
        assert shown[label].get_xdata()[place] == pytest.approx(frequency, rel=0.06)  # half a band and a line


def test_averaging_spectral_lines_over_a_band_keeps_their_mean_square() -> None:
    f = np.arange(0.1, 250.0, 0.1)
    density = np.abs(np.random.default_rng(1).normal(size=f.size))
    at, level = spectra.averaged(f, density)
    assert at[:9] == pytest.approx(f[:9])  # single lines at low frequencies
    assert level[:9] == pytest.approx(density[:9])
    assert at.size < 90
    assert np.ptp(level[-20:]) < 0.2 * np.ptp(density[-200:])  # no solid noise
    widths = np.diff(np.floor(24 * np.log10(f)), prepend=-99.0)
    counts = np.diff(np.flatnonzero(widths), append=f.size)
    assert np.sum(counts * level**2) == pytest.approx(np.sum(density**2))


def test_the_natural_frequency_is_that_of_the_plan(virtual_recording: Any) -> None:
    from common.recording.reader import read

    run = read(virtual_recording)
    (found,) = spectra.natural_frequencies(run)
    assert found == pytest.approx(math.sqrt(25e6 / 160e3) / (2.0 * math.pi), rel=1e-9)
    assert any(f"natural {found:.2f} Hz" == line.get_label() for line in drawn(run, "spectra").axes[0].lines)
    del run.columns["master"]["ground_acceleration"]
    assert spectra.natural_frequencies(run) == []  # nothing shook: a bench test


def test_the_absorbed_energy_is_the_area_of_the_loop() -> None:
    t = np.arange(20_000) * INTERVAL
    omega = 2.0 * math.pi * 0.5
    x, speed = 3e-3 * np.sin(omega * t), 3e-3 * omega * np.cos(omega * t)
    energy, doubt = hysteresis.absorbed(x, 12.5e6 * x + 2e5 * speed)
    assert energy == pytest.approx(20 * math.pi * 2e5 * omega * 3e-3**2, rel=1e-3)
    assert doubt < 1e-3 * energy


def test_the_uncertainty_of_a_loops_energy_is_that_of_an_elastic_loop_under_noise() -> None:
    draw, t = np.random.default_rng(3), np.arange(5_000) * INTERVAL
    x = 2e-3 * np.sin(4.0 * math.pi * t) * np.exp(-t / 3.0)
    found = [
        hysteresis.absorbed(
            x + 5e-6 * draw.standard_normal(t.size), 12.5e6 * x + 100.0 * draw.standard_normal(t.size)
        )
        for _ in range(300)
    ]
    energies, doubts = np.array(found).T
    assert abs(np.mean(energies)) < np.std(energies)
    assert np.std(energies) == pytest.approx(0.5 * np.mean(doubts), rel=0.15)


def test_the_latency_segments_are_rows_with_their_percentiles() -> None:
    run = with_latency(made_up())
    upper, lower = drawn(run, "latency").axes
    assert [text.get_text().replace(" ", "_") for text in upper.get_yticklabels()] == list(SEGMENTS)
    lines = {line.get_label(): line for line in upper.lines}
    for place, name in enumerate(SEGMENTS):
        spread = 1e6 * run.columns["latency"][name]
        for label, share in (("p50", 50), ("p99", 99), ("p99.9", 99.9), ("max", 100)):
            assert lines[label].get_xdata()[place] == pytest.approx(np.percentile(spread, share))
    assert lines["interval 2 ms"].get_xdata()[0] == pytest.approx(2000.0)
    late = {line.get_label(): line for line in lower.lines}["late"]
    assert len(late.get_xdata()) == np.count_nonzero(run.columns["latency"]["deadline_missed"]) > 0
    assert {line.get_label(): line for line in lower.lines}["longest"].get_ydata().max() == pytest.approx(
        1e6 * run.columns["latency"]["round_trip"].max()
    )


def still(run: Run) -> None:
    run.columns["master"]["t"][:] = run.columns["slave"]["t"][:] = 1.0


def leaping(run: Run) -> None:
    run.columns["master"]["t"][-1] = run.columns["slave"]["t"][-1] = 1e9


def huge(run: Run) -> None:
    for topic in ("master", "slave"):
        for name, values in run.columns[topic].items():
            if name not in ("seq", "t") and values.dtype.kind == "f":
                values[:] = values * 1e100


@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.parametrize("spoil", [still, leaping, huge])
def test_a_recording_of_extreme_values_does_not_crash_a_command(spoil: Any, name: str) -> None:
    run = sinusoid(1.0, 1e-3)
    spoil(run)
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a layout that long numbers leave no room
        canvas = plot.draw(run, SLAVE, PICTURES[name])
        if canvas is not None:
            canvas.draw_without_rendering()
            assert canvas.axes
