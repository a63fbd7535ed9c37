"""`rths budget` as a user calls it, on recordings in virtual time."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from common.plan.plan import Plan
from common.plan.read import with_test
from common.reality import reality
from simulation import virtual
from tests.helpers import ROOT

LINK = """
class Link:
    def __init__(self, seed, delay, every, direction="feedback"):
        self.delay, self.every, self.direction = delay, every, direction

    def fate(self, direction, seq, t):
        return self.delay if direction == self.direction and seq % self.every == 3 else 0.0
"""


@pytest.fixture
def call(call: Any) -> Any:
    return partial(call, "budget")


def recorded(plan: Plan, folder: Path, options: str) -> Path:
    (folder / "link.py").write_text(LINK)
    (folder / "real.toml").write_text(f'[link]\nclass = "link.py:Link"\noptions = {options}\n')
    path = folder / "late.mcap"
    bench = virtual.assemble(plan, reality.load(folder / "real.toml", plan), path)
    assert virtual.run(bench, lambda: "") is None
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        "{ delay = 1e-3, every = 50 }",
        '{ delay = 1e-3, every = 50, direction = "command" }',
        "{ delay = 3e-3, every = 50 }",
    ],
)
def test_a_recording_with_two_percent_of_delays_is_over_its_budget(
    options: str, call: Any, capsys: Any, short_plan: Plan, tmp_path: Path
) -> None:
    path = recorded(with_test(short_plan, duration=5.0), tmp_path, options)
    assert call(path, "--json") == 1
    report = json.loads(capsys.readouterr().out)
    over = [item["name"] for item in report["checks"] if item["verdict"] == "over"]
    assert report["status"] == "over"
    assert "late share" in over
    assert report["late"]["share"] >= 0.02
    assert report["bare_loop"] is None


def test_rare_delays_are_within_the_default_budget_and_over_a_strict_one(
    call: Any, capsys: Any, short_plan: Plan, tmp_path: Path
) -> None:
    path = recorded(short_plan, tmp_path, "{ delay = 1e-3, every = 400 }")
    assert call(path) == 0
    budget = tmp_path / "strict.toml"
    budget.write_text("[late]\nlongest_gap = 0\n")
    assert call(path, "--budget", budget) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "over the budget: longest gap"


def test_mistakes_give_one_sentence_and_exit_code_2(
    call: Any, capsys: Any, virtual_recording: Path, tmp_path: Path
) -> None:
    assert call(tmp_path / "no.mcap") == 2
    assert call(virtual_recording, "--budget", tmp_path / "no.toml") == 2
    (tmp_path / "b.toml").write_text("[round_trip]\np95 = 1.0\n")
    assert call(virtual_recording, "--budget", tmp_path / "b.toml") == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert [line.split(":")[0] for line in told.err.splitlines()] == ["rths"] * 3
    assert "did you mean p" in told.err


def test_a_closed_pipe_changes_no_exit_code(short_plan: Plan, tmp_path: Path) -> None:
    path = recorded(short_plan, tmp_path, "{ delay = 1e-3, every = 50 }")
    process = subprocess.Popen(
        [sys.executable, "-m", "rths", "budget", str(path), "--json"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    with process.stderr as stream:
        assert stream.read() == b""
    assert process.wait(60.0) == 1
