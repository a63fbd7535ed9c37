"""Commands on a plan with a stiffness matrix, a specimen with a mass and servo-hydraulics on a held command."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan.read import parse
from common.reality import reality
from common.recording.reader import read
from common.recording.run import Run
from diagnosis.recorded import record
from diagnosis.recorded.building.building import Building
from loop import closed_loop, substructure
from loop.signals import signals
from models.system import System
from simulation import virtual
from tests.diagnosis.cases import lab_a
from tests.helpers import SERVO_PLAN

Call = Callable[..., int]
BRIEF = SERVO_PLAN.replace("duration = 2.5", "duration = 1.0")


@pytest.fixture
def plan_file(tmp_path: Path) -> Path:
    path = tmp_path / "servo.toml"
    path.write_text(BRIEF)
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path, plan = tmp_path_factory.mktemp("servo") / "run.mcap", parse(BRIEF, Path())
    assert virtual.run(virtual.assemble(plan, reality.as_planned(plan), path), lambda: "") is None
    return path


def of_master(run: Run) -> dict[str, Any]:
    return run.columns["master"]


def test_a_test_in_virtual_time_equals_the_closed_loop_and_its_replay(call: Call, recording: Path) -> None:
    run, plan = read(recording), parse(BRIEF, Path())
    ground = substructure.ground_rows(plan, substructure.motion(plan))
    expected = signals(plan, closed_loop.simulate(plan, ground, seed=plan.test.seed))
    for name in ("displacement", "numerical_force", "column_force", "actuator_command"):
        assert np.array_equal(of_master(run)[name], expected[name]), name
    assert call("replay", recording) == 0


def test_the_times_of_ticks_are_rounded_independently(recording: Path) -> None:
    run = read(recording)
    stamps = np.asarray(run.log_ns["master"]) - run.log_ns["master"][0]
    assert np.abs(stamps - np.arange(stamps.size) * 1e9 / 4096.0).max() <= 0.5
    assert set(np.diff(stamps).tolist()) == {244_140, 244_141}


def test_the_report_and_the_summary_accept_the_recording(
    call: Call, recording: Path, capsys: Any, tmp_path: Path
) -> None:
    assert call("inspect", recording) == 0
    assert "hybrid simulation error energy" in capsys.readouterr().out
    assert call("report", recording, "-o", tmp_path / "page.html") == 0
    assert "servo_hydraulic" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_the_parts_of_a_diagnosis_are_replayed_to_within_the_noise(recording: Path) -> None:
    run, plan = read(recording), parse(BRIEF, Path())
    built = record.build(run)
    lab, building = lab_a(built), Building(built)
    error = lab.measured - lab.predict(System(plan))
    assert np.abs(np.std(error, axis=0) / [1.6e-5, 2.2] - 1.0).max() < 0.05
    assert np.array_equal(building.predict(System(plan)), building.measured)
    names = {item.name for item in lab.nuisances}
    assert {"actuator.servo.valve", "actuator.servo.gain", "column.mass", "column.damping"} <= names
    assert not names & {"actuator.gain", "actuator.time_constant", "actuator.servo.delay"}
    assert {item.name for item in building.nuisances} == {
        "structure.mass",
        "structure.stiffness",
        "structure.damping_ratio",
    }
    for nuisance in (*lab.nuisances, *building.nuisances):
        assert nuisance.moved(System(plan), 1.0) != System(plan)
    offered = {effect.name for effect in lab.candidates}
    assert {"actuator.delay", "actuator.compliance", "column.yielding"} <= offered
    assert not offered & {"actuator.time_constant", "actuator.backlash"}


def test_an_effect_that_servo_hydraulics_cannot_have_is_refused_in_one_sentence(
    call: Call, plan_file: Path, capsys: Any, tmp_path: Path
) -> None:
    secret = tmp_path / "secret.toml"
    secret.write_text("[[effect]]\nname = 'actuator.backlash'\nwidth = 1e-4\n")
    assert call("run", plan_file, "--virtual", "--reality", secret, "-o", tmp_path / "a.mcap") == 2
    error = capsys.readouterr().err
    assert "'actuator.backlash' needs the actuator model 'fopdt', but the plan has 'servo_hydraulic'" in error


def test_the_plan_is_simulated_with_ideal_transfer_systems(
    call: Call, plan_file: Path, tmp_path: Path
) -> None:
    path = tmp_path / "ideal.mcap"
    assert call("simulate", plan_file, "--ideal", "-o", path) == 0
    columns = of_master(read(path))
    assert np.array_equal(columns["column_displacement"], columns["column_target"])
    stiff = 1.19e6 * columns["column_displacement"]
    assert np.std(columns["column_force"] - stiff) > 0.001 * np.std(stiff)  # mass and dashpot are felt


@pytest.mark.slow
def test_identification_finds_the_lag_that_is_closest_to_servo_hydraulics(
    call: Call, plan_file: Path, capsys: Any, tmp_path: Path
) -> None:
    path = tmp_path / "bench.mcap"
    assert call("bench", "actuator", plan_file, "--only", "step", "--only", "sine 1", "-o", path) == 0
    capsys.readouterr()
    assert call("identify", path, "--json") == 0
    (report,) = json.loads(capsys.readouterr().out)["parts"]
    assert report["model"] == "equivalent first-order lag of a servo-hydraulic actuator"
    found = {name: item["value"] for name, item in report["parameters"].items()}
    assert found["delay"] + found["time_constant"] == pytest.approx(0.0251, rel=0.03)
    assert found["gain"] == pytest.approx(1.0 / 0.99254, rel=2e-3)
    assert call("identify", path) == 0
    text = capsys.readouterr().out
    assert "\nparameters are those of the equivalent first-order lag of a servo-hydraulic actuator\n" in text
