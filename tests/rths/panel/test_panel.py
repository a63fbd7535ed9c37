"""The panel follows the recording of the test that runs, and of no other."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path

import pytest

from common.host.clock import VirtualClock
from common.plan.plan import Plan
from report.panel.desk import OrderOutcome, Present
from report.panel.guard import Guard
from report.panel.panel import Panel
from report.panel.snapshot import Shown, Snapshot

BEGUN_S = 2_000_000_000  # Unix time at which the second test begins, s: in the year 2033


class Idle:
    """An executor that does nothing."""

    present = Present()

    def carry_out(self, word: str, digest: str, reason: str) -> Future[OrderOutcome]:
        raise AssertionError(word, digest, reason)


class Followed:
    """A panel of the test that `shown` is."""

    def __init__(self) -> None:
        self.shown: Shown | None = None
        clock = VirtualClock()
        self.panel = Panel(
            Idle(), lambda: Snapshot("p", self.shown), Guard("127.0.0.1", 5006), window=10.0, clock=clock
        )


@pytest.fixture
def followed() -> Iterator[Followed]:
    found = Followed()
    yield found
    found.panel.close()


def test_a_recording_of_an_earlier_test_is_never_shown_as_the_present_one(
    followed: Followed, virtual_recording: Path, short_plan: Plan, tmp_path: Path
) -> None:
    path = tmp_path / "same.mcap"
    path.write_bytes(virtual_recording.read_bytes())
    os.utime(path, (BEGUN_S - 60, BEGUN_S - 60))
    panel = followed.panel
    panel.look()
    assert not panel.feed.changes
    shown = Shown("b-2", "b", short_plan, "", path, own=False, linked=True)
    followed.shown = shown._replace(since_ns=BEGUN_S * 1_000_000_000)
    panel.look()
    assert not panel.feed.changes
    assert panel.state("")["bars"] == []
    os.utime(path, (BEGUN_S + 1, BEGUN_S + 1))  # as when its recorder writes
    panel.look()
    assert panel.feed.changes
    first = panel.feed
    panel.look()
    assert panel.feed is first
    followed.shown = None
    panel.look()
    assert panel.feed is first  # the last test stays until the next one
    followed.shown = shown._replace(test="b-3", since_ns=(BEGUN_S + 2) * 1_000_000_000)
    panel.look()
    assert panel.feed is not first
    assert not panel.feed.changes
