"""What stands in the pictures of `rths plot`, and where."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.recording.reader import Run
from common.roles import SLAVE
from rths import plot
from rths.figure import COLOURS, figure
from rths.summary import SEGMENTS

RECORD = "El Centro 1940 NS (1,559-point version after a zero at t = 0), dt 0.02 s, 1560 points, PGA 0.3188 g"


def made_up(storeys: int = 1, role: str = SLAVE, record: str = RECORD) -> Run:
    """A second of a test whose targets have their peak in the upper right corner of the picture."""
    t = np.arange(500) * 2e-3
    rising = 1e-3 * t * np.sin(20.0 * t)
    floors = np.outer(rising, np.arange(1, storeys + 1))
    run = Run(Path("made_up.mcap"), "test", (role,))
    run.columns = {
        "master": {
            "t": t,
            "absolute_acceleration": floors if storeys > 1 else rising,
            "column_target": rising,
            "column_displacement": rising,
        },
        role: {"t": t, "table_command": t, "table_displacement": t},
    }
    for topic in run.columns:
        run.sequences[topic], run.log_ns[topic], run.units[topic] = np.arange(t.size), np.arange(t.size), {}
    run.metadata["ground_motion"] = {"record": record, "scale": "0.1"}
    return run


@pytest.fixture
def drawn(monkeypatch: Any, tmp_path: Path) -> Callable[[Run, str, Callable[[Run, Any], bool]], Any]:
    """The figure of a picture, laid out."""
    made: list[Any] = []

    def keep() -> Any:
        made.append(figure())
        return made[-1]

    def draw(run: Run, role: str, picture: Callable[[Run, Any], bool]) -> Any:
        monkeypatch.setattr("rths.figure.figure", keep)
        assert plot.picture(run, role, picture, tmp_path / "picture.png")
        made[-1].draw_without_rendering()  # places in the figure's own resolution, not the file's
        return made[-1]

    return draw


@pytest.mark.parametrize("record", [RECORD, f"{RECORD}, {RECORD}", "W" * 50 + " " + "W" * 50])
@pytest.mark.parametrize("role", [SLAVE, "slave.a_table_with_quite_a_long_name_of_its_own"])
def test_the_caption_stays_inside_the_picture_and_off_the_axes(role: str, record: str, drawn: Any) -> None:
    canvas = drawn(made_up(role=role, record=record), role, plot.tracking)
    (caption,) = [text for text in canvas.texts if text.get_text().startswith("test")]
    box = caption.get_window_extent()
    assert caption.get_text().splitlines()[1] == f"{record}, × 0.1"
    assert box.x0 >= 0.0
    assert box.x1 <= canvas.bbox.x1
    assert box.y1 <= canvas.bbox.y1
    assert all(axis.get_tightbbox().y1 <= box.y0 for axis in canvas.axes)


def test_without_a_motion_the_caption_is_the_test_alone() -> None:
    run = made_up()
    run.metadata = {}
    assert plot.caption(run, SLAVE) == "test"
    assert plot.caption(run, "slave.roof") == "test, slave 'roof'"


@pytest.mark.parametrize("storeys", [2, 3, 12])
def test_floors_have_numbers_and_colours_of_their_own(storeys: int, drawn: Any) -> None:
    canvas = drawn(made_up(storeys), SLAVE, plot.histories)
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
    assert legend.get_window_extent().x0 >= axis.bbox.x1
    assert legend.get_window_extent().x1 <= canvas.bbox.x1


def test_one_storey_needs_no_legend(drawn: Any) -> None:
    canvas = drawn(made_up(1), SLAVE, plot.histories)
    assert all(axis.get_legend() is None for axis in canvas.axes)


def test_the_legends_of_tracking_stand_above_the_curves(drawn: Any) -> None:
    canvas = drawn(made_up(), SLAVE, plot.tracking)
    legends = [(axis, axis.get_legend()) for axis in canvas.axes if axis.get_legend()]
    assert len(legends) == 2
    for axis, legend in legends:
        assert [text.get_text() for text in legend.get_texts()] == ["target", "measured"]
        texts = [text.get_window_extent() for text in legend.get_texts()]
        assert min(box.y0 for box in texts) >= axis.bbox.y1
        assert max(box.x1 for box in texts) <= canvas.bbox.x1


def test_the_parts_of_a_tick_can_be_told_apart(drawn: Any) -> None:
    run = made_up()
    spread = np.random.default_rng(1).lognormal(-9.0, 0.5, 500)
    run.columns["latency"] = dict.fromkeys(SEGMENTS, spread) | {"seq": np.arange(500)}
    upper = drawn(run, SLAVE, plot.latency).axes[0]
    looks = {(line.get_color(), line.get_linestyle()) for line in upper.lines}
    assert len(looks) == len(SEGMENTS)
    assert len(upper.get_legend().get_texts()) == len(SEGMENTS)
    assert upper.get_legend().get_window_extent().x0 >= upper.bbox.x1
