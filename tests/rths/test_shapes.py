"""Every reader of a recording, on recordings of tests of every shape."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from bokeh.document import Document

from common.host.clock import VirtualClock
from common.recording.reader import Tail, read
from common.recording.run import Run
from report.facts.laboratories import laboratories, views
from report.facts.summary import summarize
from report.live.feed import Feed
from report.live.page import Page
from report.pictures import PICTURES
from report.pictures.figure import figure
from rths.examine import layout
from rths.examine.export import flat
from rths.examine.importing.import_map import lab_signals
from tests.rths import sines

A, B = "column A", "column B"
NAMES = {  # of the laboratories, by shape
    "default": ["column", "table"],
    "two_columns": [A, B],
    "two_storeys": [A, B],
    "single_site": ["column"],
    "two_slaves": ["column", "table"],
    "own": ["column", "piston"],
    "own_lost": ["column", "piston"],
}
SYSTEMS = {
    "default": {"actuator", "table"},
    "two_columns": {"actuator", "actuator.east"},
    "two_storeys": {"actuator", "actuator.above"},
    "single_site": {"actuator"},
    "two_slaves": {"actuator.columns", "table.dampers"},
    "own": {"actuator", "piston"},
    "own_lost": {"actuator", "piston"},
}


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The recording of a shape, written once."""
    folder = tmp_path_factory.mktemp("shapes")
    made: dict[str, Path] = {}
    return lambda shape: made.setdefault(shape, made.get(shape) or sines.write(shape, folder))


@pytest.fixture(params=sines.SHAPES)
def shape(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def run(shape: str, recording: Callable[[str], Path]) -> Run:
    return read(recording(shape))


def test_every_laboratory_is_shown_under_its_own_name(shape: str, run: Run) -> None:
    assert [lab.name for lab in laboratories(run)] == NAMES[shape]


def test_the_summary_states_how_every_laboratory_tracked_its_target(shape: str, run: Run) -> None:
    found = summarize(run)
    json.dumps(found)
    assert set(found["tracking"]) == SYSTEMS[shape]
    # every laboratory measures one tick late; a slave's target is for the end of its interval
    assert {name: round(facts["delay"] / sines.INTERVAL) for name, facts in found["tracking"].items()} == {
        name: 1 if name == "actuator" else 0 for name in SYSTEMS[shape]
    }
    assert len(found["force_paths"]) == sum(name.startswith("column") for name in NAMES[shape])
    # without the class of a kind nobody knows how its force enters the building
    assert ("shear" in found["storeys"][0]) is not shape.startswith("own")


def test_the_storey_shear_includes_the_columns_of_every_laboratory(recording: Callable[[str], Path]) -> None:
    found = summarize(read(recording("two_storeys")))["storeys"]
    run = read(recording("two_storeys"))
    own, used = run.columns["master"]["column_force"], run.columns["master"]["column_force_used"]
    numerical = run.columns["master"]["numerical_force"]
    assert found[0]["shear"]["peak"] == pytest.approx(abs(numerical[:, 0] + own).max())
    assert found[1]["shear"]["peak"] == pytest.approx(abs(numerical[:, 1] + used).max())


def test_pictures_have_an_axis_per_laboratory_and_unique_names_of_lines(shape: str, run: Run) -> None:
    for part in views(run).values():
        labs = laboratories(part)
        for name, count in (
            ("hysteresis", len(labs)),
            ("synchronisation", len(labs)),
            ("tracking", 2 * len(labs)),
            ("histories", 2 + 2 * len(labs) if labs[0].topic == "master" else 4),
            ("spectra", 2),
        ):
            canvas = figure(*PICTURES[name].size)
            assert PICTURES[name].on(part, canvas), name
            assert len(canvas.axes) == count, name
            for axis in canvas.axes:
                labels = [line.get_label() for line in axis.get_lines() if line.get_label()[0] != "_"]
                assert len(set(labels)) == len(labels), (name, labels)
                assert axis.get_lines(), name
        assert PICTURES["latency"].on(part, figure(*PICTURES["latency"].size)) is bool(run.roles)


def test_the_live_page_has_plots_of_every_laboratory(
    shape: str, run: Run, recording: Callable[[str], Path]
) -> None:
    with Tail(recording(shape)) as tail:
        feed = Feed(tail, 3.0, VirtualClock(), whole=True)
        before = Page(Document(), feed)
        feed.look()
        while feed.behind:
            feed.look()
        assert not feed.failure
        page = Page(Document(), feed)
        before.update()
        page.update()
    assert set(NAMES[shape]) <= set(page.plots)
    assert ("trips" in page.plots) is bool(run.roles)
    assert (before._heading.tags == ["anew"]) is (shape != "default")
    assert not page._heading.tags
    shown = {name for name, plot in page.plots.items() if plot.visible}
    assert shown >= set(NAMES[shape][:1])
    assert ("table" in shown) is (shape == "default")
    for lab in laboratories(run):
        if lab.topic in ("master", run.roles[0] if run.roles else ""):
            stream = page.streams.master if lab.topic == "master" else page.streams.slave
            assert len(stream.source.data[lab.channels.position]) > 100


def test_layout_and_export_contain_every_laboratory(
    shape: str, run: Run, recording: Callable[[str], Path]
) -> None:
    panels = layout.layout(layout.of_recording(recording(shape)))["configById"]
    assert {f"Plot!{name}" for name in NAMES[shape]} <= set(panels)
    columns = flat(run)
    for lab in laboratories(run):
        assert f"{lab.topic.replace('.', '_')}_{lab.channels.position}" in columns


def test_an_import_map_can_name_the_signals_of_both_columns() -> None:
    known = lab_signals(sines.plan_of("two_columns"))
    assert known["column_force"][0] == "master"
    assert known["east.column_force"][0] == "slave.east"
    assert lab_signals(sines.plan_of("two_slaves"))["columns.column_force"][0] == "slave.columns"
