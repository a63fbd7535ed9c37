"""Every picture at either width has named axes with units and readable letters, and is reproducible."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.recording.reader import read
from common.recording.run import Run
from common.roles import SLAVE
from report.pictures import PICTURES, figure
from rths.examine import plot
from tests.rths.pictures.axes import check_axes, hidden, texts
from tests.rths.pictures.made_up import made_up, with_latency

LEAST_LETTER = 6.0  # pt in print
UNITS = ("s", "Hz", "m/s²", "mm", "kN", "N", "m/s²/√Hz", "mm/√Hz", "µs")
OF_WORDS = {"part of a tick"}  # axes whose ticks are names


@pytest.fixture(scope="module", params=plot.WIDTHS)
def width(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def recording(virtual_recording: Path) -> Run:
    """A complete test with latencies, which virtual time lacks."""
    return with_latency(read(virtual_recording))


@pytest.fixture(scope="module")
def canvases(recording: Run, width: str) -> dict[str, Any]:
    """Every picture, laid out in its own resolution."""
    made: dict[str, Any] = {
        name: plot.draw(recording, SLAVE, picture, width) for name, picture in PICTURES.items()
    }
    assert all(made.values())
    for canvas in made.values():
        canvas.draw_without_rendering()
    return made


@pytest.mark.slow
def test_every_axis_has_a_label_with_its_unit(canvases: dict[str, Any]) -> None:
    for name, canvas in canvases.items():
        for axis in canvas.axes:
            below = axis.xaxis.get_tick_params()["labelbottom"]
            labels = [axis.get_ylabel(), *([axis.get_xlabel()] if below else [])]
            for label in labels:
                unit = re.split(r", |\n", label)[-1]
                assert label in OF_WORDS or unit in UNITS, f"{name}: '{label}'"
                assert label not in UNITS


def test_every_letter_is_large_enough_to_be_read_in_print(canvases: dict[str, Any], width: str) -> None:
    inches = {"single": figure.SINGLE, "double": figure.DOUBLE}[width]
    for name, canvas in canvases.items():
        assert canvas.get_figwidth() == inches  # or the page would scale it
        for text in texts(canvas):
            assert text.get_fontsize() >= LEAST_LETTER, f"{name}: {text.get_text()}"
            assert "$" not in text.get_text(), "mathematical text has smaller superscripts"


def test_nothing_is_cut_off_and_no_axis_shows_a_factor(canvases: dict[str, Any]) -> None:
    for name, canvas in canvases.items():
        check_axes(canvas, name)


def test_the_axis_of_a_small_signal_shows_no_factor(recording: Run, width: str) -> None:
    quiet = replace(recording, columns={topic: dict(of) for topic, of in recording.columns.items()})
    for of in quiet.columns.values():
        for name, values in of.items():
            if name not in ("seq", "t") and values.dtype == np.float64:
                of[name] = 1e-4 * values + (5.0 if name == "damper_force" else 0.0)
    for name in ("histories", "hysteresis", "tracking", "synchronisation"):
        canvas = plot.draw(quiet, SLAVE, PICTURES[name], width)
        assert canvas is not None
        canvas.draw_without_rendering()
        check_axes(canvas, name)


def test_labels_of_one_axis_do_not_overlap(canvases: dict[str, Any]) -> None:
    for name, canvas in canvases.items():
        for axis in canvas.axes:
            unseen = {id(label) for label in hidden(axis)}
            for labels, ends in ((axis.get_xticklabels(), "x"), (axis.get_yticklabels(), "y")):
                boxes = [
                    getattr(label.get_window_extent(), f"interval{ends}")
                    for label in labels
                    if label.get_text() and id(label) not in unseen and label.get_visible()
                ]
                boxes.sort(key=lambda pair: pair[0])
                assert all(a[1] <= b[0] for a, b in pairwise(boxes)), f"{name}: {ends}"


def test_lines_of_one_axis_differ_in_more_than_their_colour(canvases: dict[str, Any]) -> None:
    for name in ("tracking", "spectra", "latency"):
        for axis in canvases[name].axes:
            found = [line for line in axis.lines if not line.get_label().startswith("_")]
            looks = [(line.get_linestyle(), line.get_marker(), str(line._dash_pattern)) for line in found]
            shared = [look for look in looks if looks.count(look) > 1]
            assert len(shared) in (0, 2), (
                f"{name}: {looks}"
            )  # errors are dotted both, in their system's colours


@pytest.mark.slow
@pytest.mark.parametrize("ending", plot.FORMATS)
def test_the_same_recording_gives_the_same_file(ending: str, tmp_path: Path) -> None:
    run = with_latency(made_up(3))
    some = PICTURES if ending == "png" else {"tracking": PICTURES["tracking"]}
    for name, picture in some.items():
        files = [tmp_path / f"{name}-{place}.{ending}" for place in (1, 2)]
        drawn = [plot.save(run, SLAVE, picture, file) for file in files]
        assert drawn == [name != "hysteresis"] * 2  # it needs forces
        if all(drawn):
            assert files[0].read_bytes() == files[1].read_bytes()


def test_a_saved_picture_is_as_wide_as_a_column(tmp_path: Path) -> None:
    plot.save(made_up(), SLAVE, PICTURES["tracking"], tmp_path / "a.svg")
    plot.save(made_up(), SLAVE, PICTURES["tracking"], tmp_path / "a.png")
    wide = re.search(r'<svg[^>]* width="([\d.]+)pt"', (tmp_path / "a.svg").read_text())
    assert wide is not None
    assert float(wide[1]) == pytest.approx(72.0 * figure.SINGLE)
    header = (tmp_path / "a.png").read_bytes()[16:20]
    assert int.from_bytes(header) == round(figure.SINGLE * figure.DOTS)


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_left_out_if_its_signals_are_missing(name: str) -> None:
    run = made_up()
    for topic in run.columns:
        run.columns[topic] = {"t": run.columns[topic]["t"]}
    assert plot.draw(run, SLAVE, PICTURES[name]) is None
    run.columns = {}
    assert plot.draw(run, SLAVE, PICTURES[name]) is None


@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.parametrize("value", [np.nan, 0.0])
def test_signals_without_motion_do_not_break_a_picture(name: str, value: float) -> None:
    run = with_latency(made_up())
    for columns in run.columns.values():
        for signal in columns.keys() - {"t", "seq", "deadline_missed"}:
            columns[signal] = np.full(500, value)
    canvas = plot.draw(run, SLAVE, PICTURES[name])
    assert (canvas is not None) == (name == "histories" and value == 0.0)


@pytest.mark.parametrize("name", PICTURES)
@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_test_that_ended_at_once_does_not_break_a_picture(name: str, count: int, tmp_path: Path) -> None:
    run = with_latency(made_up())
    for topic, columns in run.columns.items():
        run.columns[topic] = {signal: values[:count] for signal, values in columns.items()}
        if topic in run.sequences:
            run.sequences[topic] = run.sequences[topic][:count]
    drawn = plot.save(run, SLAVE, PICTURES[name], tmp_path / "short.png")
    assert (tmp_path / "short.png").exists() == drawn


@pytest.mark.parametrize("name", PICTURES)
def test_single_readings_may_be_nan(name: str, tmp_path: Path) -> None:
    run = with_latency(made_up())
    for columns in run.columns.values():
        for signal in columns.keys() - {"t", "seq", "deadline_missed"}:
            columns[signal] = columns[signal].copy()
            columns[signal][100:130] = np.nan
    assert plot.save(run, SLAVE, PICTURES[name], tmp_path / "gaps.png") == (name != "hysteresis")


@pytest.mark.parametrize("name", ["histories", "synchronisation", "tracking", "spectra"])
def test_a_picture_of_fewer_signals_has_a_smaller_height(name: str) -> None:
    whole, part = made_up(), made_up()
    part.columns["slave"] = {"t": part.columns["slave"]["t"]}
    del part.columns["master"]["absolute_acceleration"]
    canvases: list[Any] = [plot.draw(run, SLAVE, PICTURES[name]) for run in (whole, part)]
    heights = [canvas.get_figheight() for canvas in canvases]
    assert (heights[1] < heights[0]) == (name != "spectra")  # of which both have displacements only
