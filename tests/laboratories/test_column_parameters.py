"""The nominal parameters of a column that move within their tolerances, those of its specimen's model among them."""

from __future__ import annotations

from pathlib import Path

import pytest

from common.errors import PlanError
from common.plan.read import parse
from laboratories.column.kind import COLUMN
from models.system import System

BILINEAR = "[column]\nmodel = 'bilinear'\nyield_displacement = 0.003\nhardening = {}\n"
OWN = ("column.yield_displacement", "column.hardening")


def movable(text: str) -> tuple[str, ...]:
    (column,) = (one for one in COLUMN.machines(parse(text, Path())) if one.site == "column")
    return column.parameters


def test_the_parameters_of_the_specimens_model_move_beside_its_stiffness() -> None:
    assert movable(BILINEAR.format(0.1)) == ("column.stiffness", "column.mass", "column.damping", *OWN)
    assert movable("") == ("column.stiffness", "column.mass", "column.damping")


def test_a_parameter_at_the_bound_of_its_range_does_not_move() -> None:
    assert "column.hardening" not in movable(BILINEAR.format(0.99))
    assert "column.hardening" in movable(BILINEAR.format(0.99) + "[tolerances]\n'column.hardening' = 0.001\n")


def test_a_parameter_of_the_model_is_multiplied_by_itself() -> None:
    system = System(parse(BILINEAR.format(0.1), Path()))
    assert COLUMN.planned(system.plan, OWN[0]) == 0.003
    assert COLUMN.planned(system.plan, "column.stiffness") == system.plan.column.stiffness
    moved = COLUMN.scaled(system, OWN[0], 1.1).plan.column
    assert moved.parameters == {"yield_displacement": pytest.approx(0.0033), "hardening": 0.1}
    assert moved.stiffness == system.plan.column.stiffness
    stiffer = COLUMN.scaled(system, "column.stiffness", 1.1).plan.column
    assert stiffer.stiffness == pytest.approx(1.1 * system.plan.column.stiffness)
    assert stiffer.parameters == system.plan.column.parameters


def test_only_parameters_of_the_model_that_is_chosen_have_a_tolerance() -> None:
    with pytest.raises(PlanError, match=r"Unknown parameter 'column.yield_displacement' in \[tolerances\]"):
        parse("[tolerances]\n'column.yield_displacement' = 0.05\n", Path())
