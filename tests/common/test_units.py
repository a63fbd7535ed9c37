"""Numbers with units in plans give their SI value to the last bit; wrong ones are refused in one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import PlanError
from common.plan.read import parse
from common.plan.units import in_si

# factors of NIST SP 811 (2008), appendix B, exact where it prints them in bold
KNOWN = [
    ("160 t", "kg", 160e3),
    ("12.5 kN/mm", "N/m", 12.5e6),
    ("4.87 mm", "m", 0.00487),
    ("200 kN·s/m", "N·s/m", 200e3),
    ("200 kN*s/m", "N·s/m", 200e3),
    ("2 ms", "s", 0.002),
    ("5µm", "m", 5e-6),
    ("1 inch", "m", 0.0254),
    ("1 g", "m/s²", 9.80665),
    ("100 gal", "m/s²", 1.0),
    ("1 g", "kg", 1e-3),
    ("1 kgf", "N", 9.80665),
    ("1 lbf", "N", 4.4482216152605),
    ("10 %", "", 0.1),
    ("-3.5e1 cm/s^2", "m/s²", -0.35),
    ("5 m/s2", "m/s²", 5.0),
    ("5 N/mm2", "N/m²", 5e6),
]


@pytest.mark.parametrize(("text", "unit", "value"), KNOWN)
def test_a_number_with_a_unit_gives_its_si_value_to_the_last_bit(text: str, unit: str, value: float) -> None:
    assert in_si(text, unit, "x") == value


@pytest.mark.parametrize(
    ("text", "unit", "sentence"),
    [
        (
            "160 mm",
            "kg",
            "x is in mm, which does not fit: give it in kg, or in another unit of the same quantity.",
        ),
        ("160", "kg", "x must be a number in kg, or one with its unit, not '160'."),
        ("heavy", "kg", "x must be a number in kg, or one with its unit, not 'heavy'."),
        ("160 tt", "kg", "x has the unit 'tt', which is not known: give it in kg."),
        ("3 mm", "", "x is in mm, which does not fit: give it without a unit."),
        ("1 m**9**9**9", "m", "x has the unit 'm**9**9**9', which is not known: give it in m."),
        ("1 t; import os", "kg", "x has the unit 't; import os', which is not known: give it in kg."),
    ],
)
def test_a_wrong_unit_is_refused_and_a_fitting_one_is_named(text: str, unit: str, sentence: str) -> None:
    with pytest.raises(PlanError) as caught:
        in_si(text, unit, "x")
    assert str(caught.value) == sentence


@given(st.text(max_size=80), st.sampled_from(["", "m", "kg", "N·s/m"]))
def test_any_text_gives_a_number_or_one_sentence(text: str, unit: str) -> None:
    try:
        value = in_si(text, unit, "x")
    except PlanError as error:
        assert str(error).endswith(".")
    else:
        assert isinstance(value, float)


def test_a_plan_with_units_equals_the_plan_in_si_numbers(tmp_path: Path) -> None:
    plain = """
        [test]
        interval = 0.002
        [structure]
        mass = [160e3, 8e4]
        stiffness = [[25e6, -1e6], [-1e6, 25e6]]
        damping_ratio = 0.05
        [structure.experimental]
        stiffness = 6.25e6
    """
    units = """
        [test]
        interval = "2 ms"
        [structure]
        mass = ["160 t", 80000]
        stiffness = [["25 kN/mm", "-1 kN/mm"], ["-1 MN/m", 25e6]]
        damping_ratio = "5 %"
        [structure.experimental]
        stiffness = "6.25 kN/mm"
    """
    assert parse(units, tmp_path).digest() == parse(plain, tmp_path).digest()


def test_a_parameter_of_a_users_model_accepts_its_unit(tmp_path: Path) -> None:
    text = '[structure.columns]\nmodel = "bilinear"\nyield_displacement = "4 mm"\nhardening = 0.1\n'
    assert parse(text, tmp_path).structure.columns.parameters["yield_displacement"] == 0.004
