"""`rths benchmark2020` as it is called."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from common.plan import read as plans
from validation.benchmark2020.problem import CASES, EL_CENTRO, SETTINGS, planned, with_compensator


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--plants", "-1"), "--plants is -1, but must be between 0 and 1000."),
        (("--jobs", "0"), "--jobs is 0, but must be at least 1, or -1 for all processors."),
        (("--seed", "-3"), "--seed is -3, but must be at least 0."),
        (("--only", "amp"), "Unknown setting 'amp' of the compensators"),
        (("--plan", "5"), "--plan is 5, but must be a case of the benchmark, 1 to 4."),
        (("--plan", "1", "--compensator", "abm"), "Unknown setting 'abm' of the compensators"),
        (("--only", ","), "--only names no setting of the compensators: give some of none, sample,"),
        (("--plan", "1", "--plants", "3"), "--plan writes a plan and runs nothing: leave out --plants."),
        (("--plan", "1", "--json"), "--plan writes a plan and runs nothing: leave out --json."),
        (("--compensator", "amb"), "--compensator says which plan --plan writes"),
        (("--plan", "1", "-o", "no/such.toml"), "There is no folder no for"),
    ],
)
def test_a_wrong_argument_of_the_benchmark_gives_one_sentence(
    call: Callable[..., int],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    complaint: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call("benchmark2020", *words) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_the_written_plan_is_that_of_the_comparison(
    call: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "case.toml"
    assert call("benchmark2020", "--plan", "4", "--compensator", "amb", "-o", place) == 0
    assert str(place) in capsys.readouterr().out
    wanted = with_compensator(planned(CASES[3], EL_CENTRO), SETTINGS["amb"])
    assert plans.load(place).digest() == wanted.digest()


@pytest.mark.slow
def test_the_command_writes_a_page_pictures_and_results(
    call: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "made" / "here"
    assert call("benchmark2020", "--plants", "0", "--only", "amb", "--json", "-o", folder) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == json.loads((folder / "results.json").read_text(encoding="utf-8"))
    assert [item["setting"] for item in found["settings"]] == ["amb"]
    assert found["settings"][0]["plants"] is None
    names = {path.name for path in folder.iterdir()}
    assert names == {"index.html", "results.json", "results.parquet", "compensators.png", "late_force.png"}
