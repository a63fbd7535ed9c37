"""The plug-in in a child pytest, as a user's own test run has it."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from common import signals
from common.recording.writer import Recording
from tests.helpers import ROOT

ROWS = (signals.SEQ, signals.Signal("feedback_one_way", "s", "feedback"))
CASE = """
def test_latency(latency_budget):
    report = latency_budget("run.mcap")
    assert report.status == "within"
    assert report.exit_code == 0
"""


def recording(path: Path, latency: float, stolen: str) -> None:
    written = Recording(path, "trial", 1, {"latency": ROWS})
    for seq in range(600):
        written.add("latency", seq, seq, (seq, latency))
    written.metadata("real_time", {"master.stolen_share": stolen})
    written.close({})


def child(folder: Path, *words: str, case: str = CASE) -> tuple[int, str]:
    """A run with the plug-in loaded explicitly; an installed one, the same under another name, is left out."""
    return pytest_in(
        folder, "-p", "rths.pytest_plugin", *words, case=case, PYTEST_DISABLE_PLUGIN_AUTOLOAD="1"
    )


def pytest_in(folder: Path, *words: str, case: str = CASE, **variables: str) -> tuple[int, str]:
    (folder / "test_case.py").write_text(case)
    given = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    command = [sys.executable, "-m", "pytest", "-rs", "-W", "error", *words, "test_case.py"]
    done = subprocess.run(
        command,
        cwd=folder,
        env=given | {"PYTHONPATH": str(ROOT)} | variables,
        capture_output=True,
        text=True,
    )
    return done.returncode, done.stdout + done.stderr


def installed(folder: Path) -> dict[str, str]:
    """Variables under which Python finds an installation of rths with the entry points of pyproject.toml."""
    tables = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    entries = "".join(f"{name} = {place}\n" for name, place in tables["entry-points"]["pytest11"].items())
    folder = folder / "site"
    place = folder / f"rths-{tables['version']}.dist-info"
    place.mkdir(parents=True)
    (place / "METADATA").write_text(f"Metadata-Version: 2.1\nName: rths\nVersion: {tables['version']}\n")
    (place / "entry_points.txt").write_text(f"[pytest11]\n{entries}")
    return {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}


def test_a_recording_within_its_budget_passes(tmp_path: Path) -> None:
    recording(tmp_path / "run.mcap", 1e-4, "0.0")
    code, out = child(tmp_path)
    assert code == 0, out
    assert "1 passed" in out


def test_a_recording_over_its_budget_fails_with_the_table(tmp_path: Path) -> None:
    recording(tmp_path / "run.mcap", 1.2e-3, "0.0")
    code, out = child(tmp_path)
    assert code == 1
    assert "1 failed" in out
    assert "feedback_one_way p99  1200 µs" in out
    assert "over the budget: feedback_one_way p50, feedback_one_way p99" in out
    assert "Traceback" not in out


def test_a_recording_that_is_not_judged_skips_with_the_figures(tmp_path: Path) -> None:
    recording(tmp_path / "run.mcap", 1.2e-3, "0.2")
    code, out = child(tmp_path)
    assert code == 0, out
    assert "1 skipped" in out
    assert "The host took 20.0 % of the processors' time of the master" in out
    assert "feedback_one_way p99  1200 µs" in out


@pytest.mark.slow
@pytest.mark.parametrize("words", [["--latency-budget", "own.toml"], []])
def test_a_budget_comes_from_the_option_or_from_the_call(tmp_path: Path, words: list[str]) -> None:
    recording(tmp_path / "run.mcap", 1.2e-3, "0.0")
    (tmp_path / "own.toml").write_text("[feedback_one_way]\np99 = 2e-3\n")
    call = 'latency_budget("run.mcap")' if words else 'latency_budget("run.mcap", budget="own.toml")'
    code, out = child(tmp_path, *words, case=f"def test_latency(latency_budget):\n    {call}\n")
    assert code == 0, out


def test_a_mistake_gives_one_sentence(tmp_path: Path) -> None:
    code, out = child(tmp_path)
    assert code == 1
    assert (
        out.count(
            "Cannot read the recording run.mcap: No such file or directory; give the path of a file (MCAP)."
        )
        == 1
    )
    assert "Error" not in out.replace("FAILED", "")
    assert "pytest_plugin.py" not in out
    assert "During handling" not in out


def test_the_fixture_is_available_where_rths_is_installed(tmp_path: Path) -> None:
    variables = installed(tmp_path)
    recording(tmp_path / "run.mcap", 1e-4, "0.0")
    code, out = pytest_in(tmp_path, **variables)
    assert code == 0, out
    assert "1 passed" in out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "more"),
    [
        (["-p", "rths"], {}),
        (["-p", "rths.pytest_plugin"], {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}),
        (["-p", "no:rths", "-p", "rths.pytest_plugin"], {}),
    ],
)
def test_the_plugin_can_be_named_explicitly_where_it_is_installed(
    tmp_path: Path, words: list[str], more: dict[str, str]
) -> None:
    variables = installed(tmp_path) | more
    recording(tmp_path / "run.mcap", 1e-4, "0.0")
    code, out = pytest_in(tmp_path, *words, **variables)
    assert code == 0, out
