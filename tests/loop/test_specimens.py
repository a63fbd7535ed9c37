"""Several specimens in one building, at the master and at slaves, against the whole frame as scipy solves it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from common.errors import PlanError
from common.plan.plan import Plan
from common.plan.read import from_tables, load
from common.terminal import cli
from loop.nominal import critical, partition, preflight
from loop.substructure import Substructure, ground_rows, motion
from master.step import MasterStep
from models.registry import Array

TWO = {
    "mass": [160e3, 120e3],
    "stiffness": [65e6, 50e6],
    "damping": [515e3, 400e3],
}


def given(**tables: Any) -> Plan:
    return from_tables({"test": {"duration": 6.0}, **tables}, Path())


def columns(*places: tuple[int, int, float], storeys: dict[str, Any] | None = None, own: bool = True) -> Plan:
    """Columns of a storey, each representing a number of columns of that stiffness; one may be the master's."""
    tables = [
        {"storey": storey, "represents": count, "stiffness": stiffness} for storey, count, stiffness in places
    ]
    slaves = {f"s{place}": {"kind": "column", "column": table} for place, table in enumerate(tables[own:])}
    top = {"column": tables[0]} if own else {"master": {"kind": "none"}}
    return given(**top, slave=slaves or {"kind": "none"}, structure=storeys or {})


def played(plan: Plan) -> Array:
    """Displacements (ticks, storeys) m with specimens that are springs and transfer systems that follow at once.

    A slave is where it was told to be at the end of the interval, and its force is that of the tick.
    """
    step = MasterStep(plan, ground_rows(plan, motion(plan)))
    stiffness = [plan.of(role).column.stiffness for role in plan.roles]
    own = plan.column.stiffness if "master" in plan.kinds else 0.0
    target, sent, found = 0.0, [0.0] * len(stiffness), []
    drift = plan.column.deformation_ratio
    for tick in range(plan.ticks):
        forces = [k * x for k, x in zip(stiffness, sent, strict=True)]
        outputs = step(tick, target, own * target, forces)
        assert outputs.target == target
        sent = [one[0] for one in outputs.sent]
        found.append(outputs.of_storeys["displacement"])
        target = drift * reached(step, plan) if own else 0.0
    return np.array(found)


def reached(step: MasterStep, plan: Plan) -> float:
    """Drift (m) of the master's storey at the interval's end, as the building has it in its memory."""
    advance: Any = step._advance  # the compiled kernel, bound to the building's arrays
    return float(advance.args[0][ASKED][0]) / plan.column.deformation_ratio


ASKED = Substructure._fields.index("asked")


def frame(plan: Plan) -> Array:
    """The whole linear frame under the ground, from its state matrix; the ground moves on straight lines."""
    M, C, K = partition.matrices(plan)
    n, ground = plan.storeys, ground_rows(plan, motion(plan))[0, :-1]
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    b = np.concatenate([np.zeros(n), -np.ones(n)])[:, None]
    t = np.arange(ground.size) * plan.test.interval
    _, found, _ = lsim(StateSpace(a, b, np.eye(n, 2 * n), np.zeros((n, 1))), ground, t)
    return np.asarray(found).reshape(-1, n)


def apart(x: Array, y: Array) -> float:
    return float(np.max(np.abs(x - y)) / np.max(np.abs(y)))


def test_two_columns_of_a_storey_equal_one_that_represents_two() -> None:
    two = columns((1, 1, 12.5e6), (1, 1, 12.5e6))
    one = columns((1, 2, 12.5e6))
    assert np.allclose(played(two), played(one), rtol=0.0, atol=1e-14)
    assert apart(played(two), frame(two)) < 2e-3


@pytest.mark.parametrize("own", [True, False])
def test_a_column_in_each_of_two_storeys_gives_the_response_of_the_whole_frame(own: bool) -> None:
    plan = columns((1, 1, 32.5e6), (2, 2, 25e6), storeys=TWO, own=own)
    found = played(plan)
    assert found.shape == (plan.ticks, 2)
    assert apart(found, frame(plan)) < 5e-3


def test_without_a_specimen_the_numerical_part_is_the_whole_building() -> None:
    plan = given(master={"kind": "none"}, control={"amd": False}, structure=TWO)
    assert np.array_equal(partition.numerical(plan).K, partition.matrices(plan).K)
    assert apart(played_without(plan), frame(plan)) < 5e-3
    found = partition.assess(plan)
    assert (found.critical_delay, found.delay, found.stable) == (np.inf, 0.0, True)


def played_without(plan: Plan) -> Array:
    step = MasterStep(plan, ground_rows(plan, motion(plan)))
    return np.array([step(tick, 0.0, 0.0, [0.0]).of_storeys["displacement"] for tick in range(plan.ticks)])


@pytest.mark.parametrize(
    ("name", "roles", "late"),
    [
        ("single_site", ["master"], "master"),
        ("two_columns", ["master", "slave.east"], "master"),
        ("two_storeys", ["master", "slave.above"], "slave.above"),
        ("two_slaves", ["slave.columns"], "slave.columns"),
    ],
)
def test_every_path_of_the_shipped_plans_keeps_its_delay_margin(
    name: str, roles: list[str], late: str
) -> None:
    plan = load(cli.plan_path(name))
    found = partition.assess(plan)
    assert (list(found.paths), found.role) == (roles, late)
    assert all(abs(path.delay) < 1e-3 for path in found.paths.values())
    assert preflight.partition_check(plan, found).risk is None


def test_specimens_take_their_shares_of_the_storey_and_the_numerical_columns_the_rest() -> None:
    plan = columns((1, 1, 32.5e6), (1, 2, 32.5e6), (2, 1, 25e6), storeys=TWO)
    assert partition.storey_stiffnesses(plan) == pytest.approx([0.25 * 65e6, 0.75 * 50e6])


def test_several_specimens_in_one_storey_have_the_critical_delay_of_one_for_all() -> None:
    two, one = columns((1, 1, 12.5e6), (1, 1, 12.5e6)), columns((1, 2, 12.5e6))
    assert partition.critical_delay_of(two) == pytest.approx(partition.critical_delay_of(one), rel=1e-12)


def determinant(plan: Plan, felt: Array) -> Callable[[float, float], complex]:
    M, C, K = partition.numerical(plan)

    def at(omega: float, delay: float) -> complex:
        late = felt * np.exp(-1j * omega * delay)
        return complex(np.linalg.det((K + late - omega**2 * M + 1j * omega * C) / 1e8))

    return at


def test_at_the_critical_delay_of_two_storeys_the_loop_vibrates_undamped() -> None:
    plan = columns((1, 1, 32.5e6), (2, 1, 25e6), storeys=TWO)
    found = partition.critical_delay_of(plan)
    e = np.array([[1.0, 0.0], [-1.0, 1.0]])
    at = determinant(plan, e.T @ np.diag([0.25 * 65e6, 0.25 * 50e6]) @ e)
    near = [abs(at(omega, found)) for omega in np.linspace(1.0, 80.0, 20001)]
    assert min(near) < 1e-3 * near[0]
    # the one with a specimen in the lower storey alone, by the general search and by its Hamiltonian
    lower = columns((1, 1, 32.5e6), storeys=TWO)
    general = critical.critical_delay(
        *partition.numerical(lower), np.array([[1.0, 0.0]]), np.array([[0.25 * 65e6, 0.0, 0.0]])
    )
    assert general == pytest.approx(partition.critical_delay_of(lower), rel=1e-6)


def test_more_columns_than_a_storey_has_are_refused() -> None:
    with pytest.raises(
        PlanError, match=r"storey 1 represent more columns than it has \(3/4 by \[column\], 1/2"
    ):
        columns((1, 3, 12.5e6), (1, 2, 12.5e6))
    columns((1, 3, 12.5e6), (2, 2, 12.5e6), storeys=TWO)


def test_the_table_of_a_single_specimens_share_is_refused_with_two_specimens() -> None:
    structure = {"experimental": {"stiffness": 1e6}}
    with pytest.raises(PlanError, match=r"\[structure.experimental\] says .* but the plan has 2 columns"):
        columns((1, 1, 12.5e6), (1, 1, 12.5e6), storeys=structure)
    columns((1, 1, 12.5e6), storeys=structure)


def test_the_storey_of_a_slaves_column_must_exist() -> None:
    with pytest.raises(PlanError, match=r"storey in \[slave.s0.column\] is 2, but the structure has 1"):
        columns((1, 1, 12.5e6), (2, 1, 12.5e6))
