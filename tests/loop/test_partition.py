"""A partitioned building: its matrices, its critical delay, and the damping that a delay costs."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import root

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.read import parse, with_test
from common.plan.tables import Experimental
from loop.closed_loop import simulate
from loop.nominal import partition
from loop.nominal.preflight import expected_delay, partition_text
from loop.signals import signals
from models.indicators import FrequencyEvaluation
from models.registry import Array
from models.structures import shear_building
from tests.helpers import SERVO_PLAN, with_table
from validation.paper.experiments import delayed, pulse

# mass of a floor kg, damping ratio, critical delay ms: computed from the published equations
CASES = [(1000.0, 0.05, 14.65), (1100.0, 0.04, 12.23), (1300.0, 0.03, 9.92), (1000.0, 0.03, 8.73)]


@pytest.fixture(scope="module")
def plan() -> Plan:
    return parse(SERVO_PLAN, Path())


def case(plan: Plan, mass: float, ratio: float) -> Plan:
    return replace(plan, structure=replace(plan.structure, mass=(mass,) * 3, damping_ratio=ratio))


@pytest.mark.parametrize(("mass", "ratio", "delay"), CASES)
def test_the_critical_delay_agrees_with_the_published_equations(
    plan: Plan, mass: float, ratio: float, delay: float
) -> None:
    assert partition.critical_delay_of(case(plan, mass, ratio)) * 1e3 == pytest.approx(delay, rel=1e-3)


def test_numerical_part_and_specimen_add_up_to_the_whole_building(plan: Plan) -> None:
    whole, part, specimen = partition.matrices(plan), partition.numerical(plan), partition.felt(plan)
    outer = np.outer(partition.drift_direction(plan), partition.drift_direction(plan))
    for one, rest, left_out in zip(
        whole, part, (specimen.mass, specimen.damping, specimen.stiffness), strict=True
    ):
        np.testing.assert_allclose(rest + left_out * outer, one, rtol=1e-12)
    assert specimen == (1.19e6, 114.6, 29.13)


def test_every_mode_has_the_planned_damping_ratio(plan: Plan) -> None:
    modes = shear_building.modes(*partition.matrices(case(plan, 1000.0, 0.05)))
    np.testing.assert_allclose(modes.damping_ratios, 0.05, rtol=1e-9)
    np.testing.assert_allclose(1.0 / modes.periods, [3.59, 16.0, 38.1], rtol=1e-2)
    decoupled = modes.shapes.T @ partition.matrices(plan).C @ modes.shapes
    assert np.abs(decoupled - np.diag(np.diag(decoupled))).max() < 1e-9 * np.abs(decoupled).max()


def test_a_matrix_of_a_shear_building_has_the_storeys_stiffness() -> None:
    stiffness, tables = (3e7, 2e7, 1e7), {"mass": [1e5] * 3, "damping": [1e5] * 3}
    text = "[structure]\n" + "".join(f"{name} = {value}\n" for name, value in tables.items())
    rows = shear_building.tridiagonal(np.array(stiffness)).tolist()
    for storey in (1, 2, 3):
        column = f"[structure.experimental]\nstiffness = 1e6\n[column]\nstorey = {storey}\n"
        full = parse(f"{text}stiffness = {rows}\n{column}", Path())
        bare = parse(f"{text}stiffness = {list(stiffness)}\n{column}", Path())
        assert partition.storey_stiffness(full) == pytest.approx(stiffness[storey - 1], rel=1e-12)
        assert partition.storey_stiffness(bare) == stiffness[storey - 1]
        for one, other in zip(partition.numerical(full), partition.numerical(bare), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-12)


def test_by_default_the_specimen_takes_over_its_share_of_the_columns(default_plan: Plan) -> None:
    plan = with_table(default_plan, "column", represents=3)
    assert partition.taken_over(plan) == Experimental(stiffness=0.75 * 25e6)
    assert partition.storey_stiffnesses(plan).tolist() == [0.25 * 25e6]
    assert partition.numerical(plan).M.tolist() == [[160e3]]


@pytest.mark.parametrize("storey", [1, 2, 3])
@pytest.mark.parametrize("matrix", [True, False])
def test_a_dashpot_cannot_take_over_all_of_the_modal_damping(plan: Plan, storey: int, matrix: bool) -> None:
    stiffness = plan.structure.stiffness if matrix else (3e6, 2e6, 1e6)
    structure = replace(plan.structure, mass=(1000.0, 800.0, 600.0), stiffness=stiffness)
    plan = replace(plan, structure=structure, column=replace(plan.column, storey=storey))
    direction = partition.drift_direction(plan)
    most = 1.0 / float(direction @ np.linalg.solve(partition.matrices(plan).C, direction))

    def taking(share: float) -> Plan:
        taken = Experimental(stiffness=1e5, damping=share * most)
        return replace(plan, structure=replace(plan.structure, experimental=taken))

    least = np.linalg.eigvalsh(partition.numerical(taking(1.0 - 1e-6)).C).min()
    assert 0.0 < least < 1e-3 * most
    with pytest.raises(
        InputError, match=f"the drift of storey {storey} of the whole building has .*: give less"
    ):
        partition.numerical(taking(1.0 + 1e-6))


def test_the_damping_that_a_specimen_takes_over_is_limited_in_a_building_with_a_free_storey() -> None:
    text = "[structure]\nmass = [1e3, 1e3, 1e3]\nstiffness = [1e6, 0.0, 2e6]\ndamping_ratio = 0.1\n"
    text += "[structure.experimental]\nstiffness = 1e5\ndamping = {}\n[column]\nstorey = {}\n"
    alone = 2.0 * 0.1 * math.sqrt(1e6 * 1e3)  # of the first storey, which moves by itself
    partition.numerical(parse(text.format(0.999 * alone, 1), Path()))
    for damping, storey in ((1.001 * alone, 1), (1.0, 2)):
        free = parse(text.format(damping, storey).replace("stiffness = 1e5", "stiffness = 0.0"), Path())
        with pytest.raises(InputError, match=rf"damping in .structure.experimental. is {damping:g}"):
            partition.numerical(free)


def decay(plan: Plan, amplitude: float, delay: float) -> float:
    """Decay of the first mode over its frequency, from the characteristic equation with `A·e^(−s·d)` in the path."""
    part, specimen = partition.numerical(plan), partition.felt(plan)
    outer = np.outer(partition.drift_direction(plan), partition.drift_direction(plan))

    def determinant(z: Array) -> list[float]:
        s = complex(*z)
        force = specimen.stiffness + specimen.damping * s + specimen.mass * s * s
        dynamic = part.M * s * s + part.C * s + part.K + outer * force * amplitude * np.exp(-s * delay)
        value = complex(np.linalg.det(dynamic / 1e7))
        return [value.real, value.imag]

    omega = 2.0 * math.pi / float(shear_building.modes(*partition.matrices(plan)).periods[0])
    found = root(determinant, [-0.05 * omega, omega], tol=1e-12)
    assert found.success
    s = complex(*found.x)
    return -s.real / omega


@pytest.mark.parametrize(("amplitude", "delay"), [(1.0, 0.0005), (1.0, 0.002), (0.98, 0.001)])
def test_the_damping_lost_by_a_path_agrees_with_the_characteristic_equation(
    plan: Plan, amplitude: float, delay: float
) -> None:
    heavy = replace(plan, column=replace(plan.column, mass=300.0, damping=2e3))
    structure = replace(plan.structure, experimental=Experimental(mass=300.0, stiffness=1.19e6, damping=2e3))
    heavy = replace(heavy, structure=structure)
    path = FrequencyEvaluation(amplitude, delay, 3.59)
    lost = decay(heavy, 1.0, 0.0) - decay(heavy, amplitude, delay)
    assert partition.damping_lost(heavy, path) == pytest.approx(lost, rel=0.05)


def test_the_expected_delay_of_a_path_includes_the_unit_delay(plan: Plan) -> None:
    force = replace(plan.compensator.force, unit_delay=False)
    prompt = replace(plan, compensator=replace(plan.compensator, force=force))
    late, early = partition.assess(plan), partition.assess(prompt)
    assert late.delay - early.delay == pytest.approx(plan.test.interval, rel=1e-9)
    assert expected_delay(plan, late) == pytest.approx(late.delay + plan.test.interval)
    assert late.damping_points > early.damping_points
    assert late.critical_delay == early.critical_delay


def test_the_default_partition_has_the_expected_delay_and_margin(default_plan: Plan) -> None:
    found = partition.assess(default_plan)
    assert found.frequency == pytest.approx(1.989, abs=1e-3)
    assert found.critical_delay == pytest.approx(0.0329, abs=1e-4)
    assert found.delay == pytest.approx(0.0002, abs=1e-4)
    assert found.amplitude == pytest.approx(1.028, abs=2e-3)
    assert "Stable up to 32.9 ms of delay; 2.2 ms expected (margin 15)" in partition_text(default_plan, found)


@pytest.mark.parametrize(("lead", "points"), [(0.0088, 1.9), (0.044, 0.0)])
def test_the_damping_lost_follows_from_the_residual_delay(
    default_plan: Plan, lead: float, points: float
) -> None:
    plan = with_table(default_plan, "compensator", lead=lead)
    assert 100.0 * partition.assess(plan).damping_points == pytest.approx(points, abs=0.05)


def test_a_specimen_without_stiffness_tolerates_any_delay(default_plan: Plan) -> None:
    plan = with_table(default_plan, "column", stiffness=0.0)
    found = partition.assess(plan)
    assert math.isinf(found.critical_delay)
    assert "Stable at any delay; " in partition_text(plan, found)


def test_two_storeys_diverge_only_beyond_their_critical_delay(default_plan: Plan) -> None:
    plan = with_table(
        default_plan, "structure", mass=[1.6e5, 1.6e5], stiffness=[50e6, 40e6], damping=[4e5, 3e5]
    )
    plan = with_table(plan, "column", stiffness=20e6, storey=2)
    critical = partition.critical_delay_of(plan)
    growth = []
    for factor in (0.9, 1.1):
        late = with_test(delayed(plan, factor * critical), duration=20.0)
        drift = np.abs(signals(late, simulate(late, pulse(late)))["column_target"])
        middle = drift.size // 2
        growth.append(drift[middle:].max() / drift[1000:middle].max())
    assert growth[0] < 1.0 < growth[1]
