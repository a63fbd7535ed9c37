"""The contents of a page of the panel: states, causes, bars, and the age of each."""

from __future__ import annotations

import json
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

from common.host.clock import VirtualClock
from common.plan.plan import Plan
from common.plan.read import load, parse
from common.reality import reality
from common.recording.reader import Tail
from common.terminal.cli import plan_path
from report.facts.laboratories import laboratory
from report.live.feed import Feed
from report.live.levels import limits
from report.panel.desk import Desk, OrderOutcome, PageOrder, Present
from report.panel.snapshot import CheckResult, RunReports, Shown, Snapshot
from report.panel.view import PanelView
from simulation import virtual
from tests.helpers import ROOT, with_table

SECOND = 1_000_000_000


class Idle:
    """An executor that never finishes."""

    present = Present("a-1", "d", "d")

    def carry_out(self, word: str, digest: str, reason: str) -> Future[OrderOutcome]:
        del word, digest, reason
        return Future()


class Watched:
    """The view of a test whose recording grows."""

    def __init__(self, path: Path, content: bytes, plan: Plan) -> None:
        self.clock = VirtualClock()
        self.clock.time = 100 * SECOND
        self.path, self._content = path, content
        self.tail = Tail(path)
        self.feed = Feed(self.tail, 10.0, self.clock)
        self.desk = Desk(Idle(), self.clock)
        self.page = self.desk.enter()
        self.view = PanelView(self.desk, self.clock)
        self.shown: Shown | None = Shown("a-1", "a", plan, plan.digest(), path, own=True, linked=True)

    def to(self, share: float) -> None:
        """Let the recording grow to this share of its length."""
        self.path.write_bytes(self._content[: round(share * len(self._content))])
        self.feed.look()
        while self.feed.behind:
            self.feed.look()

    def tell(self, alive: tuple[str, ...] = ("master", "slave"), **modes: str) -> None:
        """Let the test's command report modes now, and which processes run."""
        now = self.clock.time
        assert self.shown is not None
        before = dict(self.shown.reports.modes)
        reports = RunReports(before | {lab: (mode, now) for lab, mode in modes.items()}, alive, now)
        self.shown = self.shown._replace(reports=reports)

    def state(self, **more: Any) -> dict[str, Any]:
        found = self.view.state(Snapshot("plan.toml", self.shown, **more), self.feed, self.page)
        json.dumps(found, allow_nan=False)  # a browser reads it
        return found

    def labs(self) -> dict[str, tuple[str, float]]:
        return {lab["role"]: (lab["mode"], round(lab["age"], 2)) for lab in self.state()["labs"]}


@pytest.fixture
def watched(tmp_path: Path, virtual_recording: Path, short_plan: Plan) -> Iterator[Watched]:
    found = Watched(tmp_path / "a.mcap", virtual_recording.read_bytes(), short_plan)
    with found.tail:
        yield found


def test_without_a_test_the_page_shows_no_laboratories_bars_or_causes(watched: Watched) -> None:
    watched.shown = None
    state = watched.state()
    assert state["test"] is None
    assert (state["labs"], state["bars"], state["causes"]) == ([], [], [])
    assert state["phase"] == "No test runs"
    assert state["page"] == 1
    assert watched.view.state(Snapshot("p"), watched.feed, "somebody")["page"] == 0


def test_the_age_of_an_armed_laboratorys_state_is_the_time_since_its_last_report(watched: Watched) -> None:
    watched.tell(master="armed", slave="armed")
    watched.clock.time += SECOND // 2
    assert watched.labs() == {"master": ("armed", 0.5), "slave": ("armed", 0.5)}
    assert watched.state()["phase"] == "armed"
    watched.clock.time += 30 * SECOND
    assert watched.labs()["slave"] == ("armed", 30.5)


def test_the_age_of_a_moving_laboratorys_state_is_that_of_its_newest_row(watched: Watched) -> None:
    watched.tell(master="running", slave="running")
    assert watched.labs()["master"] == ("running", 0.0)  # no row has come yet
    watched.to(0.5)
    assert watched.labs()["master"] == ("running", 0.0)
    watched.clock.time += 5 * SECOND
    watched.tell()
    for mode, age in watched.labs().values():
        assert mode == "running"
        assert age == pytest.approx(5.0, abs=0.1)  # the two streams do not reach equally far
    assert all(4.9 < bar["age"] < 5.2 for bar in watched.state()["bars"])


def test_a_process_that_ended_is_shown_as_lost_or_as_left_in_order(watched: Watched) -> None:
    watched.tell(master="running", slave="running")
    watched.clock.time += SECOND
    watched.tell(alive=("master",), master="ramping")
    state = watched.state()
    assert state["phase"] == "a laboratory has no process"
    gone = state["labs"][1]
    assert (gone["mode"], gone["note"], gone["loud"]) == ("no process", "it was running", "bad")
    watched.tell(alive=(), master="idle", slave="idle")
    watched.clock.time += SECOND
    watched.tell(alive=())
    assert [lab["mode"] for lab in watched.state()["labs"]] == ["left", "left"]


def test_a_recorder_without_a_process_is_shown_while_laboratories_run(watched: Watched) -> None:
    def recorder() -> list[tuple[str, str]]:
        return [(one["mode"], one["loud"]) for one in watched.state()["recorder"]]

    assert recorder() == []
    watched.tell(alive=("master", "slave", "recorder"), master="running", slave="running")
    assert recorder() == [("recording", "")]
    watched.tell(alive=("master", "slave"))
    assert recorder() == [("no process", "bad")]
    watched.tell(alive=())
    assert recorder() == [("left", "")]


def test_after_a_test_of_the_panels_own_its_commands_last_sentence_is_shown(watched: Watched) -> None:
    watched.shown = None
    ending = "The slave was killed (signal 9); the recording holds the rows until then."
    state = watched.state(ending=ending, last=(("master", "The slave has been silent for 5 s."),))
    assert state["phase"] == f"No test runs. The last one ended: {ending}"
    assert [one["text"] for one in state["causes"]] == ["The slave has been silent for 5 s."]


def test_a_lost_link_has_its_age_until_the_recording_has_ended(watched: Watched) -> None:
    assert watched.shown is not None
    assert watched.state()["test"]["unlinked"] is None
    watched.to(0.5)
    watched.shown = watched.shown._replace(linked=False, unlinked_at=watched.clock.time)
    watched.clock.time += 3 * SECOND
    assert watched.state()["test"]["unlinked"] == pytest.approx(3.0)
    watched.to(1.0)
    assert watched.feed.finished
    assert watched.state()["test"]["unlinked"] is None  # the master has left in order


def test_a_test_that_was_started_elsewhere_is_known_only_by_its_recording(watched: Watched) -> None:
    assert watched.shown is not None
    watched.shown = watched.shown._replace(own=False)
    state = watched.state()
    assert [(lab["mode"], lab["age"]) for lab in state["labs"]] == [("not known", None)] * 2
    assert state["phase"] == "not known"
    watched.to(0.5)
    assert {mode for mode, _ in watched.labs().values()} == {"running"}


def test_bars_are_shown_relative_to_the_limits_of_the_plan(watched: Watched) -> None:
    watched.to(0.6)
    bars = {bar["name"]: bar for bar in watched.state()["bars"]}
    assert set(bars) >= {"displacement", "column force", "table displacement", "damper stroke"}
    force = bars["column force"]
    assert force["limit"] == "400 kN"
    assert 0.0 < force["share"] <= force["most"] < 0.1
    top = watched.feed.levels.of("master", "column_force")
    assert top is not None
    assert force["most"] == pytest.approx(top.most / 400e3)
    watched.to(1.0)
    assert {bar["age"] for bar in watched.state()["bars"]} == {None}


def test_limits_of_a_kind_of_the_users_own_are_those_that_the_plan_gives_its_signals() -> None:
    text = '[slave]\nkind = "viscous_damper.py:ViscousDamper"\n[device.limits]\npiston_force = "100 kN"\n'
    plan = parse(text, ROOT / "examples")
    units = {"command_seq": "", "piston_target": "m", "piston_command": "m", "piston_displacement": "m"}
    lab = laboratory("slave", "slave", plan, units | {"piston_force": "N"})
    assert lab is not None
    assert limits(plan, lab) == {"piston_force": 100e3}
    wrong = parse(text.replace("100 kN", "100 mm"), ROOT / "examples")
    assert limits(wrong, lab) == {}


def test_the_largest_value_of_the_last_second_follows_a_decaying_motion(watched: Watched) -> None:
    watched.to(1.0)
    stroke = watched.feed.levels.of("slave", "damper_stroke")
    assert stroke is not None
    assert stroke.now <= stroke.lately <= stroke.most
    assert stroke.lately < stroke.most


def test_a_held_test_is_shown_as_held_until_it_resumes(watched: Watched) -> None:
    watched.tell(master="running", slave="running")
    event = {"lab": "master", "t": 1.0, "level": "info", "text": "", "values": {}}
    for code, words in (("hold", "slowing down to a hold"), ("held", "held"), ("resumed", "running")):
        watched.feed.standing.event(event | {"code": code})
        assert watched.state()["phase"] == words
    watched.feed.standing.event(event | {"code": "held"})
    watched.tell(master="ramping", slave="ramping")
    assert watched.state()["phase"] == "ramping"


def test_causes_and_latched_laboratories_are_shown(tmp_path: Path, short_plan: Plan) -> None:
    plan = with_table(short_plan, "limits", column_force=12e3)
    made = tmp_path / "made.mcap"
    virtual.run(virtual.assemble(plan, reality.as_planned(plan), made), str)
    watched = Watched(tmp_path / "a.mcap", made.read_bytes(), plan)
    with watched.tail:
        watched.to(0.98)
        watched.tell(master="safe", slave="safe")
        state = watched.state()
        assert "column_force" in state["causes"][0]["text"]
        assert state["causes"][0]["lab"] == "master"
        assert [(lab["mode"], lab["note"]) for lab in state["labs"]] == [("safe", "latched until Reset")] * 2
        watched.shown = None
        watched.to(1.0)
        assert state["phase"] == "safe"
        assert "column_force" in watched.state()["phase"]


def test_before_anything_is_recorded_the_reported_causes_are_shown(watched: Watched) -> None:
    assert watched.shown is not None
    watched.shown = watched.shown._replace(reports=RunReports(causes=(("slave", "The door is open."),)))
    assert watched.state()["causes"] == [{"lab": "slave", "t": "", "text": "The door is open."}]


def test_plan_and_machine_are_shown_with_the_results_of_their_commands(watched: Watched) -> None:
    from report.plan.facts import facts

    plan = plan_path(None)
    found = facts(load(plan), plan)
    failed = {"name": "priority", "found": "none", "needed": "49", "advice": "Grant it.", "passed": False}
    checks = [failed, failed | {"passed": True}, failed | {"name": "wake-up"}]
    machine = {"checks": checks, "notes": ["A rival runs."], "verdict": {"sentence": "It lacks one thing."}}
    machine["realtime"] = {"missing": ["There is no right to it."]}
    watched.clock.time += SECOND
    checked = {"plan": CheckResult(found, at=99 * SECOND), "machine": CheckResult(machine, at=100 * SECOND)}
    state = watched.state(**checked)
    assert state["plan"]["digest"] == load(plan).digest()
    assert state["plan"]["ready"]
    assert state["plan"]["age"] == pytest.approx(2.0)
    assert dict(state["plan"]["facts"])["ground motion"].startswith("El Centro 1940 NS")
    assert any("Pre-flight would let this test begin" in text for text in state["plan"]["concerns"])
    assert next(one for one in state["plan"]["peaks"] if one["name"] == "column force")["share"] < 0.2
    assert state["machine"]["lacks"] == [
        "priority, wake-up: Grant it.",
        "There is no right to it.",
        "A rival runs.",
    ]
    assert state["machine"]["verdict"] == "It lacks one thing."
    busy = watched.state(plan=CheckResult(at=SECOND, busy=True))["plan"]
    assert (busy["busy"], busy["digest"]) == (True, "")


def test_orders_are_listed_with_their_page_and_with_a_number_for_their_own_page(watched: Watched) -> None:
    watched.desk.take(PageOrder(watched.page, 1, "stop", "a-1", seen=watched.clock.time // 1_000_000))
    other = watched.desk.enter()
    mine, theirs = (
        watched.view.state(Snapshot("p", watched.shown), watched.feed, page)["orders"][0]
        for page in (watched.page, other)
    )
    assert (mine["number"], theirs["number"]) == (1, 0)
    assert (mine["page"], mine["word"], mine["state"]) == (1, "Stop", "sent")
