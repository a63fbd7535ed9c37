"""The pictures that `rths plot` draws, their folders, and the message for an unknown picture."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from common.roles import SLAVE
from report.pictures import PICTURES
from report.text import tabular
from rths.examine import import_, plot
from rths.examine.importing.import_map import load_map
from rths.examine.importing.onto_ticks import on_ticks
from tests.helpers import ROOT
from tests.rths.pictures.made_up import RECORD, made_up


@pytest.fixture
def call(call: Any) -> Any:
    return partial(call, "plot")


LONG_NAME = "slave.a_table_with_quite_a_long_name_of_its_own"


@pytest.mark.parametrize(
    ("record", "role", "width"),
    [
        (RECORD, SLAVE, "double"),
        (f"{RECORD}, {RECORD}", LONG_NAME, "single"),
        ("W" * 50 + " " + "W" * 50, LONG_NAME, "single"),
        ("$x$ a_b", SLAVE, "single"),
    ],
)
def test_the_caption_stays_inside_the_picture_and_off_the_axes(record: str, role: str, width: str) -> None:
    canvas = plot.draw(made_up(role=role, record=record), role, PICTURES["tracking"], width)
    assert canvas is not None
    canvas.draw_without_rendering()
    (caption,) = [text for text in canvas.texts if text.get_text().startswith("test")]
    box = caption.get_window_extent()
    words = caption.get_text().replace("\n", "").replace(" ", "")
    assert words.endswith(f"{record}, × 0.1".replace(" ", ""))
    assert box.x0 >= 0.0
    assert box.x1 <= canvas.bbox.x1
    assert box.y1 <= canvas.bbox.y1
    assert all(axis.get_tightbbox().y1 <= box.y0 for axis in canvas.axes)


def test_without_a_ground_motion_the_caption_names_only_the_test() -> None:
    run = made_up()
    run.metadata = {}
    assert plot.caption(run, SLAVE) == "test"
    assert plot.caption(run, "slave.roof") == "test, slave 'roof'"
    run.metadata["ground_motion"] = {"record": "a file of another program"}
    assert plot.caption(run, SLAVE) == "test"


@pytest.mark.long
def test_named_pictures_are_drawn_and_no_others(call: Any, virtual_recording: Path, tmp_path: Path) -> None:
    assert call(virtual_recording, "-o", tmp_path / "some", "spectra", "tracking", "spectra") == 0
    assert {path.name for path in (tmp_path / "some").iterdir()} == {"spectra.png", "tracking.png"}


@pytest.mark.slow
@pytest.mark.parametrize(("ending", "head"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("SVG", b"<?xml")])
def test_one_picture_goes_into_a_file_of_its_format(
    ending: str, head: bytes, call: Any, virtual_recording: Path, tmp_path: Path
) -> None:
    path = tmp_path / "new" / f"figure 3.{ending}"
    assert call(virtual_recording, "-o", path, "tracking", "--width", "double") == 0
    assert [item.name.lower() for item in path.parent.iterdir()] == [path.name.lower()]
    assert next(path.parent.iterdir()).read_bytes().startswith(head)


@pytest.mark.long
def test_pictures_that_are_left_out_are_named_in_json_only(
    call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path
) -> None:
    assert call(virtual_recording, "-o", tmp_path, "--json") == 0
    shown = capsys.readouterr()
    result = json.loads(shown.out)
    assert shown.err == ""
    assert result["left_out"].keys() == {"latency"}
    assert [Path(path).stem for path in result["pictures"]] == [
        name for name in PICTURES if name != "latency"
    ]
    assert call(virtual_recording, "-o", tmp_path, "tracking", "--force") == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert shown.out == f"{tmp_path / 'tracking.png'}\n"


WRONG: dict[str, tuple[list[str], str]] = {
    "unknown": (["traking"], "There is no picture 'traking': did you mean tracking? Known here: histories, "),
    "far from any": (["zzz"], "There is no picture 'zzz': known here: histories, "),
    "lacking": (["latency"], "lacks signals: 'latency' needs latency of a test in real time"),
    "several in a file": (["-o", "{tmp}/a.svg"], "name the one picture"),
    "two in a file": (["-o", "{tmp}/a.svg", "tracking", "spectra"], "name the one picture"),
    "two formats": (["-o", "{tmp}/a.svg", "--format", "png", "tracking"], "a.svg is no png file"),
    "other format": (["-o", "{tmp}/a.jpg", "tracking"], "give a file that ends in .png, .svg, .pdf"),
    "no folder": (["-o", "{tmp}/file/a.svg", "tracking"], "Cannot write into"),
    "no file": (["-o", "{tmp}/" + 300 * "n" + ".svg", "tracking"], "Cannot write"),
}


@pytest.mark.parametrize("words_and_message", WRONG.values(), ids=WRONG.keys())
def test_a_wrong_picture_name_gives_one_sentence(
    words_and_message: tuple[list[str], str], call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    words, message = words_and_message
    assert call(virtual_recording, *[word.format(tmp=tmp_path) for word in words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_the_help_states_what_to_look_for_in_each_picture(call: Any, capsys: Any) -> None:
    assert call("--help") == 0
    shown = " ".join(capsys.readouterr().out.split())
    for name, picture in PICTURES.items():
        assert f"{name} {picture.text}" in shown


@pytest.mark.long
def test_imported_measurements_are_drawn_as_far_as_they_go(call: Any, tmp_path: Path) -> None:
    examples = ROOT / "examples" / "real_data"
    data, cut = examples / "force_rig.csv", tmp_path / "map.toml"
    text = (examples / "force_rig_map.toml").read_text().replace('plan = "', f'plan = "{examples}/')
    cut.write_text(text.replace("[signals]", "stop = 30.0\n[signals]"))
    chosen = load_map(cut)
    import_.write(tmp_path / "rig.mcap", chosen, on_ticks(chosen, tabular.read_table(data), data), "rig")
    assert call(tmp_path / "rig.mcap") == 0
    drawn = {path.stem for path in (tmp_path / "rig").iterdir()}
    assert drawn == {"histories", "synchronisation", "tracking", "spectra"}
