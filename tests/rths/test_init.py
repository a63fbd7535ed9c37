"""`rths init`: the files that it writes run as they are, and replace nothing."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path
from typing import Any

import pytest

from common.plan import read as plans
from common.terminal import cli


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_the_plan_of_init_is_the_default_test_under_another_name(call: Any, tmp_path: Path) -> None:
    assert call("init", "my_test") == 0
    made, default = plans.load(tmp_path / "my_test.toml"), plans.load(cli.plan_path("default"))
    mine, theirs = made.tables(), default.tables()
    assert (mine.pop("test"), theirs.pop("test"))[0] == {
        "name": "my_test",
        "duration": 20.0,
        "interval": 0.002,
        "seed": 1,
    }
    assert mine == theirs


def test_a_rig_whose_methods_are_not_written_refuses_to_arm(call: Any, capsys: Any, tmp_path: Path) -> None:
    call("init", "my_test")
    plan = tmp_path / "my_test.toml"
    commented = plan.read_text()
    plan.write_text(commented.replace("# [master.rig]", "[master.rig]").replace("# class = ", "class = ", 1))
    assert call("run", plan, "--virtual", "--duration", "0.1") == 3
    assert "arm() of ColumnRig is not written yet" in capsys.readouterr().err


def test_init_replaces_no_file_and_leaves_no_partial_one(call: Any, capsys: Any, tmp_path: Path) -> None:
    (tmp_path / "mine_rig.py").write_text("my work\n")
    assert call("init", "mine") == 2
    assert "mine_rig.py exists and is not replaced" in capsys.readouterr().err
    assert not (tmp_path / "mine.toml").exists()
    assert call("init", "mine", "--force") == 0
    assert "class ColumnRig" in (tmp_path / "mine_rig.py").read_text()


def test_a_name_that_no_test_can_have_is_refused(call: Any, capsys: Any) -> None:
    assert call("init", "My Test") == 2
    assert (
        capsys.readouterr().err
        == "rths: 'My Test' is no name of a test: use lower-case letters, digits, - and _.\n"
    )


def test_the_printed_version_is_that_of_the_package(call: Any, capsys: Any) -> None:
    assert call("--version") == 0
    assert capsys.readouterr().out == f"rths {importlib.metadata.version('rths')}\n"
