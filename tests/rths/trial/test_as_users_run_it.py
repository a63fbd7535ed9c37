"""A fixed part of the blind trial, as users run it: real recordings, the diagnosis in a process of its own."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from tests.helpers import ROOT
from tests.processes import environment, finished

CASES = 12
CALM = ("no_gap", "within_tolerances")  # verdicts that name no effect


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_diagnosis_names_hidden_effects_in_real_recordings(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "rths", "blind", "--cases", str(CASES), "--duration", "20"]
    command += ["--jobs", "2", "--seed", "7", "-o", str(tmp_path / "trial"), "--json"]
    done = finished(*command, seconds=500.0, cwd=ROOT, env=environment())
    assert done.returncode in (0, 1), done.stderr
    result = json.loads(done.stdout)
    cases = result["cases"]
    assert len(cases) == CASES
    plain = [case for case in cases if case["kind"] in ("catalogue", "formula") and case["size"] >= 2.0]
    assert plain
    # a small compliance hides inside the tolerance of the actuator's gain: then nothing is named, never another effect
    assert all(case["named"] or case["status"] in CALM for case in plain)
    assert sum(case["named"] for case in plain) >= len(plain) - 1
    assert all(case["status"] in CALM for case in cases if case["kind"] == "clean")
    assert (tmp_path / "trial" / "index.html").exists()


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_building_tells_the_filter_of_a_logger_where_machines_do_nothing_fast(tmp_path: Path) -> None:
    """Laboratories alone take a digital filter of 100 Hz for one of 60 Hz here, which the building is not behind."""
    command = [sys.executable, "-m", "rths", "blind", "--set", "loggers", "--seed", "9679", "--case", "39"]
    done = finished(
        *command, "-o", str(tmp_path / "trial"), "--json", seconds=250.0, cwd=ROOT, env=environment()
    )
    assert done.returncode in (0, 1), done.stderr
    (case,) = json.loads(done.stdout)["cases"]
    assert case["kind"] == "clean"
    assert case["status"] in CALM
