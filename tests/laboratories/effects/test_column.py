"""Effects of the specimen against closed forms, energy balances and other solvers."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp, trapezoid

from common.plan.laboratory_tables import Column
from laboratories.column import specimen
from models.specimens.fit import forces
from models.system import ColumnEffects
from tests.laboratories.effects.histories import DT, SHORT, Array, K, cycles, run_a, specimen_under, tones


def last_loop(path: Array, force: Array, frequency: float) -> float:
    """Energy lost in the last cycle."""
    steps = round(1.0 / (frequency * SHORT)) + 1
    return float(trapezoid(force[-steps:], path[-steps:]))


@settings(max_examples=15)
@given(
    friction=st.floats(100.0, 3000.0),
    presliding=st.floats(3e-6, 1e-4),
    amplitude=st.floats(0.5e-3, 4e-3),
    frequency=st.sampled_from([0.5, 1.0, 2.0, 4.0]),
)
def test_column_friction_dissipates_a_parallelogram_per_cycle(
    friction: float, presliding: float, amplitude: float, frequency: float
) -> None:
    _, path = cycles(amplitude, frequency)
    force = specimen_under(path, ColumnEffects(friction=friction, presliding=presliding))
    assert last_loop(path, force, frequency) == pytest.approx(
        4.0 * friction * (amplitude - presliding), rel=4e-3
    )
    assert np.max(np.abs(force - K * path)) == pytest.approx(friction, rel=1e-9)


def test_column_friction_acts_as_a_spring_before_it_slides() -> None:
    effects = ColumnEffects(friction=900.0, presliding=20e-6)
    path = np.concatenate([np.linspace(0.0, 40e-6, 41), np.linspace(40e-6, -10e-6, 51)[1:]])
    got = specimen_under(path, effects) - K * path
    up, down = path[:41], path[41:]
    assert np.allclose(got[1:41], 900.0 * np.minimum(up[1:] / 20e-6, 1.0), atol=1e-6)
    # after the reversal the contact first unloads over twice its presliding deformation
    assert np.allclose(got[41:], 900.0 * np.maximum(1.0 - (40e-6 - down) / 20e-6, -1.0), atol=1e-6)


def test_column_friction_that_falls_with_speed_follows_its_law() -> None:
    effects = ColumnEffects(friction=900.0, presliding=1e-6, friction_velocity=0.01)
    for speed in (0.001, 0.01, 0.05):
        path = np.arange(1, 400) * speed * SHORT
        got = specimen_under(path, effects) - K * path
        assert got[-1] == pytest.approx(900.0 * math.tanh(speed / 0.01), rel=1e-6)


@pytest.mark.parametrize("hold", [1, 50])
def test_column_friction_stays_constant_while_the_specimen_rests(hold: int) -> None:
    path = np.concatenate([np.linspace(0.0, 1e-3, 100), np.full(hold, 1e-3)])
    got = specimen_under(path, ColumnEffects(friction=900.0)) - K * path
    assert np.allclose(got[10:], 900.0, rtol=1e-6)


@settings(max_examples=10)
@given(
    coefficient=st.floats(3e3, 1.5e5),
    amplitude=st.floats(1e-4, 4e-3),
    frequency=st.sampled_from([1.0, 2.0, 5.0]),
)
def test_a_viscous_column_dissipates_an_ellipse_per_cycle(
    coefficient: float, amplitude: float, frequency: float
) -> None:
    _, path = cycles(amplitude, frequency)
    force = specimen_under(path, ColumnEffects(viscous=coefficient))
    expected = math.pi * coefficient * 2.0 * math.pi * frequency * amplitude**2
    assert last_loop(path, force, frequency) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("frequency", [1.0, 2.0, 5.0])
def test_the_fixtures_inertia_reduces_the_dynamic_stiffness(frequency: float) -> None:
    t, path = cycles(2e-3, frequency)
    got = specimen_under(path, ColumnEffects(inertia=600.0)) - K * path
    omega, last = 2.0 * np.pi * frequency, slice(-round(1.0 / (frequency * SHORT)), None)
    sine, cosine = np.sin(omega * t[last]), np.cos(omega * t[last])
    in_phase, across = 2.0 * np.mean(got[last] * sine), 2.0 * np.mean(got[last] * cosine)
    assert in_phase == pytest.approx(-600.0 * omega**2 * 2e-3, rel=1e-3)
    assert abs(across) < 0.01 * abs(in_phase)


def test_inertia_and_viscosity_act_on_the_load_cell_reading_behind_the_actuator() -> None:
    """The same two, as the load cell reads them at the ticks while the servo loop moves the specimen.

    There T·ẏ = u − y and T·ÿ = u̇ − ẏ, with u̇ the slope of the ramp that just ended.
    """
    command = tones(600, size=1e-3)
    got = run_a(command, column_effects=ColumnEffects(inertia=2000.0, viscous=40e3))
    late = np.concatenate([np.zeros(8), command])  # 14 ms are seven ticks
    u, slope = late[1:][: command.size], np.diff(late)[: command.size] / DT
    rate = (u - got[:, 0]) / 0.030
    acceleration = (slope - rate) / 0.030
    rest = got[:, 1] - K * got[:, 0]
    for part in (2000.0 * acceleration, 40e3 * rate):
        assert np.std(part) > 0.1 * np.std(rest)
    error = rest - 2000.0 * acceleration - 40e3 * rate
    assert np.std(error) < 0.02 * np.std(rest)


@pytest.mark.parametrize("exponent", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("hardening", [0.0, 0.05])
def test_the_yielding_column_solves_bouc_and_wens_equation(exponent: float, hardening: float) -> None:
    limit = 0.8e-3
    turns = [0.0, 2e-3, -1.5e-3, 1e-3]
    path = np.concatenate([np.linspace(a, b, 300)[1:] for a, b in itertools.pairwise(turns)])
    more = ColumnEffects(yield_displacement=limit, hardening=hardening, exponent=exponent)
    z, before, expected = 0.0, 0.0, []
    for deformation in path:
        sign = math.copysign(1.0, deformation - before)

        def slope(_: float, z: Array, sign: float = sign) -> Any:
            return (1.0 - abs(z) ** exponent * 0.5 * (1.0 + np.sign(z * sign))) / limit

        z = solve_ivp(slope, (before, deformation), [z], rtol=1e-8, atol=1e-10).y[0, -1]
        before = float(deformation)
        expected.append(hardening * K * deformation + (1.0 - hardening) * K * limit * z)
    got = specimen_under(path, more)
    assert np.max(np.abs(got - expected)) < 2e-5 * K * limit


def test_the_yielding_column_is_bilinear_with_a_large_exponent() -> None:
    limit, hardening, amplitude = 1e-3, 0.05, 3e-3
    _, path = cycles(amplitude, 1.0)
    more = ColumnEffects(yield_displacement=limit, hardening=hardening, exponent=200.0)
    force = specimen_under(path, more)
    expected = 4.0 * (1.0 - hardening) * K * limit * (amplitude - limit)
    assert last_loop(path, force, 1.0) == pytest.approx(expected, rel=0.01)
    assert np.max(force) == pytest.approx(K * (limit + hardening * (amplitude - limit)), rel=0.01)


def test_a_degrading_columns_stiffness_depends_on_its_largest_deformation() -> None:
    path = np.concatenate(
        [np.linspace(0, 1e-3, 50), np.linspace(1e-3, -3e-3, 90), np.linspace(-3e-3, 2e-3, 90)]
    )
    got = specimen_under(path, ColumnEffects(degradation=0.4))
    largest = np.maximum.accumulate(np.abs(path))
    assert np.allclose(got, K * path * (1.0 - 0.4 * (1.0 - np.exp(-largest / 2e-3))), rtol=1e-12)


@given(
    factor=st.floats(0.05, 0.6),
    hardening=st.floats(-0.5, 0.3),
    width=st.floats(3e-4, 3e-3),
    where=st.floats(0, 5e-3),
)
def test_a_pinched_column_follows_its_formula_and_is_odd(
    factor: float, hardening: float, width: float, where: float
) -> None:
    more = ColumnEffects(pinching=factor, pinching_hardening=hardening, pinching_width=width)
    weight = math.exp(-((where / width) ** 2))
    expected = K * where * (1.0 - factor * weight + hardening * (1.0 - weight))
    (got,), (mirrored,) = (specimen_under(np.array([sign * where]), more) for sign in (1.0, -1.0))
    assert got == pytest.approx(expected, rel=1e-12, abs=1e-9)
    assert mirrored == -got


@given(tails=st.floats(0.5, 20.0), width=st.floats(1e-4, 1e-2), where=st.floats(-1e-2, 1e-2))
def test_a_pinched_column_with_tails_follows_its_formula(tails: float, width: float, where: float) -> None:
    more = ColumnEffects(pinching=0.4, pinching_width=width, pinching_law=1.0, pinching_tails=tails)
    (got,) = specimen_under(np.array([where]), more)
    weight = (1.0 + (where / width) ** 2 / tails) ** -tails
    assert got == pytest.approx(K * where * (1.0 - 0.4 * weight), rel=1e-12, abs=1e-9)


@given(gap=st.floats(2e-5, 1e-3), where=st.floats(-3e-3, 3e-3))
def test_a_loose_column_has_no_force_inside_its_gap(gap: float, where: float) -> None:
    (got,) = specimen_under(np.array([where]), ColumnEffects(slip=gap))
    outside = abs(where) - 0.5 * gap
    assert got == pytest.approx(math.copysign(K * max(outside, 0.0), where), abs=1e-6)


def through(*turns: float, steps: int = 400) -> Array:
    """Deformations from rest through turning points, in short steps."""
    parts = [np.linspace(a, b, steps)[1:] for a, b in itertools.pairwise((0.0, *turns))]
    return np.concatenate([[0.0], *parts])


def test_a_gap_around_the_rest_position_moves_with_a_yielded_specimen() -> None:
    gap, limit = 0.4e-3, 1e-3
    more = ColumnEffects(slip=gap, slip_law=1.0, yield_displacement=limit, hardening=0.0, law=1.0)
    path = through(3e-3, 0.0)
    got = specimen_under(path, more)
    up, back = path[:400], path[400:]
    loaded = np.clip(up - 0.5 * gap, 0.0, limit)
    assert np.allclose(got[:400], K * loaded, atol=0.01 * K * limit)
    # it unloads by the yield displacement, and nothing is felt until the other contact, one gap away
    left = np.maximum(limit - (3e-3 - back), 0.0)
    met = np.minimum(back - (3e-3 - limit - gap), 0.0)
    assert np.allclose(got[400:], K * (left + np.maximum(met, -limit)), atol=0.01 * K * limit)


def test_with_an_elastic_specimen_a_gap_around_its_rest_position_acts_like_one_around_the_origin() -> None:
    path = through(2e-3, -1.5e-3, 1e-3, -0.1e-3, 0.5e-3)
    resting = specimen_under(path, ColumnEffects(slip=0.6e-3, slip_law=1.0))
    assert np.allclose(resting, specimen_under(path, ColumnEffects(slip=0.6e-3)), atol=0.01 * K * 1e-3)


def test_a_specimen_held_in_a_gap_lags_by_half_the_gap() -> None:
    gap, top = 0.4e-3, 2e-3
    path = through(top, -top, top)
    got = specimen_under(path, ColumnEffects(slip=gap, slip_law=2.0))
    loop = float(trapezoid(got[399:], path[399:]))
    # a parallelogram, in which the force lags behind: what holds the specimen gives the work
    assert loop == pytest.approx(-K * 2.0 * gap * (top - 0.5 * gap), rel=0.01)
    assert got[399] == pytest.approx(K * (top - 0.5 * gap))


@given(gap=st.floats(2e-5, 1e-3), share=st.floats(0.05, 1.0), where=st.floats(-3e-3, 3e-3))
def test_a_part_in_parallel_with_the_gap_carries_force_inside_it(
    gap: float, share: float, where: float
) -> None:
    (got,) = specimen_under(np.array([where]), ColumnEffects(slip=gap, slip_law=3.0, slip_share=share))
    inside = min(max(where, -0.5 * gap), 0.5 * gap)
    assert got == pytest.approx(K * (where - share * inside), abs=1e-6)


@given(share=st.floats(-0.5, 2.0), bend=st.floats(1e-4, 3e-3), where=st.floats(-4e-3, 4e-3))
def test_a_hardening_column_follows_its_formulas(share: float, bend: float, where: float) -> None:
    cubic, bent = (
        specimen_under(
            np.array([where]), ColumnEffects(stiffening=share, stiffening_law=law, stiffening_bend=bend)
        )[0]
        for law in (0.0, 1.0)
    )
    assert cubic == pytest.approx(K * where * (1.0 + share * (where / 2e-3) ** 2), abs=1e-6)
    beyond = math.copysign(max(abs(where) - bend, 0.0), where)
    assert bent == pytest.approx(K * (where + share * beyond), abs=1e-6)


@pytest.mark.parametrize("share", [-0.2, 0.5])
def test_hardening_with_a_power_is_nearly_that_of_a_sine_hyperbolicus(share: float) -> None:
    """`6·share·s·(sinh(δ/s) − δ/s)` over 3 mm, s = 2 mm: a power of 2.138 misses 0.42 % of its rms, a cube 2.0 %."""
    path = np.linspace(-3e-3, 3e-3, 301)
    sine = 6.0 * share * 2e-3 * (np.sinh(path / 2e-3) - path / 2e-3)
    fitted = share * 6.0 * 0.41735 / 1.5**2.13779
    more = ColumnEffects(stiffening=fitted, stiffening_law=3.0, stiffening_exponent=2.13779)
    got = np.array([specimen_under(np.array([x]), more)[0] for x in path]) / K - path
    assert float(np.sqrt(np.mean((got - sine) ** 2) / np.mean(sine**2))) < 0.01


@pytest.mark.parametrize("where", [-3e-3, -1.5e-3, 5e-4, 2.5e-3])
def test_hardening_with_two_bends_consists_of_three_lines(where: float) -> None:
    more = ColumnEffects(
        stiffening=-0.6,
        stiffening_law=2.0,
        stiffening_bend=1e-3,
        stiffening_second=-0.24,
        stiffening_second_bend=2e-3,
    )
    places, forces_there = [0.0, 1e-3, 2e-3, 3e-3], [0.0, K * 1e-3, K * 1.4e-3, K * 1.56e-3]
    expected = math.copysign(float(np.interp(abs(where), places, forces_there)), where)
    assert specimen_under(np.array([where]), more)[0] == pytest.approx(expected, abs=1e-6)


def test_a_self_centring_column_dissipates_two_flags_and_returns_to_the_origin() -> None:
    place, loop, amplitude = 1e-3, 0.6, 3e-3
    _, path = cycles(amplitude, 1.0)
    more = ColumnEffects(centring=place, centring_hardening=0.1, centring_loop=loop)
    force = specimen_under(path, more)
    # between two parallel lines, that both have the stiffness k where they are left and reached
    height = 0.9 * loop * K * place
    expected = 2.0 * height * (amplitude - place)
    assert last_loop(path, force, 1.0) == pytest.approx(expected, rel=0.01)
    assert abs(specimen_under(through(amplitude, 0.0), more)[-1]) < 1e-6


@pytest.mark.parametrize("name", ["trilinear", "pinched", "pinched_by_peak", "pinched_by_rest"])
def test_the_further_laws_of_yielding_equal_the_specimen_models_of_that_name(name: str) -> None:
    path = through(2e-3, -3e-3, 2.5e-3, -1e-3)
    shapes = {"hardening": 0.03, "first_bend": 0.4, "second_stiffness": 0.6}
    corner = {"pinch_force": 0.3, "pinch_displacement": 0.6, "unloading": 0.2, "damage": 0.05}
    side = {"asymmetry": -0.3} if name != "trilinear" else {}
    given = shapes | (corner if name != "trilinear" else {})
    law = float(specimen.LAWS.index(name))
    more: dict[str, Any] = {"yield_displacement": 1e-3, "law": law, **given}
    more |= {f"yield_{key}": value for key, value in side.items()}
    got = specimen_under(path, ColumnEffects(**more))
    expected = forces(
        name, {"stiffness": K, "yield_displacement": 1e-3, **given, **side}, path.astype(np.float64)
    )
    assert np.allclose(got, expected, rtol=1e-9, atol=1e-6)


def test_the_law_of_layers_equals_the_specimen_model_of_that_name() -> None:
    path = through(2e-3, -3e-3, 2.5e-3, -1e-3)
    section = {"concrete": 4.0, "axial": 0.3, "spalling": 0.1, "shaft": 0.7, "focus": 1.5, "core": 0.4}
    section |= {"eccentricity": -0.02}
    law = float(specimen.LAWS.index("layered"))
    more: dict[str, Any] = {"yield_displacement": 1e-3, "hardening": -0.01, "law": law, **section}
    further: dict[str, Any] = {"concrete_strength": 0.6, "exponent": 12.0, "rubbing": 0.03, "uncracked": 1.3}
    got = specimen_under(path, ColumnEffects(**more, **further))
    given = {"stiffness": 1.3 * K, "yield_displacement": 1e-3, "hardening": -0.01, **section}
    given |= {"strength": 0.6, "sharpness": 12.0, "friction": 0.03}
    expected = forces("layered", given, path.astype(np.float64))
    assert np.allclose(got, expected, rtol=1e-9, atol=1e-6)


def test_column_friction_depends_on_direction_and_speed() -> None:
    more = ColumnEffects(friction=900.0, presliding=1e-6, friction_asymmetry=0.2)
    path = through(2e-3, -2e-3)
    got = specimen_under(path, more) - K * path
    assert got[300] == pytest.approx(1080.0)
    assert got[-1] == pytest.approx(-720.0)
    fast = ColumnEffects(friction=900.0, presliding=1e-6, friction_drop=0.3, friction_speed=0.02)
    for speed in (0.002, 0.02, 0.2):
        way = np.arange(1, 400) * speed * SHORT
        rubbing = specimen_under(way, fast)[-1] - K * way[-1]
        assert rubbing == pytest.approx(900.0 * (1.0 - 0.3 * (1.0 - math.exp(-speed / 0.02))), rel=1e-6)


def test_a_slider_takes_the_specimens_place_with_the_play_of_the_grip() -> None:
    more = ColumnEffects(
        friction=900.0, friction_law=2.0, friction_asymmetry=-0.2, friction_stiffness=2e6, slip=1e-3
    )
    path = through(8e-3, -8e-3, 4e-3)
    given = {"stiffness": 2e6, "push": 720.0, "pull": 1080.0, "play": 1e-3}
    assert np.allclose(
        specimen_under(path, more), forces("slider", given, path.astype(np.float64)), rtol=1e-12
    )
    fast = ColumnEffects(friction=900.0, friction_law=2.0, friction_drop=0.3, friction_speed=0.02)
    way = np.arange(1, 400) * 0.02 * SHORT
    left = 900.0 * (1.0 - 0.3 * (1.0 - math.exp(-1.0)))
    assert specimen_under(way, fast)[-1] == pytest.approx(left, rel=1e-6)


@given(gap=st.floats(2e-5, 1e-3), where=st.floats(-3e-3, 3e-3))
def test_a_gap_with_round_corners_ends_like_a_sharp_one(gap: float, where: float) -> None:
    sharp, rounded = (
        specimen_under(np.array([where]), ColumnEffects(slip=gap, slip_law=law, slip_corner=1e-5))[0]
        for law in (0.0, 4.0)
    )
    assert abs(rounded - sharp) <= K * 1e-5 * math.log(2.0) + 1e-6


def test_effects_of_the_column_are_added_to_any_specimen_model() -> None:
    bilinear = Column(
        model="bilinear", stiffness=K, parameters={"yield_displacement": 1e-3, "hardening": 0.1}
    )
    _, path = cycles(3e-3, 1.0)
    plain = specimen_under(path, ColumnEffects(), column=bilinear)
    assert last_loop(path, plain, 1.0) == pytest.approx(4.0 * 0.9 * K * 1e-3 * 2e-3, rel=1e-4)
    more = specimen_under(path, ColumnEffects(viscous=4e4), column=bilinear)
    speed = np.diff(path, prepend=path[0]) / SHORT
    assert np.allclose(more, plain + 4e4 * speed, rtol=1e-9, atol=1e-6)


def test_the_work_of_falling_friction_by_quadrature_agrees_with_the_loop() -> None:
    """∮ F·tanh(|v|/v0) |dx| of a sine by quadrature, against the specimen's loop."""
    amplitude, frequency, force, fall = 2e-3, 1.0, 900.0, 0.005
    omega = 2.0 * math.pi * frequency
    _, path = cycles(amplitude, frequency)
    more = ColumnEffects(friction=force, presliding=1e-7, friction_velocity=fall)

    def power(t: float) -> float:
        v = abs(amplitude * omega * math.cos(omega * t))
        return force * math.tanh(v / fall) * v

    expected = 4.0 * quad(power, 0.0, 0.25 / frequency)[0]
    assert last_loop(path, specimen_under(path, more), frequency) == pytest.approx(expected, rel=3e-3)


def test_one_law_alone_takes_the_place_of_the_planned_specimen() -> None:
    path = through(3e-3, -3e-3)
    yields = ColumnEffects(yield_displacement=1e-3, law=1.0)
    both = replace(yields, friction=5e3, friction_law=2.0, viscous=1e5, viscous_law=2.0)
    assert np.array_equal(specimen_under(path, both), specimen_under(path, yields))
