"""Whether the parts of a plan fit together: matrix, damping, what the specimen takes over, the actuator's model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common import building, reality
from common.errors import PlanError
from common.plan import Plan, parse
from tests.helpers import SERVO_PLAN, with_table


@pytest.fixture(scope="module")
def plan() -> Plan:
    return parse(SERVO_PLAN, Path())


def test_a_plan_with_all_of_it_survives_its_own_text(plan: Plan) -> None:
    again = parse(plan.toml(), Path())
    assert again == plan
    assert again.digest() == plan.digest()
    assert np.array(plan.structure.stiffness).shape == (3, 3)
    assert plan.structure.damping == (0.0, 0.0, 0.0)
    assert parse("", Path()).structure.experimental is None


WRONG = {
    "dashpots beside a ratio": ("[structure]\ndamping = 1e5\ndamping_ratio = 0.05\n", "give one of them"),
    "rows that are missing": (
        "[structure]\nstiffness = [[1.0, 2.0]]\nmass = [1.0, 1.0]\ndamping_ratio = 0.1\n",
        "2 masses need 2 rows of 2",
    ),
    "rows beside numbers": ("[structure]\nstiffness = [[1.0], 2.0]\n", "mixes rows and numbers"),
    "an infinite entry": ("[structure]\nstiffness = [[inf]]\n", "must be finite"),
    "a matrix that is not symmetric": (
        "[structure]\nstiffness = [[2.0, -1.0], [-0.9, 2.0]]\nmass = [1.0, 1.0]\ndamping_ratio = 0.1\n",
        "must be symmetric, but row 2 has -0.9 in place 1 and row 1 has -1 in place 2",
    ),
    "a matrix that is not positive definite": (
        "[structure]\nstiffness = [[1.0, 2.0], [2.0, 1.0]]\nmass = [1.0, 1.0]\ndamping_ratio = 0.1\n",
        "not positive definite",
    ),
    "a share of a matrix": ("[structure]\nstiffness = [[25e6]]\n", r"say in \[structure.experimental\]"),
    "other columns under a matrix": (
        "[structure]\nstiffness = [[25e6]]\n[structure.columns]\nmodel = 'bilinear'\nyield_displacement = 0.01\n",
        "knows no columns of model 'bilinear'",
    ),
    "more mass than the floor has": (
        "[structure.experimental]\nmass = 160e3\n",
        "mass in .structure.experimental. is 160000, but floor 1 of the whole building has 160000",
    ),
    "more stiffness than the storey has": (
        "[structure.experimental]\nstiffness = 26e6\n",
        "but storey 1 of the whole building has 2.5e.07",
    ),
    "more damping than the storey has": ("[structure.experimental]\ndamping = 3e5\n", "has 200000"),
    "a model that is none": ("[actuator]\nmodel = 'servo'\n", "one of fopdt, servo_hydraulic"),
    "a command that is neither": ("[actuator]\ncommand = 'step'\n", "one of ramp, held"),
    "servo-hydraulics without a mass": ("[actuator]\nmodel = 'servo_hydraulic'\n", "give the moving mass"),
    "a lag of servo-hydraulics": (
        "[actuator]\nmodel = 'servo_hydraulic'\ntime_constant = 0.02\n[column]\nmass = 29.0\n",
        "time_constant in .actuator. is of the model 'fopdt'",
    ),
    "servo-hydraulics of a lag": ("[actuator.servo]\nleakage = 2.0\n", "choose 'servo_hydraulic'"),
    "a tolerance of a choice": (
        "[structure.experimental]\nmass = 1.0\n[tolerances]\n'structure.experimental.mass' = 0.1\n",
        "Unknown parameter 'structure.experimental.mass'",
    ),
    "a tolerance of another model": ("[tolerances]\n'actuator.servo.leakage' = 0.1\n", "Unknown parameter"),
    "a tolerance of a name": ("[tolerances]\n'actuator.model' = 0.1\n", "Unknown parameter"),
}


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG.keys())
def test_what_does_not_fit_is_refused_with_a_sentence(text: str, message: str) -> None:
    with pytest.raises(PlanError, match=message) as error:
        parse(text, Path(), "my.toml")
    assert str(error.value).startswith("my.toml")
    assert "\n" not in str(error.value)


def test_tolerances_of_new_parameters_are_those_of_the_model(plan: Plan) -> None:
    names = ("actuator.servo.valve", "column.mass", "column.damping", "structure.damping_ratio")
    found = with_table(plan, "tolerances", **dict.fromkeys(names, 0.05))
    assert set(found.tolerances.parameters) == set(names)
    with pytest.raises(PlanError, match=r"Unknown parameter 'actuator.time_constant'"):
        with_table(plan, "tolerances", **{"actuator.time_constant": 0.05})


@given(
    st.lists(st.floats(-1.0, 1.0), min_size=16, max_size=16),
    st.lists(st.floats(-0.5, 2.0), min_size=4, max_size=4),
)
def test_positive_definite_is_what_the_eigenvalues_say(entries: list[float], values: list[float]) -> None:
    q, _ = np.linalg.qr(np.array(entries).reshape(4, 4) + 3.0 * np.eye(4))
    matrix = q @ np.diag(values) @ q.T
    least = float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min())
    if abs(least) > 1e-6:
        assert building.positive_definite(matrix.tolist()) is (least > 0.0)


def test_a_reality_keeps_what_it_does_not_say_of_a_table_within_a_table(plan: Plan, tmp_path: Path) -> None:
    path = tmp_path / "secret.toml"
    path.write_text("[actuator.servo]\nleakage = 5.0\n[structure.experimental]\nmass = 20.0\n")
    found = reality.load(path, with_table(plan, "actuator", servo={"valve": 2.0e13})).plan
    assert (found.actuator.servo.leakage, found.actuator.servo.valve) == (5.0, 2.0e13)
    assert found.structure.experimental is not None
    assert (found.structure.experimental.mass, found.structure.experimental.stiffness) == (20.0, 1.19e6)


def test_times_of_ticks_do_not_add_up_their_rounding(plan: Plan, default_plan: Plan) -> None:
    assert [plan.tick_ns(tick) for tick in (1, 2, 8, 4096)] == [244_141, 488_281, 1_953_125, 1_000_000_000]
    assert plan.tick_ns(4096 * 7200) == 7_200_000_000_000
    assert [default_plan.tick_ns(tick) for tick in (1, 3, 19_999)] == [2_000_000, 6_000_000, 39_998_000_000]
