"""`rths live` and `rths run --live` as a user calls them: sentences and exit codes."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from common.recording.reader import length
from report.live.feed import Feed
from tests.helpers import ROOT
from tests.processes import HANG_S


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["live", "nothing.mcap"], "There is no recording nothing.mcap: give its path, or --wait"),
        (["live", "x", "--rate", "100"], "--rate 100 must be from 1 to 30 Hz."),
        (["live", "x", "--window", "0"], "--window 0 must be from 1 to 3600 s."),
        (["live", "x", "--port", "70000"], "--port 70000 must be from 1 to 65535"),
        (["run", "--virtual", "--live"], "--live shows a test in real time: leave out --virtual"),
    ],
)
def test_a_mistake_gives_one_sentence(words: list[str], sentence: str, call: Any, capsys: Any) -> None:
    assert call(*words) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"rths: {sentence}")
    assert err.count("\n") == 1


def test_a_file_that_is_not_a_recording_is_refused_before_anything_is_served(
    tmp_path: Path, monkeypatch: Any, call: Any, capsys: Any
) -> None:
    path = tmp_path / "a.mcap"
    path.write_text("no recording at all")
    monkeypatch.setattr("os.nice", lambda _more: 0)
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    assert call("live", path, "--no-browser") == 2
    assert "is not a readable MCAP recording" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "whole", "window"),
    [((), True, 4.5), (("--window", "2"), False, 2.0), (("--wait",), False, 10.0)],
)
def test_a_finished_recording_is_shown_completely_unless_a_window_is_given(
    options: tuple[str, ...], whole: bool, window: float, virtual_recording: Path, monkeypatch: Any, call: Any
) -> None:
    shown: list[Feed] = []

    class Server:
        url = "nowhere"

        def __init__(self, feed: Feed, _port: int, _rate: float) -> None:
            shown.append(feed)

        def run(self, _stopping: object, *, leave: bool) -> None:
            assert not leave

    monkeypatch.setattr("os.nice", lambda _more: 0)
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    monkeypatch.setattr("report.live.server.Server", Server)
    assert call("live", virtual_recording, "--no-browser", *options) == 0
    assert [feed.whole for feed in shown] == [whole]
    assert shown[0].window == pytest.approx(window, abs=0.5)


def test_an_unfinished_recording_is_shown_as_far_as_it_goes(virtual_recording: Path, tmp_path: Path) -> None:
    content = virtual_recording.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: len(content) // 2])
    assert length(cut) == 0.0
    assert length(tmp_path / "nothing.mcap") == 0.0
    assert 4.0 <= length(virtual_recording) < 5.0


def test_ctrl_c_ends_the_live_command_with_exit_code_0(virtual_recording: Path) -> None:
    words = [sys.executable, "-m", "rths", "live", str(virtual_recording), "--no-browser"]
    with subprocess.Popen(
        words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline().startswith("live view: http://127.0.0.1:")
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=HANG_S) == ("", "")
        assert process.returncode == 0
