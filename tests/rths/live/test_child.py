"""The live view as a process beside a test: it prints its address, shows the end, and cannot stop the test."""

from __future__ import annotations

import shutil
import signal
import socket
import time
import urllib.request
from pathlib import Path
from typing import Any

import pytest

from common.plan.plan import Plan
from report.text.terminal import RunProgress
from rths.perform.ending import Ending
from rths.perform.follow import follow
from rths.perform.live_child import READY, View


def told(view: View, seconds: float = 40.0) -> str:
    """The first line that a view prints."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if news := view.news():
            return news
        time.sleep(0.02)
    raise TimeoutError


def test_the_view_prints_its_address_and_ends_by_itself_after_the_test(
    tmp_path: Path, virtual_recording: Path
) -> None:
    path = tmp_path / "new.mcap"
    view = View(path, 0)
    try:
        url = told(view).removeprefix(READY)
        assert url.startswith("http://127.0.0.1:")
        page = urllib.request.urlopen(url).read().decode()
        assert "https://" not in page
        assert page.count("http://") == page.count("http://127.0.0.1") + page.count("http://www.w3.org")
        shutil.copyfile(virtual_recording, path)
        code = view._process.wait(30.0) if view._process else 1
        assert code == 0
        assert view.news() == ""
    finally:
        view.close()


def test_a_view_that_cannot_serve_tells_the_user_once(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        view = View(tmp_path / "a.mcap", port)
        news = told(view)
    assert news == (
        f"live view: it has ended (Cannot serve the live view on port {port}: it is in use; give another port.); "
        f"the test goes on, and rths live {tmp_path / 'a.mcap'} shows it again."
    )
    assert view.news() == ""
    view.close()


def test_a_view_that_cannot_be_started_gives_one_line(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr("sys.executable", str(tmp_path / "nothing"))
    view = View(tmp_path / "a.mcap", 0)
    assert "No such file or directory" in view.news()
    assert view.news() == ""
    view.close()


class Test:
    """Processes of a test that end after some looks, whatever a view does."""

    __test__ = False
    names = ("master",)

    def __init__(self) -> None:
        self.looks = 0

    def all_ended(self) -> bool:
        self.looks += 1
        return self.looks > 3

    def ended(self) -> dict[str, int]:
        return {}

    def next_report(self, _timeout: float) -> None:
        return None

    def ask(self, name: str, number: signal.Signals) -> None:
        raise AssertionError(name, number)

    def kill(self, name: str) -> None:
        raise AssertionError(name)


class Unwished:
    """No request to stop."""

    presses = 0
    number = signal.SIGINT

    def __call__(self) -> str:
        return ""


class Crashed:
    """A view that has ended."""

    news = staticmethod(iter(["live view: it has ended (exit code 1)", "", "", ""]).__next__)


def test_a_view_that_has_crashed_does_not_end_the_test(
    capsys: pytest.CaptureFixture[str], short_plan: Plan
) -> None:
    processes: Any = Test()
    view: Any = Crashed()
    follow(processes, Ending(short_plan), RunProgress(1.0), Unwished(), view)
    assert processes.looks == 4
    assert capsys.readouterr().err == "live view: it has ended (exit code 1)\n"
