"""`rths identify` on measurements of others: behind a filter, of a specimen with a law, of a part that does more."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from models.specimens.fit import forces
from rths.prepare.identify import determined

STEP, ROWS = 1e-3, 6000
TIMES = STEP * np.arange(ROWS)
MOTION = 0.02 * np.sin(2.0 * np.pi * 0.7 * TIMES) * np.minimum(TIMES, 1.0)  # m
NOISE = np.random.default_rng(1).standard_normal(ROWS)


@pytest.fixture
def identified(call: Any, tmp_path: Path, capsys: Any) -> Any:
    """Import columns under a plan and a map, and identify; what is said."""

    def said(columns: Any, plan: str, signals: str, *more: str) -> str:
        np.savetxt(tmp_path / "a.csv", np.column_stack(columns), "%.9g", ",", header="a,b", comments="")
        (tmp_path / "plan.toml").write_text(f'[test]\ninterval = {STEP}\n[slave]\nkind = "none"\n{plan}')
        (tmp_path / "map.toml").write_text(f'plan = "plan.toml"\nrate = {1.0 / STEP}\n[signals]\n{signals}')
        path = tmp_path / "a.mcap"
        assert call("import", tmp_path / "a.csv", "--map", tmp_path / "map.toml", "-o", path) == 0
        capsys.readouterr()
        assert call("identify", path, *more) == 0
        return str(capsys.readouterr().out)

    return said


def value(said: str, name: str) -> float:
    """The first value of a parameter in what is said."""
    return float(next(line.split()[1] for line in said.splitlines() if line.split()[:1] == [name]))


COLUMN = 'column_displacement = { column = "a" }\ncolumn_force = { column = "b" }\n'


def test_the_filter_that_a_map_states_is_no_delay_of_the_drive(identified: Any) -> None:
    from common.recording.logger.low_pass import LoggerFilter

    command = np.cumsum(np.random.default_rng(2).standard_normal(ROWS)) * 1e-5
    position, share = np.zeros(ROWS), 1.0 - math.exp(-STEP / 0.03)
    for k in range(ROWS - 1):  # a lag of 30 ms behind a held command
        position[k + 1] = position[k] + share * (command[k] - position[k])
    read = LoggerFilter("butterworth", 4, 40.0).filtered(position, STEP) + 1e-7 * NOISE
    signals = (
        'actuator_command = { column = "a" }\ncolumn_displacement = { column = "b", '
        'filter = { type = "butterworth", order = 4, cutoff = 40.0 } }\n'
    )
    plan = '[actuator]\ncommand = "held"\n[compensator]\nkind = "none"\n'
    said = identified([command, read], plan, signals)
    assert value(said, "time_constant") == pytest.approx(0.03, rel=0.01)
    assert value(said, "delay") == pytest.approx(0.0, abs=2e-4)  # the filter is late by 10 ms
    assert "The model leaves" not in said


def test_a_specimen_of_the_plans_model_is_fitted_with_that_and_its_spring_means_little(
    identified: Any,
) -> None:
    law = {"stiffness": 20e6, "push": 40e3, "pull": 42e3, "play": 0.0, "corner": 0.0}
    said = identified(
        [MOTION, forces("slider", law, MOTION) + 50.0 * NOISE],
        '[column]\nmodel = "slider"\nstiffness = 20e6\npush = 40e3\npull = 40e3\n',
        COLUMN,
    )
    assert "column, model slider" in said
    assert value(said, "push") == pytest.approx(40e3, rel=2e-3)
    assert value(said, "pull") == pytest.approx(42e3, rel=2e-3)
    assert said.index("column, model slider") < said.index("\ncolumn\n")
    assert "% of the signal, which the model above describes or leaves.\n" in said
    assert "The model leaves" not in said


def test_a_planned_dashpot_is_identified_beside_the_spring(identified: Any) -> None:
    force = 2e6 * MOTION + 1.5e5 * np.gradient(MOTION, STEP) + 50.0 * NOISE
    said = identified([MOTION, force], '[column]\nmodel = "linear"\nstiffness = 2e6\ndamping = 1e5\n', COLUMN)
    assert value(said, "stiffness") == pytest.approx(2e6, rel=1e-3)
    assert value(said, "damping") == pytest.approx(1.5e5, rel=1e-3)


def test_an_interval_over_many_powers_of_ten_says_nothing() -> None:
    assert determined(1.0, 2.0) == {"low": 1.0, "high": 2.0}
    assert determined(-1.0, 1e9) == {"low": -1.0, "high": 1e9}
    assert determined(1e-24, 3e19) == {"low": None, "high": None}


def test_a_planned_spring_stands_first_and_a_planned_dashpot_without_one_too(identified: Any) -> None:
    said = identified(
        [MOTION, 2e6 * MOTION + 50.0 * NOISE], '[column]\nmodel = "linear"\nstiffness = 2e6\n', COLUMN
    )
    assert said.index("\ncolumn\n") < said.index("column, model linear")


def test_a_dashpot_without_a_planned_spring_stands_before_it(identified: Any) -> None:
    force = 1.5e5 * np.gradient(MOTION, STEP) + 50.0 * NOISE
    said = identified([MOTION, force], '[column]\nmodel = "linear"\nstiffness = 0.0\ndamping = 1e5\n', COLUMN)
    assert said.index("damping ") < said.index("stiffness ")
    assert value(said, "damping") == pytest.approx(1.5e5, rel=1e-3)


SPRING = '[column]\nmodel = "linear"\nstiffness = 2e6\n'


@pytest.mark.parametrize("most", ["24990", "24.99 kN"])
def test_rows_beyond_a_largest_force_are_left_out_and_counted(most: str, identified: Any) -> None:
    force = np.clip(2e6 * MOTION + 10.0 * NOISE, -25e3, 25e3)  # as a load cell cuts it off
    said = identified([MOTION, force], SPRING, COLUMN, "--max-force", most)
    beyond = int(np.count_nonzero(np.abs(np.round(force, 4)) > 24990.0))
    assert value(said, "stiffness") == pytest.approx(2e6, rel=1e-3)
    assert said.count(f"left out, as their force is above 24990 N: {beyond} of {ROWS} rows\n") == 2
    assert "The model leaves" not in said


def test_a_law_goes_along_rows_whose_force_is_left_out(identified: Any) -> None:
    law = {"stiffness": 20e6, "yield_displacement": 2e-3, "hardening": 0.1}
    force = forces("bilinear", law, MOTION) + 20.0 * NOISE
    top = 55e3
    plan = '[column]\nmodel = "bilinear"\nstiffness = 20e6\nyield_displacement = 2e-3\nhardening = 0.1\n'
    said = identified([MOTION, np.clip(force, -top, top)], plan, COLUMN, "--max-force", "54.9 kN")
    assert value(said, "yield_displacement") == pytest.approx(2e-3, rel=0.01)
    assert value(said, "hardening") == pytest.approx(0.1, rel=0.02)
    assert "misfit (NRMSE): 0.000" in said


def test_a_largest_force_is_one_of_a_column_above_zero(
    identified: Any, call: Any, tmp_path: Path, capsys: Any
) -> None:
    identified([MOTION, 2e6 * MOTION], SPRING, COLUMN)
    path = tmp_path / "a.mcap"
    for given, complaint in {
        "0": "--max-force is 0, but must be a force above zero, such as 40e3 or '40 kN'.",
        "nan": "--max-force is nan, but must be a force above zero",
        "-5": "must be a force above zero",
        "5 mm": "--max-force",
        "much": "--max-force",
        "1e-9": "rows have a column_force within --max-force 1e-09 N, but 20 are needed",
    }.items():
        assert call("identify", path, f"--max-force={given}") == 2
        said = capsys.readouterr().err
        assert complaint in said, given
        assert said.count("\n") == 1
    assert call("identify", path, "--max-force", "1e3", "--plan", tmp_path / "plan.toml") == 2
    assert "leave out --plan" in capsys.readouterr().err


def test_a_largest_force_without_a_column_is_refused(
    identified: Any, call: Any, tmp_path: Path, capsys: Any
) -> None:
    signals = 'actuator_command = { column = "a" }\ncolumn_displacement = { column = "b" }\n'
    identified([MOTION, MOTION + 1e-7 * NOISE], '[compensator]\nkind = "none"\n', signals)
    assert call("identify", tmp_path / "a.mcap", "--max-force", "1e3") == 2
    assert "--max-force is for the force of a column, and none of" in capsys.readouterr().err
