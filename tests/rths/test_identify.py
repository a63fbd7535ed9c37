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

    def said(columns: Any, plan: str, signals: str) -> str:
        np.savetxt(tmp_path / "a.csv", np.column_stack(columns), "%.9g", ",", header="a,b", comments="")
        (tmp_path / "plan.toml").write_text(f'[test]\ninterval = {STEP}\n[slave]\nkind = "none"\n{plan}')
        (tmp_path / "map.toml").write_text(f'plan = "plan.toml"\nrate = {1.0 / STEP}\n[signals]\n{signals}')
        path = tmp_path / "a.mcap"
        assert call("import", tmp_path / "a.csv", "--map", tmp_path / "map.toml", "-o", path) == 0
        capsys.readouterr()
        assert call("identify", path) == 0
        return str(capsys.readouterr().out)

    return said


def value(said: str, name: str) -> float:
    """The first value of a parameter in what is said."""
    return float(next(line.split()[1] for line in said.splitlines() if line.split()[:1] == [name]))


COLUMN = 'column_displacement = { column = "a" }\ncolumn_force = { column = "b" }\n'


def test_the_filter_that_a_map_states_is_no_delay_of_the_drive(identified: Any) -> None:
    from common.recording.imported import LoggerFilter

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
    assert "% of the signal: the part does something else as well" in said


def test_a_planned_dashpot_is_identified_beside_the_spring(identified: Any) -> None:
    force = 2e6 * MOTION + 1.5e5 * np.gradient(MOTION, STEP) + 50.0 * NOISE
    said = identified([MOTION, force], '[column]\nmodel = "linear"\nstiffness = 2e6\ndamping = 1e5\n', COLUMN)
    assert value(said, "stiffness") == pytest.approx(2e6, rel=1e-3)
    assert value(said, "damping") == pytest.approx(1.5e5, rel=1e-3)


def test_an_interval_over_many_powers_of_ten_says_nothing() -> None:
    assert determined(1.0, 2.0) == {"low": 1.0, "high": 2.0}
    assert determined(-1.0, 1e9) == {"low": -1.0, "high": 1e9}
    assert determined(1e-24, 3e19) == {"low": None, "high": None}
