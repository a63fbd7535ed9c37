"""A report for the files of a laboratory: its name, the operator, the calibration of sensors, PDF."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from common.plan.plan import Plan
from common.plan.read import from_tables
from common.reality.reality import as_planned
from report.page import pdf
from simulation import virtual
from tests import browser

SAID = {
    "laboratory": "Laboratory 4",
    "operator": "A. Operator",
    "calibration": {
        "column_force": {"due": "2001-01-01", "certificate": "F-2231"},
        "column_displacement": {"due": "2999-01-01"},
    },
}


@pytest.fixture(scope="module")
def recording(short_plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short test whose plan gives the texts of its report."""
    tables = short_plan.written()
    tables["test"]["duration"] = 0.5
    plan = from_tables(tables | {"report": SAID}, Path())
    path = tmp_path_factory.mktemp("filed") / "filed.mcap"
    assert virtual.run(virtual.assemble(plan, as_planned(plan), path), str) is None
    return path


def test_the_report_shows_laboratory_operator_and_calibration_and_is_printed_to_pdf(
    call: Any, capsys: Any, recording: Path, tmp_path: Path
) -> None:
    if browser.chromium() is None:
        pytest.skip("there is no Chromium on this machine")
    page, printed = tmp_path / "a.html", tmp_path / "a.pdf"
    assert call("report", recording, "-o", page, "--pdf", printed, "--json") == 0
    assert json.loads(capsys.readouterr().out)["pdf"] == str(printed)
    text = page.read_text()
    for said in ("Laboratory 4", "A. Operator", "Calibration of sensors", "F-2231", "2001-01-01"):
        assert said in text
    assert printed.read_bytes().startswith(b"%PDF")
    assert printed.stat().st_size > 20_000


def test_check_names_the_calibration_that_is_overdue(call: Any, capsys: Any, tmp_path: Path) -> None:
    plan = tmp_path / "plan.toml"
    plan.write_text("[report.calibration.column_force]\ndue = 2001-01-01\n")
    assert call("check", plan) == 0
    assert (
        "The calibration of column_force was due on 2001-01-01: calibrate the sensor"
        in capsys.readouterr().out
    )


def test_a_pdf_needs_a_browser_and_a_separate_file(
    call: Any, capsys: Any, recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert call("report", recording, "-o", tmp_path / "a.html", "--pdf", tmp_path / "a.html") == 2
    assert "-o and --pdf name one file" in capsys.readouterr().err
    monkeypatch.setattr(pdf, "BROWSERS", ())
    assert call("report", recording, "-o", tmp_path / "b.html", "--pdf", tmp_path / "b.pdf") == 2
    assert "printed by Chromium or Chrome, and there is none" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
