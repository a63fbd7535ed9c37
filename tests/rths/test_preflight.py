"""Pre-flight as a user sees it: refusals, and risks accepted by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.lab.preflight import Gate, RefusedError
from common.plan.laboratory_tables import CompensatorTable
from common.plan.plan import Plan
from common.plan.read import with_test
from common.reality import reality
from common.recording.reader import read
from common.recording.run import Run
from rths.__main__ import parser_for
from rths.perform.run import start_all
from simulation import virtual
from tests.helpers import ROOT
from validation.paper import experiments

UNSTABLE = "[test]\nduration = 1.0\n[compensator]\nkind = 'none'\n[control]\namd = false\n"
NEAR = "[test]\nduration = 4.0\n[limits]\ndamper_stroke = 0.01\n"


def noted(run: Run, code: str) -> list[tuple[str, str, str]]:
    return [(event["lab"], event["level"], event["text"]) for event in run.events if event["code"] == code]


@pytest.mark.parametrize(
    ("text", "name", "sentence"),
    [
        (UNSTABLE, "partition", "is unstable beyond 32.9 ms of delay, and 44.7 ms are expected"),
        (NEAR, "peaks", "the simulated damper_stroke exceeds 90% of its limit of 0.01 m"),
    ],
)
@pytest.mark.parametrize("verb", ["run --virtual", "run", "master"])
def test_a_risk_refuses_the_test_before_any_process_starts(
    verb: str, text: str, name: str, sentence: str, call: Any, capsys: Any, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.setattr("common.link.zenoh_link.ZenohLink", None)  # no link may open
    monkeypatch.setattr("rths.perform.processes.Processes.start", None)  # and no process start
    monkeypatch.setattr("rths.perform.run.warm_up", lambda: None)
    (tmp_path / "p.toml").write_text(text)
    output = ["-o", tmp_path / "a.mcap"] if verb != "master" else []
    assert call(*verb.split(), tmp_path / "p.toml", *output) == 3
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert sentence in captured.err
    assert captured.err.endswith(f"to run it all the same, give --accept-risk {name}.\n")
    assert not (tmp_path / "a.mcap").exists()


def test_each_passed_check_is_one_line_and_recorded(call: Any, capsys: Any, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    assert call("run", "--virtual", "--duration", "1", "-o", path, "--json") == 0
    lines = capsys.readouterr().err.splitlines()
    stable = "Stable up to 32.9 ms of delay; 2.2 ms expected (margin 15), costing 0.03 points of damping"
    assert lines[0].startswith(f"pre-flight: {stable}")
    assert lines[1].startswith("pre-flight: Simulated peaks reach ")
    assert sum("Stable" in line for line in lines) == 1
    run = read(path)
    assert [lab for lab, _, _ in noted(run, "preflight")] == ["master"] * 3
    assert [(lab, level) for lab, level, _ in noted(run, "sensors")] == [
        ("master", "info"),
        ("slave", "info"),
    ]
    assert noted(run, "accepted_risk") == []


def test_an_accepted_risk_is_recorded(call: Any, capsys: Any, tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(UNSTABLE)
    path = tmp_path / "a.mcap"
    assert call("run", "--virtual", tmp_path / "p.toml", "-o", path, "--accept-risk", "partition") == 0
    assert "pre-flight: risk 'partition' is accepted.\npre-flight: Simulated peaks" in capsys.readouterr().err
    ((lab, level, text),) = noted(read(path), "accepted_risk")
    assert (lab, level) == ("master", "warning")
    assert text.startswith("risk 'partition' accepted: the column's path is unstable beyond 32.9 ms")


@pytest.mark.parametrize("verb", ["run", "master", "slave", "record"])
def test_an_unknown_risk_gives_one_sentence(verb: str, call: Any, capsys: Any) -> None:
    assert call(verb, "default", "--accept-risk", "sensor") == 2
    assert capsys.readouterr().err == "rths: There is no risk 'sensor' to accept: did you mean sensors?\n"


@pytest.mark.parametrize(
    ("signal", "lab", "bias"), [("column_force", "A", 60e3), ("table_acceleration", "B", 4.0)]
)
def test_a_sensor_with_an_offset_refuses_the_test_when_its_laboratory_arms(
    signal: str, lab: str, bias: float, call: Any, capsys: Any, tmp_path: Path
) -> None:
    path, real = tmp_path / "a.mcap", tmp_path / "real.toml"
    real.write_text(f"[[effect]]\nname = 'sensor.{signal}.bias'\noffset = {bias}\n")
    words = ("run", "--virtual", "--duration", "1", "--reality", real, "-o", path)
    assert call(*words) == 3
    error = capsys.readouterr().err.splitlines()[-1]
    assert f"{signal} of laboratory {lab} is off zero by more than 10% of its limit (" in error
    assert "--accept-risk sensors" in error
    run = read(path)
    assert not run.ticks("master")
    assert not run.ticks("slave")
    assert call(*words, "--force", "--accept-risk", "sensors") == 0
    ((who, _, text),) = noted(read(path), "accepted_risk")
    assert who == {"A": "master", "B": "slave"}[lab]
    assert f"risk 'sensors' accepted: {signal} of laboratory {lab} is off zero" in text


def test_the_sensor_check_changes_no_bit_of_a_test(short_plan: Plan, tmp_path: Path) -> None:
    plan = with_test(short_plan, duration=1.0)
    runs = []
    for name, gate in (("with", Gate()), ("without", None)):
        path = tmp_path / f"{name}.mcap"
        assert virtual.run(virtual.assemble(plan, reality.as_planned(plan), path, gate=gate), str) is None
        runs.append(read(path))
    for topic in ("master", "slave"):
        for name, values in runs[0].columns[topic].items():
            assert np.array_equal(values, runs[1].columns[topic][name]), name


def test_a_users_rig_is_not_read_at_rest_unless_it_allows_that(
    call: Any, capsys: Any, tmp_path: Path
) -> None:
    plan = (ROOT / "examples" / "my_test.toml").read_text()
    lab = (ROOT / "examples" / "my_lab.py").read_text()
    (tmp_path / "my_test.toml").write_text(plan)
    said = []
    for more in ("", "    idle_readings = True\n"):
        (tmp_path / "my_lab.py").write_text(
            lab.replace('fixture."""\n\n    def __init__', f'fixture."""\n\n{more}    def __init__')
        )
        path = tmp_path / "a.mcap"
        code = call("run", tmp_path / "my_test.toml", "--virtual", "--duration", "1", "-o", path, "--force")
        said.append((code, capsys.readouterr().err))
    assert said[0][0] == 0
    assert "Sensor check skipped: class ColumnLab does not set idle_readings = True." in said[0][1]
    assert said[1][0] == 3  # its displacement has none of the noise that the plan says
    assert "column_displacement of laboratory A (ColumnLab) is frozen" in said[1][1]


def test_accepted_risks_are_handed_to_every_process(tmp_path: Path) -> None:
    started: dict[str, list[str]] = {}

    class Processes:
        def start(self, name: str, words: list[str]) -> None:
            started[name] = words

    words = ["--accept-risk", "link", "--accept-risk", "disk"]
    start_all(
        Processes(),  # type: ignore[arg-type]
        parser_for("run").parse_args(words),
        ["slave"],
        "tcp/127.0.0.1:1",
        tmp_path / "a.mcap",
    )
    assert set(started) == {"master", "slave", "recorder"}
    for name, given in started.items():
        place = given.index("--accept-risk")
        assert given[place : place + 4] == words, name


def test_the_papers_unstable_experiment_runs_only_with_its_risks_accepted(default_plan: Plan) -> None:
    plan = experiments.without_amd(experiments.compensated_by(default_plan, CompensatorTable("none", {})))
    gate = experiments.gate_of(experiments.UNSTABLE, plan)
    assert [risk.name for risk in gate.overruled] == ["partition", "peaks"]
    with pytest.raises(RefusedError):
        experiments.gate_of("another", plan)
