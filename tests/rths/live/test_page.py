"""The page without a browser: what its sources and texts hold while a recording grows."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator
from html import unescape
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bokeh.document import Document

from common.errors import EmergencyStopError
from common.host.clock import VirtualClock
from common.plan.plan import Plan
from common.plan.read import load, with_test
from common.reality import reality
from common.recording.reader import Tail, length, read
from common.recording.run import Run
from common.recording.writer import Recording
from common.signals import TOPICS
from report.live.feed import EDGES, POINTS, POINTS_WHOLE, SILENT_NS, Feed, Timing
from report.live.page import Page
from report.live.standing import Standing
from report.live.status import heading, listing
from report.live.stream import factors
from simulation import virtual
from tests.helpers import ROOT


class Growing:
    """A page on a file that grows."""

    def __init__(self, folder: Path, content: bytes, window: float = 10.0, *, whole: bool = False) -> None:
        self.path = folder / "growing.mcap"
        self.clock = VirtualClock()
        self.tail = Tail(self.path)
        self.feed = Feed(self.tail, window, self.clock, whole=whole)
        self.document = Document()
        self.page = Page(self.document, self.feed)
        self._content = content

    def to(self, share: float) -> None:
        """Let the file grow to this share of its length, and update the page."""
        self.path.write_bytes(self._content[: round(share * len(self._content))])
        self.feed.look()
        while self.feed.behind:
            self.feed.look()
        self.page.update()

    def source(self, name: str) -> dict[str, Any]:
        return {key: np.asarray(value) for key, value in getattr(self.page.streams, name).source.data.items()}

    @property
    def text(self) -> str:
        return unescape(self.page.status.tiles.text)


Grow = Callable[..., Growing]


@pytest.fixture
def grow(tmp_path: Path) -> Iterator[Grow]:
    """Makes pages whose files are closed in the end."""
    with contextlib.ExitStack() as stack:

        def made(content: bytes, window: float = 10.0, *, whole: bool = False) -> Growing:
            growing = Growing(tmp_path, content, window, whole=whole)
            stack.enter_context(growing.tail)
            return growing

        yield made


@pytest.fixture
def growing(virtual_recording: Path, grow: Grow) -> Growing:
    return grow(virtual_recording.read_bytes())


def thinned(run: Run, topic: str, name: str, step: int) -> Any:
    return run.columns[topic][name][::step]


def test_before_anything_is_recorded_the_page_states_this_and_shows_its_axes(growing: Growing) -> None:
    growing.to(0.0)
    assert "waiting for the recording to begin" in growing.text
    assert growing.source("master")["column_force"].tolist() == [0.0]
    assert growing.document.title == "growing: live"


def test_a_growing_recording_reaches_the_plots_in_the_units_of_their_axes(
    growing: Growing, virtual_recording: Path
) -> None:
    run = read(virtual_recording)
    for share in np.linspace(0.0, 1.0, 23):
        growing.to(share)
    step = 5  # ten seconds of 500 ticks each in a thousand points
    master, slave = growing.source("master"), growing.source("slave")
    rows = 2000 // step
    for name, factor in (
        ("t", 1.0),
        ("column_target", 1e3),
        ("column_displacement", 1e3),
        ("column_force", 1e-3),
    ):
        assert np.allclose(master[name][:rows], factor * thinned(run, "master", name, step), rtol=1e-12), name
    for name, factor in (("table_displacement", 1e3), ("damper_stroke", 1e3), ("damper_force", 1.0)):
        assert np.allclose(slave[name][:rows], factor * thinned(run, "slave", name, step), rtol=1e-12), name
    ramp = run.ramps["master"]["column_displacement"]
    assert master["t"].size - rows == pytest.approx(ramp.size / step, abs=1)
    assert np.isnan(master["column_target"][rows:]).all()
    assert "ended: completed" in growing.text
    assert growing.document.title == "default: ended"


def test_late_ticks_and_the_histogram_count_every_tick(growing: Growing, virtual_recording: Path) -> None:
    run = read(virtual_recording)
    growing.to(1.0)
    tops = np.asarray(growing.page.latency.source.data["top"])
    trips = run.columns["latency"]["round_trip"]
    assert tops[tops >= 1].sum() == np.isfinite(trips).sum()
    assert f"{np.count_nonzero(run.columns['latency']['deadline_missed'])} (" in growing.text


def test_round_trips_are_not_drawn_in_virtual_time_where_they_are_zero(growing: Growing) -> None:
    growing.to(0.0)
    assert all(figure.visible for figure in growing.page.plots.values())
    growing.to(1.0)
    assert "0 (virtual time)" in growing.text
    hidden = {name for name, figure in growing.page.plots.items() if not figure.visible}
    assert hidden == {"trips", "histogram"}


def test_round_trips_of_real_time_are_drawn() -> None:
    timing = Timing()
    assert not timing.instant  # before anything is known
    timing.add({"round_trip": np.array([0.0, 2e-4]), "deadline_missed": np.array([False, False])})
    assert not timing.instant


def test_events_and_modes_are_shown(growing: Growing) -> None:
    growing.to(0.5)
    assert growing.feed.standing.modes == {"master": "running", "slave": "running"}
    growing.to(1.0)
    assert growing.feed.standing.modes == {"master": "idle", "slave": "idle"}
    events = unescape(growing.page.status.events.text)
    assert "running → ramping (end)" in events
    assert events.index("running → ramping (end)") < events.index("recording begun")


def test_a_window_bounds_the_samples_of_a_page(virtual_recording: Path, grow: Grow) -> None:
    growing = grow(virtual_recording.read_bytes(), window=1.0)
    for share in (0.4, 0.7, 1.0):
        growing.to(share)
        assert growing.source("slave")["t"].size <= POINTS
    assert growing.source("slave")["t"][-1] == pytest.approx(4.1, abs=0.1)


@pytest.mark.slow
def test_a_long_recording_is_shown_completely_with_its_extreme_values(
    default_plan: Plan, tmp_path: Path, grow: Grow
) -> None:
    path = tmp_path / "long.mcap"
    assert virtual.run(virtual.assemble(default_plan, reality.as_planned(default_plan), path), str) is None
    run = read(path)
    growing = grow(path.read_bytes(), window=length(path), whole=True)
    growing.to(1.0)
    signals: dict[str, tuple[str, ...]] = {"master": ("column_target", "column_displacement", "column_force")}
    signals["slave"] = ("table_target", "table_displacement", "damper_stroke", "damper_force")
    for topic, names in signals.items():
        source = growing.source(topic)
        assert run.ticks(topic) > POINTS_WHOLE > source["t"].size > 0.3 * POINTS_WHOLE
        assert source["t"][0] < 0.1
        assert source["t"][-1] > run.ramps[topic]["t"][-1] - 0.1
        for name in names:
            every = factors(growing.feed.laboratories).get(name, 1.0) * np.concatenate(
                [run.columns[topic][name], run.ramps[topic].get(name, [])]
            )
            assert np.nanmax(source[name]) == np.nanmax(every), name
            assert np.nanmin(source[name]) == np.nanmin(every), name
    trips = growing.source("latency")
    assert POINTS_WHOLE > trips["t"].size > 0.5 * POINTS_WHOLE
    assert trips["round_trip"].max() == 1e6 * np.nanmax(run.columns["latency"]["round_trip"])
    assert growing.page.plots["hysteresis"].title.text == "column: hysteresis"
    assert growing.page.plots["column"].x_range.follow is None


def test_a_second_reader_gets_the_whole_window_at_once(growing: Growing) -> None:
    growing.to(1.0)
    other = Page(Document(), growing.feed)
    assert np.array_equal(
        np.asarray(other.streams.slave.source.data["damper_stroke"]), growing.source("slave")["damper_stroke"]
    )


def test_several_slaves_are_shown_one_at_a_time(tmp_path: Path, grow: Grow) -> None:
    plan = with_test(load(ROOT / "rths/plans/two_dampers.toml"), duration=1.0)
    path = tmp_path / "two.mcap"
    assert virtual.run(virtual.assemble(plan, reality.as_planned(plan), path), lambda: "") is None
    run = read(path)
    growing = grow(path.read_bytes())
    growing.to(0.5)
    growing.to(1.0)
    assert growing.page.slave.visible
    assert growing.page.slave.options == [("slave.roof", "roof"), ("slave.middle", "middle")]
    for role in ("slave.roof", "slave.middle"):
        growing.page.slave.value = role
        growing.page.update()
        shown = growing.source("slave")["damper_stroke"][: 500 // 5]
        assert np.allclose(shown, 1e3 * run.columns[role]["damper_stroke"][::5])
    assert "slave 'middle'" in growing.text


def test_a_silent_recorder_is_reported(growing: Growing) -> None:
    growing.to(0.5)
    assert "running" in growing.feed.state
    growing.clock.time += SILENT_NS + 1_000_000_000
    growing.to(0.5)
    assert growing.feed.state.startswith("no news for 3 s; the newest: running, t = 1.")
    assert (
        len(re.findall(r"no news for 3 s, since t = 1\.[89]", growing.text)) == 2
    )  # a tile for each laboratory


def test_a_state_is_shown_with_its_age(growing: Growing) -> None:
    growing.to(0.25)
    early = growing.feed.t
    growing.clock.time += 800_000_000
    growing.to(0.3)  # rows that were measured a little after those before, and come 0.8 s later
    waited = 0.8 - (growing.feed.t - early)
    assert 0.0 < waited < 0.8
    assert growing.feed.standing.age("master") == pytest.approx(waited, abs=0.05)
    for more in (0.0, 1.0):
        growing.clock.time += round(more * 1e9)
        growing.page.update()
        for lab in ("master", "slave"):
            t, age = growing.feed.standing.last(lab), growing.feed.standing.age(lab)
            assert f"as of t = {t:.2f} s, {age:.1f} s ago" in growing.text
        assert age > more
    growing.to(1.0)
    assert " ago" not in growing.text


def test_an_emergency_stop_is_shown_at_the_next_update_although_nothing_follows_it(
    short_plan: Plan, tmp_path: Path, grow: Grow
) -> None:
    path = tmp_path / "stopped.mcap"
    bench = virtual.assemble(short_plan, reality.as_planned(short_plan), path)
    seen: list[str] = []

    def stopped() -> str:
        if bench.master.ticks < 500:
            return ""
        bench.master.emergency(EmergencyStopError("smoke at the pump."))
        bench.master.lab.send_samples()  # as the loop does while it waits for the operator's reset
        while (received := bench.endpoints["recorder"].receive()) is not None:
            assert bench.recorder is not None
            bench.recorder.take(received.message, received.received_ns)
        growing = grow(path.read_bytes())
        growing.to(1.0)
        seen.extend([growing.page.status.banner.text, growing.text])
        return "seen."

    virtual.run(bench, stopped)
    banner, text = seen[0], seen[1]
    assert "EMERGENCY STOP" in banner
    assert "<b>master</b>, t = 1.00 s: smoke at the pump." in banner
    assert "emergency stop, t = 1.00 s" in text


def test_a_cause_is_shown_once_and_events_are_in_the_order_of_time() -> None:
    stops = [SimpleNamespace(text="The master was held up.")]
    feed: Any = SimpleNamespace(standing=SimpleNamespace(stops=stops), state="ended: The master was held up.")
    assert heading(feed) == "ended"
    feed.state = "ended: completed"
    assert heading(feed) == "ended: completed"
    feed.events = [{"t": t, "lab": "master", "level": "info", "text": ""} for t in (2.67, 2.38, 2.5)]
    assert re.findall(r"\d\.\d\d", listing(feed)) == ["2.67", "2.50", "2.38"]


def test_the_banner_names_causes_and_not_their_consequences() -> None:
    standing = Standing(VirtualClock())
    event = {"t": 1.2, "level": "error", "values": {}}
    standing.event({**event, "lab": "slave", "code": "remote_trip", "text": "The master stopped the test"})
    assert [stop.lab for stop in standing.stops] == ["slave"]
    standing.event({**event, "lab": "master", "code": "limit", "text": "too far"})
    assert [(stop.lab, stop.text) for stop in standing.stops] == [("master", "too far")]


def test_damage_is_reported_and_earlier_samples_stay(virtual_recording: Path, grow: Grow) -> None:
    content = bytearray(virtual_recording.read_bytes())
    content[content.index(b"\x28\xb5\x2f\xfd", len(content) // 2) + 9] ^= 0xFF  # within a compressed chunk
    growing = grow(bytes(content))
    growing.to(1.0)
    assert growing.feed.ended
    assert "the recording is damaged at byte" in growing.text
    assert growing.source("master")["t"].size > 10


def test_a_file_that_is_not_a_recording_is_reported_on_the_page(grow: Grow) -> None:
    growing = grow(b"no recording at all")
    growing.to(1.0)
    assert "is not a readable MCAP recording" in growing.feed.state
    assert growing.feed.ended


def test_a_recording_without_plan_or_with_one_topic_is_shown(tmp_path: Path, grow: Grow) -> None:
    path = tmp_path / "some.mcap"
    recording = Recording(path, "bench", 1, {"slave": TOPICS["slave"][:2]})
    for seq in range(200):
        recording.add("slave", seq, seq, (seq, seq * 0.01))
    recording.close({})
    growing = grow(path.read_bytes())
    growing.to(1.0)
    assert growing.feed.interval == pytest.approx(0.01)
    assert growing.source("slave")["t"][-1] == pytest.approx(1.99)
    assert np.isnan(growing.source("slave")["damper_force"]).all()
    assert growing.feed.state == "ended: cut off"


def test_a_file_of_an_earlier_test_is_not_shown(virtual_recording: Path, tmp_path: Path) -> None:
    path = tmp_path / "old.mcap"
    path.write_bytes(virtual_recording.read_bytes())
    written = path.stat().st_mtime_ns
    with Tail(path) as tail:
        old, new = (Feed(tail, 10.0, VirtualClock(), since_ns=since) for since in (written + 1, written))
        old.look()
        assert old.state == "waiting for the recording to begin"
        new.look()
        assert new.changes


def test_the_text_of_an_event_does_not_become_markup() -> None:
    event = {"t": 1.0, "lab": "<b>", "level": "error", "code": "x", "text": "<script>alert(1)</script>"}
    feed: Any = SimpleNamespace(events=[event])
    assert "<script>" not in listing(feed)
    assert "&lt;script&gt;" in listing(feed)


def test_the_bins_of_the_histogram_extend_around_the_interval(short_plan: Plan) -> None:
    assert EDGES[0] < 1e6 * short_plan.test.interval < EDGES[-1]
