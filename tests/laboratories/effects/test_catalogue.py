from __future__ import annotations

import math
import pickle
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import InputError
from common.plan.laboratory_tables import Damper, ShakingTable
from common.plan.plan import Plan
from common.plan.tables import Structure
from common.signals import TOPICS
from laboratories import effects
from laboratories.effects import CATALOGUE, lay
from laboratories.effects.effect import Effect, Kind, Parameter
from laboratories.effects.sites import SITES
from models.system import Effects, SensorEffects, System
from tests.laboratories.effects.distinct import DISTINCT, null_parameters

ROOM = Path(effects.__file__).parent.parent
BASE = System(Plan())
SIGNALS = {
    "column_displacement": "m",
    "column_force": "N",
    "table_displacement": "m",
    "table_acceleration": "m/s²",
    "damper_stroke": "m",
    "damper_force": "N",
}
ROWS = {  # parameters and their units, as users write them in a reality
    "ground.scale": {"factor": ""},
    "ground.time_shift": {"shift": "s"},
    "structure.mass": {"factor": ""},
    "structure.stiffness": {"factor": ""},
    "structure.damping": {"factor": ""},
    "structure.p_delta": {"stiffness": "N/m"},
    "actuator.delay": {"delay": "s"},
    "actuator.time_constant": {"factor": ""},
    "actuator.gain": {"factor": ""},
    "actuator.velocity_limit": {"velocity": "m/s"},
    "actuator.backlash": {"width": "m"},
    "actuator.compliance": {"compliance": "m/N"},
    "actuator.deadband": {"width": "m"},
    "column.stiffness": {"factor": ""},
    "column.yielding": {"yield_displacement": "m", "hardening": "", "exponent": ""},
    "column.degradation": {"rate": ""},
    "column.pinching": {"factor": "", "hardening": "", "width": "m"},
    "column.friction": {"force": "N", "presliding": "m", "velocity": "m/s"},
    "column.viscous": {"coefficient": "N·s/m"},
    "column.inertia": {"mass": "kg"},
    "column.slip": {"gap": "m"},
    "column.self_centring": {"displacement": "m", "hardening": "", "loop": ""},
    "column.hardening": {"share": ""},
    "link.delay": {"delay": "s"},
    "link.jitter": {"std": "s"},
    "link.loss": {"probability": "", "burst": ""},
    "table.delay": {"delay": "s"},
    "table.gain": {"factor": ""},
    "table.bandwidth": {"factor": ""},
    "table.oil_column": {"frequency": "Hz", "damping": ""},
    "table.payload": {"compliance": "m/N"},
    "table.backlash": {"width": "m"},
    "table.friction": {"acceleration": "m/s²", "velocity": "m/s"},
    "damper.friction": {"force": "N", "velocity": "m/s"},
    "damper.viscous": {"factor": ""},
    "damper.stiffness": {"factor": ""},
    "damper.mass": {"factor": ""},
    "damper.motor_lag": {"time_constant": "s"},
    "damper.gain": {"factor": ""},
    "damper.force_limit": {"force": "N"},
    "damper.stroke_stop": {"stroke": "m", "stiffness": "N/m"},
    "damper.offset": {"force": "N"},
}
FAULTS = ("gain", "bias", "drift", "lag", "high_pass", "delay", "quantization", "noise", "saturation")
for signal, unit in SIGNALS.items():
    ROWS |= {
        f"sensor.{signal}.gain": {"factor": ""},
        f"sensor.{signal}.bias": {"offset": unit},
        f"sensor.{signal}.drift": {"rate": f"{unit}/s"},
        f"sensor.{signal}.lag": {"time_constant": "s"},
        f"sensor.{signal}.delay": {"delay": "s"},
        f"sensor.{signal}.quantization": {"step": unit},
        f"sensor.{signal}.noise": {"rms": unit},
        f"sensor.{signal}.saturation": {"limit": unit, "sharpness": ""},
    }
    if unit != "m":
        ROWS[f"sensor.{signal}.high_pass"] = {"time_constant": "s"}
EACH = pytest.mark.parametrize("effect", DISTINCT.values(), ids=list(DISTINCT))


def strengths(effect: Effect) -> list[Parameter]:
    return [item for item in effect.parameters if not item.shape]


def strong(effect: Effect) -> dict[str, float]:
    """Parameters with the last size of each strength and the default of each shape."""
    return null_parameters(effect) | {item.name: item.sizes[-1] for item in strengths(effect)}


def refusal(entries: list[effects.Entry]) -> str:
    with pytest.raises(InputError) as caught:
        lay(BASE, entries)
    text = str(caught.value)
    assert "\n" not in text
    assert text.count(". ") == 0
    return text


def test_the_names_of_effects_and_parameters_are_unchanged() -> None:
    found = {name: {item.name: item.unit for item in CATALOGUE[name].parameters} for name in CATALOGUE}
    assert found.items() >= ROWS.items()  # effects may be added, none may be renamed


@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=list(CATALOGUE))
def test_each_effect_is_defined_in_the_file_that_its_name_gives(effect: Effect) -> None:
    folder, _, stem = (f"sensor.{effect.fault}" if effect.signal else effect.name).partition(".")
    found = list(ROOM.rglob(f"effects/{folder}/{stem}.py"))
    assert len(found) == 1


@pytest.mark.parametrize("effect", CATALOGUE.values(), ids=list(CATALOGUE))
def test_names_sites_and_kinds_of_effects_agree(effect: Effect) -> None:
    is_sensor = bool(effect.signal)
    assert effect.name.rsplit(".", 1)[0] == effect.site
    assert effect.site in SITES
    assert effect.kind in get_args(Kind)
    assert (effect.kind == "measurement") == is_sensor == bool(effect.fault)
    assert is_sensor == (effect.site == f"sensor.{effect.signal}")
    assert effect.says
    assert effect.reference
    assert strengths(effect)


def test_effects_of_one_fault_on_different_readings_form_one_family() -> None:
    families = {effect.family for effect in CATALOGUE.values() if effect.signal}
    assert families == {f"sensor: {fault}" for fault in FAULTS}
    assert CATALOGUE["table.delay"].family == "table.delay"


@EACH
def test_hints_for_the_search_refer_to_existing_parameters_and_signals(effect: Effect) -> None:
    names = {item.name for item in effect.parameters}
    if effect.contact is not None:
        assert {effect.contact.place, effect.contact.stiffness} == names
        assert {effect.contact.motion, effect.contact.force} <= set(SIGNALS)
    for item in effect.parameters:
        assert not item.smoothing or (item.shape and item.unit == "m/s")
        assert item.follows in {
            "",
            *(signal.name for topic in ("master", "slave") for signal in TOPICS[topic]),
        }
    assert effect.in_samples or not effect.random


@EACH
def test_null_parameters_do_not_change_the_system(effect: Effect) -> None:
    assert lay(BASE, [(effect.name, null_parameters(effect))]) == BASE


@EACH
def test_a_shape_parameter_of_an_absent_effect_changes_nothing(effect: Effect) -> None:
    for item in effect.parameters:
        if item.shape:
            for size in (item.least, *item.sizes, item.most):
                assert lay(BASE, [(effect.name, null_parameters(effect) | {item.name: size})]) == BASE


@EACH
def test_null_parameters_after_an_effect_keep_the_plan_and_reset_the_fields_that_it_sets(
    effect: Effect,
) -> None:
    before = lay(BASE, [(effect.name, strong(effect))])
    after = lay(before, [(effect.name, null_parameters(effect))])
    assert after.plan == before.plan
    sensors = {name: SensorEffects() for name in after.effects.sensors}
    sets = lay(before, [(effect.name, strong(effect))]).effects == before.effects  # others multiply
    assert after.effects == (Effects(sensors=sensors) if sets else before.effects)


@EACH
def test_every_listed_size_is_within_bounds_and_changes_the_system(effect: Effect) -> None:
    for item in effect.parameters:
        assert item.least < item.most
        assert item.least <= item.null <= item.most or math.isinf(item.null)
        assert all(item.least <= size <= item.most for size in item.sizes)
        assert len(set(item.sizes)) == len(item.sizes)
        if item.shape:
            assert len(item.sizes) >= 3
            continue
        # a search meets a sharp resonance only where it looks nearly at its frequency
        assert 4 <= len(item.sizes) <= (20 if item.unit == "Hz" else 6)
        assert item.null not in item.sizes
        seen = [lay(BASE, [(effect.name, {item.name: size})]) for size in item.sizes]
        assert BASE not in seen
        assert all(left != right for place, left in enumerate(seen) for right in seen[:place])


@EACH
def test_a_factor_has_sizes_on_both_sides_of_one(effect: Effect) -> None:
    for item in strengths(effect):
        if item.null == 1.0:
            assert min(item.sizes) < 1.0 < max(item.sizes)


@EACH
def test_a_shape_parameter_changes_its_effect(effect: Effect) -> None:
    for item in effect.parameters:
        if item.shape:
            seen = [lay(BASE, [(effect.name, strong(effect) | {item.name: size})]) for size in item.sizes]
            assert all(left != right for place, left in enumerate(seen) for right in seen[:place])


@EACH
def test_an_optional_parameter_has_its_default(effect: Effect) -> None:
    given = {item.name: item.sizes[-1] for item in strengths(effect)}
    assert lay(BASE, [(effect.name, given)]) == lay(BASE, [(effect.name, strong(effect))])


@EACH
def test_the_bounds_and_the_null_value_of_a_parameter_are_accepted(effect: Effect) -> None:
    for item in effect.parameters:
        for value in (item.least, item.most, item.null):
            given = strong(effect) | {item.name: value}
            same = lay(BASE, [(effect.name, given)]) == BASE
            assert not same or item.null in given.values()


@EACH
def test_a_parameter_out_of_bounds_is_refused_with_the_allowed_range(effect: Effect) -> None:
    for item in effect.parameters:
        wrong: tuple[Any, ...] = (
            item.least - 1.0,
            item.most + 1.0,
            math.nan,
            -math.inf,
            10**400,
            "much",
            True,
        )
        for value in wrong:
            text = refusal([(effect.name, strong(effect) | {item.name: value})])
            for word in (item.name, effect.name, repr(value), f"{item.least:g}", f"{item.most:g}", item.unit):
                assert word in text
        if not math.isinf(item.null):
            refusal([(effect.name, strong(effect) | {item.name: math.inf})])


@EACH
def test_a_missing_or_unknown_parameter_is_refused(effect: Effect) -> None:
    for item in strengths(effect):
        given = strong(effect)
        del given[item.name]
        text = refusal([(effect.name, given)])
        assert text.startswith(f"{item.name} of effect '{effect.name}' is missing")
        text = refusal([(effect.name, strong(effect) | {f"{item.name}_": 1.0})])
        assert text.endswith(f"of effect '{effect.name}': did you mean {item.name}?")


@EACH
def test_an_effect_can_be_pickled(effect: Effect) -> None:
    again = pickle.loads(pickle.dumps(effect))
    assert again.name == effect.name
    assert again.apply(BASE, **strong(effect)) == effect.apply(BASE, **strong(effect))


def test_an_unknown_effect_is_refused_with_the_nearest_name() -> None:
    assert refusal([("damper.fricton", {"force": 3.0})]) == (
        "Unknown effect 'damper.fricton': did you mean damper.friction?"
    )


def test_every_effect_of_the_catalogue_belongs_to_one_site_in_order() -> None:
    of_sites = [effect.name for site in SITES for effect in CATALOGUE.values() if effect.site == site]
    assert of_sites == list(CATALOGUE)


@pytest.mark.parametrize(
    ("table", "name"), [("actuator", "delay"), ("table", "delay"), ("damper", "motor_time_constant")]
)
def test_an_added_delay_or_lag_never_makes_a_time_negative(table: str, name: str) -> None:
    effect = "damper.motor_lag" if table == "damper" else f"{table}.delay"
    parameter = CATALOGUE[effect].parameters[0].name
    for value, more in ((-0.05, None), (0.01, 0.01)):
        system = lay(BASE, [(effect, {parameter: value})])
        nominal = getattr(getattr(BASE.plan, table), name)
        assert getattr(getattr(system.plan, table), name) == (0.0 if more is None else nominal + more)


def test_effects_reach_every_storey_and_leave_ideal_parameters_ideal() -> None:
    structure = Structure(mass=(1.0, 2.0), stiffness=(3.0, 4.0), damping=(5.0, 6.0))
    plan = Plan(structure=structure, table=ShakingTable(frequency=math.inf), damper=Damper(stiffness=0.0))
    system = System(plan)
    for name in CATALOGUE:
        assert lay(system, [(name, null_parameters(CATALOGUE[name]))]) == system
    assert lay(system, [("structure.mass", {"factor": 2.0})]).plan.structure.mass == (2.0, 4.0)
    assert lay(system, [("table.bandwidth", {"factor": 0.5})]).plan == plan
    assert lay(system, [("damper.stiffness", {"factor": 2})]).plan == plan


def test_effects_on_two_readings_apply_independently() -> None:
    system = lay(
        BASE,
        [
            ("sensor.column_force.gain", {"factor": 1.1}),
            ("sensor.column_force.bias", {"offset": 50}),
            ("sensor.damper_force.noise", {"rms": 0.5}),
        ],
    )
    assert system.plan == BASE.plan
    assert (system.effects.sensors["column_force"].gain, system.effects.sensors["column_force"].bias) == (
        1.1,
        50,
    )
    assert system.effects.sensors["damper_force"].noise == 0.5
    assert BASE.effects.sensors == {}


def test_time_shift_and_p_delta_have_the_documented_signs() -> None:
    assert lay(BASE, [("ground.time_shift", {"shift": 0.1})]).effects.time_shift == 0.1
    assert lay(BASE, [("structure.p_delta", {"stiffness": -5e5})]).effects.p_delta == -5e5
    refusal([("structure.p_delta", {"stiffness": 5e5})])


@st.composite
def entries(draw: st.DrawFn) -> list[effects.Entry]:
    names = draw(st.lists(st.sampled_from(sorted(CATALOGUE)), unique=True, max_size=4))
    return [
        (
            name,
            {
                item.name: draw(st.floats(item.least, item.most))
                for item in CATALOGUE[name].parameters
                if item.default is None or draw(st.booleans())
            },
        )
        for name in names
    ]


def test_factors_on_one_field_multiply() -> None:
    weaker = lay(BASE, [("damper.gain", {"factor": 0.9})])
    assert lay(weaker, [("damper.gain", {"factor": 0.5})]).effects.damper.gain == 0.45


@given(entries())
def test_effects_of_the_catalogue_can_be_laid_in_any_order(chosen: list[effects.Entry]) -> None:
    assert lay(BASE, chosen) == lay(BASE, chosen[::-1])
    assert lay(BASE, chosen) == lay(lay(BASE, chosen[:1]), chosen[1:])
