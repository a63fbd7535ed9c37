"""The seed paper reproduced: every row is within its tolerance and can fail, and every picture is drawn."""

from __future__ import annotations

import copy
import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from common.recording.reader import read
from common.terminal.telling import untold
from tests.rths.report.pages import check_alone, check_in_browser
from validation.paper import experiments
from validation.paper.experiments import PaperEvidence
from validation.paper.figures import FIGURES
from validation.paper.page import page
from validation.paper.rows import apparent_damping, beyond, building, critical_delay, instability, rows
from validation.proof import draw_all


@pytest.fixture(scope="module")
def evidence(tmp_path_factory: pytest.TempPathFactory) -> PaperEvidence:
    return experiments.gather(tmp_path_factory.mktemp("experiments"), untold)


@pytest.mark.slow
def test_every_row_is_within_its_tolerance(evidence: PaperEvidence) -> None:
    table = rows(evidence)
    assert len(table) >= 19
    assert [f"{row.name}: {row.computed}" for row in table if not row.passed] == []


@pytest.mark.slow
def test_a_row_fails_if_its_number_is_wrong(evidence: PaperEvidence) -> None:
    wrong = copy.copy(evidence)
    wrong.damping = evidence.damping | {"paper": 0.05, "ideal": 0.045, "beyond": 0.05}
    wrong.critical_delay = (0.034, 0.0341)
    wrong.period = 0.51
    wrong.tests = evidence.tests | {"uncompensated": evidence.tests["pid"]}
    for maker in (building, instability, critical_delay, apparent_damping, beyond):
        assert not all(row.passed for row in maker(wrong)), maker.__name__


@pytest.mark.slow
def test_the_command_ends_with_exit_code_1_if_a_row_fails(
    evidence: PaperEvidence, tmp_path: Path, monkeypatch: Any, call: Any, capsys: Any
) -> None:
    wrong = copy.copy(evidence)
    wrong.critical_delay = (0.040, 0.0401)
    monkeypatch.setattr(experiments, "gather", lambda _folder, _say: wrong)
    assert call("reproduce", "-o", tmp_path) == 1
    out = capsys.readouterr().out
    assert "FAIL  critical delay" in out
    assert out.count("FAIL") == 1


@pytest.mark.slow
def test_the_command_writes_recordings_pictures_and_one_page(tmp_path: Path, call: Any, capsys: Any) -> None:
    assert call("reproduce", "-o", tmp_path, "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert all(row["passed"] for row in report["rows"])
    text = Path(report["page"]).read_text(encoding="utf-8")
    assert "http" not in text
    for figure in FIGURES:
        width, height = struct.unpack(">II", (tmp_path / figure.file).read_bytes()[16:24])
        assert width >= 1000
        assert height >= 400
        assert figure.caption in text
    for path in tmp_path.glob("*.mcap"):
        assert read(path).finished, path


@pytest.mark.slow
def test_the_page_of_the_reproduction_loads_nothing_and_is_drawn_in_a_browser(
    evidence: PaperEvidence, tmp_path: Path
) -> None:
    table, drawn = rows(evidence), draw_all(FIGURES, evidence, tmp_path)
    table[0] = replace(table[0], name="<b>period</b>", note="<script>")
    text = page(table, drawn)
    assert "<b>period</b>" in check_alone(text).text
    assert page(table, draw_all(FIGURES, evidence, tmp_path)) == text
    (tmp_path / "index.html").write_text(text, encoding="utf-8")
    check_in_browser(tmp_path / "index.html", tmp_path)


def test_a_folder_that_cannot_be_written_is_reported(tmp_path: Path, call: Any, capsys: Any) -> None:
    (tmp_path / "file").touch()
    assert call("reproduce", "-o", tmp_path / "file" / "x") == 2
    assert "give another folder with -o" in capsys.readouterr().err
