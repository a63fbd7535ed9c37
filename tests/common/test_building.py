"""Checks that the parts of a plan fit together: matrix, damping, the specimen's share, the actuator's model."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import PlanError
from common.plan import building
from common.plan.laboratory_tables import Actuator, ServoHydraulics
from common.plan.plan import Plan, ideal
from common.plan.read import from_tables, parse
from common.reality import reality
from tests.helpers import SERVO_PLAN, with_table


@pytest.fixture(scope="module")
def plan() -> Plan:
    return parse(SERVO_PLAN, Path())


def test_a_plan_with_every_building_key_survives_being_written_and_read(plan: Plan) -> None:
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
        "has no columns of model 'bilinear'",
    ),
    "more mass than the floor has": (
        "[structure.experimental]\nmass = 160e3\nstiffness = 1.0\n",
        "mass in .structure.experimental. is 160000, but floor 1 of the whole building has 160000",
    ),
    "more stiffness than the storey has": (
        "[structure.experimental]\nstiffness = 26e6\n",
        "but storey 1 of the whole building has 2.5e.07",
    ),
    "more damping than the storey has": (
        "[structure.experimental]\nstiffness = 1.0\ndamping = 3e5\n",
        "has 200000: give no more",
    ),
    "a table without the specimen's stiffness": (
        "[structure.experimental]\nmass = 20\n",
        "stiffness is missing in .structure.experimental., which has no default for it: give it",
    ),
    "a model that is none": ("[actuator]\nmodel = 'servo'\n", "one of fopdt, servo_hydraulic"),
    "a command that is neither": ("[actuator]\ncommand = 'step'\n", "one of ramp, held"),
    "servo-hydraulics without a mass": ("[actuator]\nmodel = 'servo_hydraulic'\n", "give the moving mass"),
    "a lag of servo-hydraulics": (
        "[actuator]\nmodel = 'servo_hydraulic'\ntime_constant = 0.02\n[column]\nmass = 29.0\n",
        "time_constant in .actuator. belongs to the model 'fopdt'",
    ),
    "servo-hydraulics of a lag": ("[actuator.servo]\nleakage = 2.0\n", "choose 'servo_hydraulic'"),
    "a tolerance of a choice": (
        "[structure.experimental]\nmass = 1.0\nstiffness = 1.0\n[tolerances]\n'structure.experimental.mass' = 0.1\n",
        "Unknown parameter 'structure.experimental.mass'",
    ),
    "a tolerance of another model": (
        "[tolerances]\n'actuator.servo.leakage' = 0.1\n",
        "'actuator.servo.leakage' in .tolerances. is of the actuator's model 'servo_hydraulic', but 'fopdt' is chosen",
    ),
    "a tolerance of a name": ("[tolerances]\n'actuator.model' = 0.1\n", "Unknown parameter"),
}


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG.keys())
def test_building_tables_that_do_not_fit_together_are_refused_with_one_sentence(
    text: str, message: str
) -> None:
    with pytest.raises(PlanError, match=message) as error:
        parse(text, Path(), "my.toml")
    assert str(error.value).startswith("my.toml")
    assert "\n" not in str(error.value)


def test_tolerances_of_new_parameters_are_those_of_the_model(plan: Plan) -> None:
    names = ("actuator.servo.valve", "column.mass", "column.damping", "structure.damping_ratio")
    found = with_table(plan, "tolerances", **dict.fromkeys(names, 0.05))
    assert set(found.tolerances.parameters) == set(names)
    for model in ("time_constant", "gain"):
        with pytest.raises(PlanError, match=rf"'actuator.{model}' in .tolerances. is of .* model 'fopdt'"):
            with_table(plan, "tolerances", **{f"actuator.{model}": 0.05})
    with pytest.raises(PlanError, match=r"Unknown parameter 'actuator.servo.valv'"):
        with_table(plan, "tolerances", **{"actuator.servo.valv": 0.05})


CHOSEN = (
    "structure.columns.yield_displacement",
    "structure.rho_infinity",
    "column.storey",
    "column.represents",
    "column.columns_per_storey",
)


@pytest.mark.parametrize("name", CHOSEN)
def test_a_parameter_without_an_effect_has_no_tolerance(name: str) -> None:
    text = "[structure.columns]\nmodel = 'bilinear'\nyield_displacement = 0.01\n"
    with pytest.raises(PlanError, match=f"Unknown parameter '{name}' in .tolerances."):
        parse(f"{text}[tolerances]\n'{name}' = 0.1\n", Path())
    parse(f"{text}[tolerances]\n'column.deformation_ratio' = 0.1\n'sensors.column_force' = 0.1\n", Path())


def with_substructured_stiffness(plan: Plan, stiffness: float, storey: int = 1) -> Plan:
    tables = plan.tables()
    tables["structure"]["experimental"]["stiffness"] = stiffness
    tables["column"]["storey"] = storey
    return from_tables(tables, Path())


@pytest.mark.parametrize("storey", [1, 2, 3])
def test_the_specimens_share_is_below_the_drift_stiffness_of_its_storey(plan: Plan, storey: int) -> None:
    K, drift = np.array(plan.structure.stiffness), np.zeros(3)
    drift[max(storey - 2, 0)], drift[storey - 1] = -1.0, 1.0
    most = 1.0 / float(drift @ np.linalg.solve(K, drift))
    with_substructured_stiffness(plan, most * (1.0 - 1e-9), storey)
    with pytest.raises(PlanError, match=f"but the drift of storey {storey} of .*: give less than that"):
        with_substructured_stiffness(plan, most * (1.0 + 1e-9), storey)


def test_the_benchmarks_specimen_may_take_at_most_3_18_meganewtons_per_metre(plan: Plan) -> None:
    with pytest.raises(PlanError, match=r"has 3.1768e.06: give less"):
        with_substructured_stiffness(plan, 4e6)


@given(
    st.lists(st.floats(-1.0, 1.0), min_size=16, max_size=16),
    st.lists(st.floats(-0.5, 2.0), min_size=4, max_size=4),
)
def test_the_check_for_positive_definiteness_agrees_with_the_eigenvalues(
    entries: list[float], values: list[float]
) -> None:
    q, _ = np.linalg.qr(np.array(entries).reshape(4, 4) + 3.0 * np.eye(4))
    matrix = q @ np.diag(values) @ q.T
    least = float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min())
    if abs(least) > 1e-6:
        assert building.positive_definite(matrix.tolist()) is (least > 0.0)


def test_a_reality_keeps_the_planned_values_of_nested_keys_that_it_does_not_give(
    plan: Plan, tmp_path: Path
) -> None:
    path = tmp_path / "secret.toml"
    path.write_text("[actuator.servo]\nleakage = 5.0\n[structure.experimental]\nmass = 20.0\n")
    found = reality.load(path, with_table(plan, "actuator", servo={"valve": 2.0e13})).plan
    assert (found.actuator.servo.leakage, found.actuator.servo.valve) == (5.0, 2.0e13)
    assert found.structure.experimental is not None
    assert (found.structure.experimental.mass, found.structure.experimental.stiffness) == (20.0, 1.19e6)


def truth(plan: Plan, text: str) -> Plan:
    return reality.from_reality(tomllib.loads(text), plan, Path()).plan


def test_a_reality_that_adds_a_table_must_give_its_stiffness(
    default_plan: Plan,
) -> None:
    with pytest.raises(PlanError, match=r"stiffness is missing in .structure.experimental."):
        truth(default_plan, "[structure.experimental]\nmass = 20.0\n")


def test_a_reality_with_another_actuator_model_drops_the_planned_models_parameters(
    plan: Plan, default_plan: Plan
) -> None:
    planned = with_table(plan, "actuator", servo={"valve": 2.0e13})
    planned = with_table(planned, "tolerances", **{"actuator.servo.leakage": 0.39})
    found = truth(planned, "[actuator]\nmodel = 'fopdt'\ndelay = 0.01\n")
    assert found.actuator == Actuator(delay=0.01, command="held")
    assert found.tolerances == planned.tolerances
    assert truth(planned, "[actuator]\nmodel = 'servo_hydraulic'\n") == planned

    planned = with_table(default_plan, "actuator", delay=0.02)
    planned = with_table(planned, "tolerances", **{"actuator.delay": 0.1})
    found = truth(
        planned,
        "[actuator]\nmodel = 'servo_hydraulic'\n[actuator.servo]\nleakage = 2.0\n[column]\nmass = 9.0\n",
    )
    assert found.actuator == Actuator(model="servo_hydraulic", servo=ServoHydraulics(leakage=2.0))
    with pytest.raises(PlanError, match="gain in .actuator. belongs to the model 'fopdt'"):
        truth(planned, "[actuator]\nmodel = 'servo_hydraulic'\ngain = 1.1\n[column]\nmass = 9.0\n")


def test_a_reality_with_another_specimen_model_drops_the_planned_models_parameters() -> None:
    plan = parse("[column]\nmodel = 'bilinear'\nyield_displacement = 0.003\nhardening = 0.1\n", Path())
    linear = truth(plan, "[column]\nmodel = 'linear'\n").column
    assert (linear.model, linear.parameters) == ("linear", {})
    assert linear.stiffness == plan.column.stiffness
    softer = truth(plan, "[column]\nhardening = 0.05\n").column
    assert softer.parameters == {"yield_displacement": 0.003, "hardening": 0.05}


def test_a_realitys_dashpots_replace_a_damping_ratio_and_the_reverse(plan: Plan, default_plan: Plan) -> None:
    def damping(planned: Plan, text: str) -> tuple[float, tuple[float, ...]]:
        found = truth(planned, f"[structure]\n{text}\n").structure
        return found.damping_ratio, found.damping

    assert damping(default_plan, "damping_ratio = 0.03") == (0.03, (0.0,))
    assert damping(default_plan, "damping_ratio = 0.0") == (0.0, default_plan.structure.damping)
    assert damping(default_plan, "damping = 1e5") == (0.0, (1e5,))
    assert damping(plan, "damping = [1e4, 2e4, 3e4]") == (0.0, (1e4, 2e4, 3e4))
    assert damping(plan, "damping_ratio = 0.04") == (0.04, (0.0, 0.0, 0.0))
    assert damping(plan, "mass = [900.0, 900.0, 900.0]") == (0.05, (0.0, 0.0, 0.0))
    for planned in (plan, default_plan):
        values = [1e4] * planned.storeys
        with pytest.raises(PlanError, match="give one of them"):
            damping(planned, f"damping_ratio = 0.03\ndamping = {values}")


def test_an_ideal_plan_of_servo_hydraulics_is_the_same_after_being_written_and_read(plan: Plan) -> None:
    names = ("actuator.servo.leakage", "column.stiffness")
    made = ideal(with_table(plan, "tolerances", **dict.fromkeys(names, 0.05)))
    assert made.tolerances.parameters == {"column.stiffness": 0.05}
    assert (made.actuator.command, made.compensator.force.unit_delay) == ("ramp", False)
    assert parse(made.toml(), Path()) == made


def test_the_times_of_ticks_do_not_accumulate_rounding(plan: Plan, default_plan: Plan) -> None:
    assert [plan.tick_ns(tick) for tick in (1, 2, 8, 4096)] == [244_141, 488_281, 1_953_125, 1_000_000_000]
    assert plan.tick_ns(4096 * 7200) == 7_200_000_000_000
    assert [default_plan.tick_ns(tick) for tick in (1, 3, 19_999)] == [2_000_000, 6_000_000, 39_998_000_000]
