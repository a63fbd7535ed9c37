from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from common.host.bare_loop import BareLoop
from common.host.clock import VirtualClock
from common.host.realtime import NOTHING, Granted
from common.lab.laboratory import Laboratory, Setting
from common.lab.surroundings import Surroundings, described
from common.link.memory_link import MemoryHub
from common.plan.plan import Plan
from common.plan.read import parse
from common.recording.rows import values_of
from common.signals import TOPICS


def laboratory(plan: Plan | None = None) -> Laboratory:
    clock = VirtualClock()
    return Laboratory("slave", Setting(plan or Plan(), MemoryHub().join("slave", clock), clock), TOPICS)


def events(lab: Laboratory) -> list[tuple[str, str, str]]:
    """The level, the code and the text of every recorded event."""
    return [tuple(values_of(row)[4:7]) for topic, row in lab.outlet._pending if topic == "event"]


@pytest.mark.parametrize(
    ("text_of_plan", "expected"), [("[slave.rig]\nclass = 'lab.py:Lab'\n", "warning"), ("", "info")]
)
def test_a_missing_privilege_is_in_the_text_and_a_warning_with_a_rig(
    text_of_plan: str, expected: str, tmp_path: Path
) -> None:
    (tmp_path / "lab.py").write_text("class Lab: ...\n")
    lab = laboratory(parse(text_of_plan, tmp_path))
    Surroundings(lab, Granted(0, -1, False, ("No priority: ask for it.",)), {}, timed=False).begin()
    ((level, code, text),) = events(lab)
    assert (level, code) == (expected, "real_time")
    assert text.endswith("No priority: ask for it.")


def test_rejected_frames_are_reported_at_the_end_by_reason() -> None:
    lab, rejected = laboratory(), Counter[str]()
    around = Surroundings(lab, NOTHING, rejected, timed=False)
    around.begin()
    rejected.update(check=3, value=1, unregistered=9)
    around.end(10)
    assert ("warning", "rejected", "Frames were rejected: 3 by check, 1 by value.") in events(lab)


def test_a_test_that_never_began_gives_no_events() -> None:
    lab = laboratory()
    Surroundings(lab, NOTHING, Counter(check=1), timed=True).end(0)
    assert events(lab) == []


def test_a_bare_loop_without_figures_gives_no_event(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(BareLoop, "start", lambda *_: None)
    monkeypatch.setattr(BareLoop, "stop", lambda _: {})
    lab = laboratory()
    around = Surroundings(lab, NOTHING, {}, timed=True)
    around.begin()
    around.end(1)
    assert [code for _, code, _ in events(lab)] == ["real_time", "machine"]


def test_metadata_names_the_laboratory_and_its_scheduler() -> None:
    assert described("slave.roof", "real_time", {"priority": 49.0})["slave.roof.scheduler"] == "fifo 49"
    assert described("master", "real_time", {"priority": 0.0})["master.scheduler"] == "other"
    assert described("master", "rejected", {"check": 2.0}) == {"master.rejected.check": "2.0"}
    assert described("master", "bare_loop", {"late": 2.0}) == {"bare_loop.late": "2.0"}
