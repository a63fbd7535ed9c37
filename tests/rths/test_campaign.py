"""`rths campaign`: its refusals, a complete campaign, and one that is killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from simulation.campaign.log import LOG
from tests.helpers import ROOT

GOAL = """
reality = "hidden.toml"
tests = 4
[limits]
drift = "15 mm"
growth = 30
[[candidate]]
record = "loma_prieta_1989_corralitos_000"
scales = [0.01, 0.1, 0.2]
durations = 5.0
"""
HIDDEN = """
seed = 7
[[effect]]
name = "actuator.velocity_limit"
velocity = 0.03
"""
END = "The cause is certain: actuator.velocity_limit, with 98 %."
PATIENCE = 300.0  # s, for a test that hangs


def written(folder: Path, goal: str = GOAL, hidden: str = HIDDEN) -> Path:
    (folder / "hidden.toml").write_text(hidden)
    (folder / "goal.toml").write_text(goal)
    return folder / "goal.toml"


@pytest.mark.parametrize(
    ("goal", "hidden", "words", "sentence"),
    [
        ("", "", (), "It has no test to choose from"),
        (GOAL, "[[effect]]\nname = 'actuator.dealy'\ndelay = 0.1\n", (), "Unknown effect 'actuator.dealy'"),
        (GOAL, HIDDEN, ("--played", "mine.mcap"), "--played is for the mode 'by hand'"),
        (GOAL, HIDDEN, ("--force",), "--force is for --compare-random"),
        (GOAL, HIDDEN, ("--jobs", "2"), "--jobs and --dask are for --compare-random"),
        (GOAL, HIDDEN, ("--compare-random", "0"), "--compare-random is 0, but must be at least 1"),
        ('mode = "by hand"\n[[candidate]]\n', HIDDEN, ("--compare-random", "1"), "plays in virtual time"),
        ('mode = "by hand"\n[[candidate]]\n', HIDDEN, ("--played", "mine.mcap"), "awaits no test"),
    ],
)
def test_a_campaign_that_cannot_be_played_is_refused_in_one_sentence(
    goal: str, hidden: str, words: tuple[str, ...], sentence: str, call: Any, capsys: Any, tmp_path: Path
) -> None:
    path = written(tmp_path, goal, hidden)
    assert call("campaign", path, "-o", tmp_path / "campaign", *words) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith("rths: ")
    assert sentence in said


@pytest.mark.slow
def test_a_campaign_that_is_killed_and_continued_gives_the_same_result(
    tmp_path: Path, capsys: Any, call: Any
) -> None:
    """The log of a campaign that was killed whenever it had grown is that of one that nobody killed."""
    path = written(tmp_path)
    assert call("campaign", path, "-o", tmp_path / "whole", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert [one["step"] for one in told["steps"]] == [
        "begun", "decided", "played", "diagnosed", "decided", "played", "diagnosed", "ended",
    ]  # fmt: skip
    assert told["steps"][-1]["text"] == END
    folder = tmp_path / "killed"
    for lines in range(1, 8):
        killed_at(path, folder, lines)
    assert call("campaign", path, "-o", folder) == 0
    assert f"{END}\npage: {folder / 'index.html'}\n" in capsys.readouterr().out
    assert steps(folder) == steps(tmp_path / "whole")
    names = [sorted(one.name for one in each.iterdir()) for each in (folder, tmp_path / "whole")]
    assert names[0] == names[1]
    page = (folder / "index.html").read_text()
    assert END in page
    assert "hidden.toml" not in page + (folder / LOG).read_text()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_campaign_in_real_time_that_is_ended_in_a_test_continues(
    number: signal.Signals, tmp_path: Path, capsys: Any, call: Any
) -> None:
    goal = GOAL.replace("tests = 4", 'tests = 1\nmode = "real time"').replace("[0.01, 0.1, 0.2]", "[0.01]")
    path, folder = written(tmp_path, goal), tmp_path / "campaign"
    words = [sys.executable, "-m", "rths", "campaign", str(path), "-o", str(folder)]
    with subprocess.Popen(words, cwd=ROOT, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert any(line.startswith("t ") for line in process.stderr), "the test did not begin"
        process.send_signal(number)
        said = process.stderr.read().splitlines()
        code = process.wait(PATIENCE)
    assert code == (3 if number == signal.SIGINT else -number)
    if number == signal.SIGINT:
        assert said[-1] == "rths: stopped by the user (SIGINT)."
    assert call("campaign", path, "-o", folder) == 1
    assert "All 1 tests are played" in capsys.readouterr().out
    assert [one["step"] for one in steps(folder)] == [
        "begun", "decided", "interrupted", "played", "diagnosed", "ended",
    ]  # fmt: skip
    assert (folder / "test-01-interrupted-1.mcap").is_file()


def steps(folder: Path) -> list[dict[str, Any]]:
    """The steps of a log; recordings hold the time of day, and so have a digest of their own."""
    found = [json.loads(line) for line in (folder / LOG).read_text().splitlines()]
    return [{name: value for name, value in one.items() if name != "digest"} for one in found]


def killed_at(goal: Path, folder: Path, lines: int) -> None:
    """Run the campaign, and kill it once its log has this many lines."""
    words = [sys.executable, "-m", "rths", "campaign", str(goal), "-o", str(folder)]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        ends = time.monotonic() + PATIENCE
        while time.monotonic() < ends and process.poll() is None:
            log = folder / LOG
            if log.exists() and log.read_bytes().count(b"\n") >= lines:
                os.kill(process.pid, signal.SIGKILL)
            time.sleep(0.02)
