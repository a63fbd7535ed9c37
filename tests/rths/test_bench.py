"""Bench tests and identification as a user calls them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan.patience import strict
from common.plan.read import load
from common.recording.reader import read
from laboratories.kinds import kind_of
from simulation.benches import reach
from tests.helpers import ROOT

NOMINAL: dict[str, dict[str, tuple[float, float]]] = {
    "column": {"elastic_stiffness": (12.5e6, 0.01)},
    "actuator": {"delay": (0.014, 0.02), "time_constant": (0.030, 0.02), "gain": (1.0, 0.01)},
    "table": {"frequency": (15.0, 0.01), "damping_ratio": (0.7, 0.01), "delay": (0.004, 0.05)},
    "damper": {
        "mass": (16.0, 0.01),
        "stiffness": (56.8, 0.01),
        "damping": (6.0, 0.01),
        "motor_time_constant": (0.003, 0.02),
        "gain": (1.0, 0.01),
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("part", NOMINAL)
def test_the_planned_parameters_are_identified_from_the_bench_recording(
    part: str,
    call: Any,
    capsys: Any,
    tmp_path: Path,
) -> None:
    path = tmp_path / "bench.mcap"
    assert call("bench", part, "default", "-o", path, "--json") == 0
    summary = json.loads(capsys.readouterr().out)
    run = read(path)
    assert run.finished
    topic = "master" if part in ("column", "actuator") else "slave"
    assert run.sequences[topic].tolist() == list(range(summary["ticks"]))
    assert call("identify", path, "--json") == 0
    report, *laws = json.loads(capsys.readouterr().out)["parts"]
    assert [law["part"] for law in laws] == ["column, model linear"] * (part == "column")
    for name, (value, share) in NOMINAL[part].items():
        found = report["parameters"][name]
        assert found["value"] == pytest.approx(value, rel=share), name
        assert found["low"] < found["value"] < found["high"]
    if part == "actuator":
        assert report["tangent"]["delay"]["value"] == pytest.approx(0.014, abs=1e-3)
        assert report["tangent"]["time_constant"]["value"] == pytest.approx(0.030, abs=1e-3)
    if part == "column":
        assert [round(cycle["amplitude"] * 1e3, 1) for cycle in report["cycles"]] == sorted(
            3 * [1.5, 3, 4.5, 6, 7.5]
        )


def test_a_realitys_effect_appears_in_the_bench_recording_and_its_name_does_not(
    call: Any,
    capsys: Any,
    tmp_path: Path,
) -> None:
    secret = tmp_path / "secret.toml"
    secret.write_text("[actuator]\ndelay = 0.020\n")
    path = tmp_path / "bench.mcap"
    assert call("bench", "actuator", "default", "--reality", secret, "--only", "step", "-o", path) == 0
    assert b"secret" not in path.read_bytes()
    capsys.readouterr()
    assert call("identify", path, "--json") == 0
    (report,) = json.loads(capsys.readouterr().out)["parts"]
    assert report["parameters"]["delay"]["value"] == pytest.approx(0.020, abs=2e-4)


def test_a_limit_stops_a_bench_test_and_the_recording_is_kept(
    call: Any,
    capsys: Any,
    tmp_path: Path,
) -> None:
    plan = tmp_path / "plan.toml"
    plan.write_text("[limits]\ncolumn_displacement = 0.002\n")
    path = tmp_path / "bench.mcap"
    assert call("bench", "column", plan, "-o", path) == 3
    assert "column_displacement is 0.00200" in capsys.readouterr().err
    run = read(path)
    assert run.finished
    assert run.metadata["summary"]["outcome"] == "stopped"
    assert 0.002 < np.max(np.abs(run.columns["master"]["column_displacement"])) < 0.0021


@pytest.mark.slow
def test_a_bench_test_gives_the_same_numbers_in_real_time(call: Any, tmp_path: Path) -> None:
    runs = []
    for clock in ("--virtual", "--real-time"):
        path = tmp_path / f"{clock}.mcap"
        assert call("bench", "table", "default", "--only", "step", clock, "-o", path) == 0
        runs.append(read(path))
    virtual, real = runs
    for name, values in virtual.columns["slave"].items():
        assert np.array_equal(values, real.columns["slave"][name]), name
    assert np.all(np.diff(real.log_ns["slave"]) == 2_000_000)


def test_wrong_requests_get_one_sentence(
    call: Any,
    capsys: Any,
    tmp_path: Path,
    virtual_recording: Path,
) -> None:
    assert call("bench", "column", "default", "--only", "sweep", "-o", tmp_path / "a.mcap") == 2
    assert capsys.readouterr().err == "rths: The bench test of the column has no piece 'sweep': static.\n"
    path = tmp_path / "table.mcap"
    assert call("bench", "table", "default", "--only", "step", "-o", path) == 0
    capsys.readouterr()
    assert call("identify", path, "--part", "column") == 2
    assert "it needs column_displacement, column_force of the master" in capsys.readouterr().err
    assert call("identify", virtual_recording) == 0
    out = capsys.readouterr().out
    assert all(part in out for part in NOMINAL)


@pytest.mark.slow
def test_a_plug_in_laboratory_runs_the_same_bench_test(
    call: Any,
    capsys: Any,
    tmp_path: Path,
) -> None:
    assert call("bench", "column", ROOT / "examples" / "my_test.toml", "-o", tmp_path / "a.mcap") == 0
    assert "rths identify" in capsys.readouterr().out


@pytest.mark.slow
def test_a_hysteretic_model_is_fitted_to_the_realistic_column(
    call: Any,
    capsys: Any,
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.mcap"
    assert call("bench", "column", "rc_column", "-o", path) == 0
    capsys.readouterr()
    assert call("identify", path, "--fit", "clough", "--json") == 0
    cycles, fitted = json.loads(capsys.readouterr().out)["parts"]
    assert fitted["nrmse"] < 0.01
    assert fitted["parameters"]["stiffness"]["value"] == pytest.approx(32.7e6, rel=0.02)
    assert fitted["parameters"]["yield_displacement"]["value"] == pytest.approx(4.97e-3, rel=0.02)
    assert cycles["cycles"][-1]["stiffness"] < 0.5 * cycles["cycles"][0]["stiffness"]
    assert call("identify", path, "--fit", "clugh") == 2
    assert "did you mean clough?" in capsys.readouterr().err


@pytest.mark.parametrize(("file", "role"), [("two_columns", "slave.east"), ("viscous_damper.toml", "slave")])
def test_a_bench_test_of_an_emulation_has_the_same_reach_as_with_a_rig(file: str, role: str) -> None:
    plan = load(
        ROOT / ("examples" if file.endswith(".toml") else "rths/plans") / Path(file).with_suffix(".toml")
    )
    assert plan.eased
    kind = kind_of(plan, role)
    assert reach(plan.of(role), kind) == reach(strict(plan).of(role), kind)
    assert reach(plan, kind).velocity == 0.5 * kind.limits(strict(plan))[kind.limited.velocity]
