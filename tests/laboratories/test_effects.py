"""Unmodelled effects in the laboratories against closed forms, energy balances and other solvers."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad, solve_ivp, trapezoid

from common.errors import InputError
from common.plan.laboratory_tables import Actuator, Column, Damper, ShakingTable
from common.plan.plan import Plan
from common.plan.read import with_test
from common.rig import ColumnCommand, TableCommand
from common.roles import SLAVE
from laboratories.column import model as column_lab
from laboratories.column import specimen
from laboratories.column.kind import COLUMN
from laboratories.effects import CATALOGUE, lay
from laboratories.effects.effect import Effect, Parameter
from laboratories.emulated import EmulatedLab
from laboratories.table import model as table_lab
from laboratories.table.kind import TABLE
from loop import substructure
from loop.closed_loop import Rollout, simulate
from loop.signals import signals
from models import preisach
from models.specimens.fit import forces
from models.system import ActuatorEffects, ColumnEffects, DamperEffects, System, TableEffects
from tests.laboratories.effects.distinct import DISTINCT

Array = NDArray[np.floating[Any]]

DT = 0.002
SHORT = 0.25e-3
K = 12.5e6
DIRECT = Actuator(gain=1.0, delay=0.0, time_constant=0.0)
EACH = pytest.mark.parametrize("effect", DISTINCT.values(), ids=list(DISTINCT))


# ---------------------------------------------------------------- the whole catalogue


@pytest.fixture(scope="module")
def plan(default_plan: Plan) -> Plan:
    return with_test(default_plan, duration=3.0)


def rollout(system: System, seed: int | None = 3) -> Rollout:
    motion = substructure.motion(system.plan)
    ground = substructure.ground_rows(system.plan, motion, system.effects.time_shift)
    return simulate(system.plan, ground, effects=system.effects, seed=seed)


def everything(found: Rollout) -> Array:
    return np.column_stack([*found.master.values(), *found.slaves[SLAVE].values()])


@pytest.fixture(scope="module")
def nominal(plan: Plan) -> Rollout:
    return rollout(System(plan))


def strength(effect: Effect) -> Parameter:
    return next(item for item in effect.parameters if not item.shape)


def rigs(system: System) -> list[tuple[float, ...]]:
    """Readings of both emulated laboratories under commands that do not depend on them."""
    result: list[tuple[float, ...]] = []
    lab_a, lab_b = EmulatedLab(COLUMN, system, 5), EmulatedLab(TABLE, system, 6)
    for tick in range(150):
        wave = math.sin(0.05 * tick) + 0.3 * math.sin(0.31 * tick)
        result.append((*lab_a.read(), *lab_b.read()))
        lab_a.write(ColumnCommand(2e-3 * wave))
        lab_b.write(TableCommand(10e-3 * wave, 40.0 * wave))
    return result


def test_an_effect_in_the_rigs_shows_only_at_its_laboratory(plan: Plan) -> None:
    before = np.array(rigs(System(plan)))
    for effect in CATALOGUE.values():
        changed = lay(System(plan), [(effect.name, {strength(effect).name: ordered(effect)[-1]})])
        differs = np.any(np.array(rigs(changed)) != before, axis=0)
        part, _, signal = effect.site.partition(".")
        if part == "sensor":
            place = (*COLUMN.channels.names, *TABLE.channels.names).index(signal)
            assert np.flatnonzero(differs).tolist() == [place], effect.name
        else:
            in_a, in_b = part in ("actuator", "column"), part in ("table", "damper")
            assert (bool(differs[:2].any()), bool(differs[2:].any())) == (in_a, in_b), effect.name


def ordered(effect: Effect) -> list[float]:
    """The sizes of an effect, the weakest first."""
    item = strength(effect)
    return sorted(item.sizes, key=lambda size: -size if math.isinf(item.null) else abs(size - item.null))


@EACH
def test_a_millionth_of_the_weakest_size_is_a_thousandth_of_its_change(
    effect: Effect, plan: Plan, nominal: Rollout
) -> None:
    item = strength(effect)
    tiny = item.most if math.isinf(item.null) else item.null + 1e-6 * (ordered(effect)[0] - item.null)
    changes = []
    for size in (ordered(effect)[0], tiny):
        found = rollout(lay(System(plan), [(effect.name, {item.name: size})]))
        assert found.finite
        changes.append(np.max(np.abs(everything(found) - everything(nominal)), axis=0))
    weak, slight = changes
    if effect.site == "link":  # a matter of the exchange, not of the laboratories
        assert not weak.any()
        return
    scale = np.max(np.abs(everything(nominal)), axis=0)
    if not math.isinf(item.null):
        assert weak.any()
    share = (
        0.5 if math.isinf(item.null) else 1e-3
    )  # an infinite null is approached as far as the bound allows
    assert np.all(slight <= share * weak + 1e-9 * scale)


# ---------------------------------------------------------------- the column


def specimen_under(
    path: Array, effects: ColumnEffects, step: float = SHORT, column: Column | None = None
) -> Array:
    """Force at each deformation of a path, from rest at its first point."""
    parts = specimen.build(column or Column(stiffness=K), effects)
    return np.array([specimen.force(parts, float(deformation), step) for deformation in path])


def cycles(amplitude: float, frequency: float, count: int = 3) -> tuple[Array, Array]:
    """Times and deformations of a sine, in short steps, whole cycles."""
    steps = round(1.0 / (frequency * SHORT))
    t = np.arange(count * steps + 1) * SHORT
    return t, amplitude * np.sin(2.0 * np.pi * frequency * t)


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
def test_column_friction_loses_a_parallelogram(
    friction: float, presliding: float, amplitude: float, frequency: float
) -> None:
    _, path = cycles(amplitude, frequency)
    force = specimen_under(path, ColumnEffects(friction=friction, presliding=presliding))
    assert last_loop(path, force, frequency) == pytest.approx(
        4.0 * friction * (amplitude - presliding), rel=4e-3
    )
    assert np.max(np.abs(force - K * path)) == pytest.approx(friction, rel=1e-9)


def test_column_friction_is_a_spring_before_it_slides() -> None:
    effects = ColumnEffects(friction=900.0, presliding=20e-6)
    path = np.concatenate([np.linspace(0.0, 40e-6, 41), np.linspace(40e-6, -10e-6, 51)[1:]])
    got = specimen_under(path, effects) - K * path
    up, down = path[:41], path[41:]
    assert np.allclose(got[1:41], 900.0 * np.minimum(up[1:] / 20e-6, 1.0), atol=1e-6)
    # after the reversal the contact first unloads over twice its presliding deformation
    assert np.allclose(got[41:], 900.0 * np.maximum(1.0 - (40e-6 - down) / 20e-6, -1.0), atol=1e-6)


def test_column_friction_that_falls_off_with_speed() -> None:
    effects = ColumnEffects(friction=900.0, presliding=1e-6, friction_velocity=0.01)
    for speed in (0.001, 0.01, 0.05):
        path = np.arange(1, 400) * speed * SHORT
        got = specimen_under(path, effects) - K * path
        assert got[-1] == pytest.approx(900.0 * math.tanh(speed / 0.01), rel=1e-6)


@pytest.mark.parametrize("hold", [1, 50])
def test_column_friction_stays_while_the_specimen_does_not_move(hold: int) -> None:
    path = np.concatenate([np.linspace(0.0, 1e-3, 100), np.full(hold, 1e-3)])
    got = specimen_under(path, ColumnEffects(friction=900.0)) - K * path
    assert np.allclose(got[10:], 900.0, rtol=1e-6)


@settings(max_examples=10)
@given(
    coefficient=st.floats(3e3, 1.5e5),
    amplitude=st.floats(1e-4, 4e-3),
    frequency=st.sampled_from([1.0, 2.0, 5.0]),
)
def test_the_viscous_column_loses_an_ellipse(coefficient: float, amplitude: float, frequency: float) -> None:
    _, path = cycles(amplitude, frequency)
    force = specimen_under(path, ColumnEffects(viscous=coefficient))
    expected = math.pi * coefficient * 2.0 * math.pi * frequency * amplitude**2
    assert last_loop(path, force, frequency) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("frequency", [1.0, 2.0, 5.0])
def test_the_fixtures_inertia_takes_from_the_stiffness(frequency: float) -> None:
    t, path = cycles(2e-3, frequency)
    got = specimen_under(path, ColumnEffects(inertia=600.0)) - K * path
    omega, last = 2.0 * np.pi * frequency, slice(-round(1.0 / (frequency * SHORT)), None)
    sine, cosine = np.sin(omega * t[last]), np.cos(omega * t[last])
    in_phase, across = 2.0 * np.mean(got[last] * sine), 2.0 * np.mean(got[last] * cosine)
    assert in_phase == pytest.approx(-600.0 * omega**2 * 2e-3, rel=1e-3)
    assert abs(across) < 0.01 * abs(in_phase)


def test_inertia_and_viscosity_in_the_laboratory_behind_its_actuator() -> None:
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


def test_the_degrading_column_remembers_its_largest_deformation() -> None:
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
def test_the_pinched_column_is_its_formula_and_odd(
    factor: float, hardening: float, width: float, where: float
) -> None:
    more = ColumnEffects(pinching=factor, pinching_hardening=hardening, pinching_width=width)
    weight = math.exp(-((where / width) ** 2))
    expected = K * where * (1.0 - factor * weight + hardening * (1.0 - weight))
    (got,), (mirrored,) = (specimen_under(np.array([sign * where]), more) for sign in (1.0, -1.0))
    assert got == pytest.approx(expected, rel=1e-12, abs=1e-9)
    assert mirrored == -got


@given(gap=st.floats(2e-5, 1e-3), where=st.floats(-3e-3, 3e-3))
def test_the_loose_column_feels_nothing_inside_its_gap(gap: float, where: float) -> None:
    (got,) = specimen_under(np.array([where]), ColumnEffects(slip=gap))
    outside = abs(where) - 0.5 * gap
    assert got == pytest.approx(math.copysign(K * max(outside, 0.0), where), abs=1e-6)


def through(*turns: float, steps: int = 400) -> Array:
    """Deformations from rest through turning points, in short steps."""
    parts = [np.linspace(a, b, steps)[1:] for a, b in itertools.pairwise((0.0, *turns))]
    return np.concatenate([[0.0], *parts])


def test_the_gap_goes_along_with_a_specimen_that_rests_elsewhere() -> None:
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


def test_a_gap_where_an_elastic_specimen_rests_is_the_one_around_the_origin() -> None:
    path = through(2e-3, -1.5e-3, 1e-3, -0.1e-3, 0.5e-3)
    resting = specimen_under(path, ColumnEffects(slip=0.6e-3, slip_law=1.0))
    assert np.allclose(resting, specimen_under(path, ColumnEffects(slip=0.6e-3)), atol=0.01 * K * 1e-3)


def test_a_specimen_that_is_held_stays_behind_by_half_the_gap() -> None:
    gap, top = 0.4e-3, 2e-3
    path = through(top, -top, top)
    got = specimen_under(path, ColumnEffects(slip=gap, slip_law=2.0))
    loop = float(trapezoid(got[399:], path[399:]))
    # a parallelogram, in which the force lags behind: what holds the specimen gives the work
    assert loop == pytest.approx(-K * 2.0 * gap * (top - 0.5 * gap), rel=0.01)
    assert got[399] == pytest.approx(K * (top - 0.5 * gap))


@given(gap=st.floats(2e-5, 1e-3), share=st.floats(0.05, 1.0), where=st.floats(-3e-3, 3e-3))
def test_a_part_beside_the_gap_carries_on(gap: float, share: float, where: float) -> None:
    (got,) = specimen_under(np.array([where]), ColumnEffects(slip=gap, slip_law=3.0, slip_share=share))
    inside = min(max(where, -0.5 * gap), 0.5 * gap)
    assert got == pytest.approx(K * (where - share * inside), abs=1e-6)


@given(share=st.floats(-0.5, 2.0), bend=st.floats(1e-4, 3e-3), where=st.floats(-4e-3, 4e-3))
def test_the_hardening_column_is_its_formulas(share: float, bend: float, where: float) -> None:
    cubic, bent = (
        specimen_under(
            np.array([where]), ColumnEffects(stiffening=share, stiffening_law=law, stiffening_bend=bend)
        )[0]
        for law in (0.0, 1.0)
    )
    assert cubic == pytest.approx(K * where * (1.0 + share * (where / 2e-3) ** 2), abs=1e-6)
    beyond = math.copysign(max(abs(where) - bend, 0.0), where)
    assert bent == pytest.approx(K * (where + share * beyond), abs=1e-6)


def test_the_self_centring_column_loses_two_flags_and_rests_at_the_origin() -> None:
    place, loop, amplitude = 1e-3, 0.6, 3e-3
    _, path = cycles(amplitude, 1.0)
    more = ColumnEffects(centring=place, centring_hardening=0.1, centring_loop=loop)
    force = specimen_under(path, more)
    # between two parallel lines, that both have the stiffness k where they are left and reached
    height = 0.9 * loop * K * place
    expected = 2.0 * height * (amplitude - place)
    assert last_loop(path, force, 1.0) == pytest.approx(expected, rel=0.01)
    assert abs(specimen_under(through(amplitude, 0.0), more)[-1]) < 1e-6


@pytest.mark.parametrize("name", ["trilinear", "pinched"])
def test_further_laws_of_yielding_are_their_models(name: str) -> None:
    path = through(2e-3, -3e-3, 2.5e-3, -1e-3)
    shapes = {"hardening": 0.03, "first_bend": 0.4, "second_stiffness": 0.6}
    corner = {"pinch_force": 0.3, "pinch_displacement": 0.6, "unloading": 0.2, "damage": 0.05}
    given = shapes | (corner if name == "pinched" else {})
    law = float(specimen.LAWS.index(name))
    more: dict[str, Any] = {"yield_displacement": 1e-3, "law": law, **given}
    got = specimen_under(path, ColumnEffects(**more))
    expected = forces(name, {"stiffness": K, "yield_displacement": 1e-3, **given}, path.astype(np.float64))
    assert np.allclose(got, expected, rtol=1e-9, atol=1e-6)


def test_friction_by_direction_and_speed() -> None:
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


def test_effects_of_the_column_come_on_top_of_any_model() -> None:
    bilinear = Column(
        model="bilinear", stiffness=K, parameters={"yield_displacement": 1e-3, "hardening": 0.1}
    )
    _, path = cycles(3e-3, 1.0)
    plain = specimen_under(path, ColumnEffects(), column=bilinear)
    assert last_loop(path, plain, 1.0) == pytest.approx(4.0 * 0.9 * K * 1e-3 * 2e-3, rel=1e-4)
    more = specimen_under(path, ColumnEffects(viscous=4e4), column=bilinear)
    speed = np.diff(path, prepend=path[0]) / SHORT
    assert np.allclose(more, plain + 4e4 * speed, rtol=1e-9, atol=1e-6)


# ---------------------------------------------------------------- the actuator


def run_a(
    command: Array,
    actuator: Actuator | None = None,
    column: Column | None = None,
    actuator_effects: ActuatorEffects | None = None,
    column_effects: ColumnEffects | None = None,
) -> Array:
    """True displacement and force of laboratory A at the ends of the intervals."""
    lab = column_lab.build(
        DT, actuator or Actuator(), column or Column(stiffness=K), actuator_effects, column_effects
    )
    return np.array([column_lab.advance(lab, float(value)) for value in command])


def tones(ticks: int, seed: int = 1, size: float = 1.0) -> Array:
    """A smooth random command, some `size` large."""
    random = np.random.default_rng(seed)
    t = np.arange(1, ticks + 1) * DT
    frequency, phase = random.uniform(0.5, 5.0, size=4), random.uniform(0.0, 6.0, size=4)
    waves = (np.sin(2.0 * np.pi * f * t + p) for f, p in zip(frequency, phase, strict=True))
    result: Array = size * sum(waves) * np.tanh(2.0 * t)
    return result


def ramped(values: Array, lag: float) -> Callable[[float], float]:
    """The command as the controller ramps it, `lag` s later."""
    times, reached = DT * np.arange(values.size + 1), np.concatenate([[0.0], values])
    return lambda t: float(np.interp(t - lag, times, reached))


@pytest.mark.parametrize("gain", [1.0, 0.9])
@pytest.mark.parametrize(
    ("limit", "band"), [(0.02, 0.0), (math.inf, 4e-4), (0.03, 4e-4)], ids=["limit", "band", "both"]
)
def test_the_servo_loop_solves_its_equation_with_limit_and_dead_band(
    limit: float, band: float, gain: float
) -> None:
    actuator = Actuator(gain=gain, delay=0.0133, time_constant=0.030)
    command = tones(400, size=1.5e-3)
    more = ActuatorEffects(velocity_limit=limit, deadband=band)
    got = run_a(command, actuator, actuator_effects=more)[:, 0]
    reached = ramped(command, 0.0133)

    def slope(t: float, y: Array) -> Any:
        error = gain * reached(t) - y
        return np.clip((error - np.clip(error, -band / 2, band / 2)) / 0.030, -limit, limit)

    times = DT * np.arange(1, command.size + 1)
    exact = solve_ivp(slope, (0, times[-1]), [0.0], t_eval=times, max_step=DT / 8, rtol=1e-8, atol=1e-12).y[0]
    linear = run_a(command, actuator)[:, 0]
    assert np.max(np.abs(linear - exact)) > 1e-4  # there is something to be seen
    assert np.max(np.abs(got - exact)) < 2e-3 * np.max(np.abs(exact))


def test_the_velocity_limit_is_the_slope_of_a_large_step() -> None:
    got = run_a(np.full(200, 0.01), actuator_effects=ActuatorEffects(velocity_limit=0.03))[:, 0]
    slopes = np.diff(got) / DT
    assert np.max(slopes) == pytest.approx(0.03, rel=1e-9)
    # e = T·v where the limit lets go: until then 10 mm − 0.9 mm at 30 mm/s
    assert np.sum(slopes > 0.03 * (1 - 1e-9)) * DT == pytest.approx((0.01 - 0.0009) / 0.03, abs=2 * DT)
    slow = tones(300, size=1e-5)
    same = run_a(slow, actuator_effects=ActuatorEffects(velocity_limit=0.03))[:, 0]
    assert np.allclose(same, run_a(slow)[:, 0], atol=1e-15)


def there_and_back(top: float, back: float, ticks: int) -> Array:
    return np.concatenate([np.linspace(0.0, top, ticks)[1:], np.linspace(top, top - back, ticks)[1:]])


@given(width=st.floats(2e-5, 6e-4), compliance=st.sampled_from([0.0, 3e-9, 3e-8]))
@settings(max_examples=15)
@example(width=2e-4, compliance=3e-8)
def test_the_dead_travel_at_a_reversal_is_the_play(width: float, compliance: float) -> None:
    """Under load too: while the specimen stands still so does its force, and the piston moves the play."""
    command = there_and_back(2e-3, 1e-3, 500)
    more = ActuatorEffects(backlash=width, compliance=compliance)
    got = run_a(command, DIRECT, actuator_effects=more)[:, 0]
    assert got[498] == pytest.approx((2e-3 - width / 2) / (1.0 + compliance * K), rel=1e-6)
    moving = np.flatnonzero(got[499:] < got[498] - 1e-12)[0]
    assert 2e-3 - command[499 + moving] == pytest.approx(width, abs=2.1e-6)
    assert got[-1] == pytest.approx((1e-3 + width / 2) / (1.0 + compliance * K), rel=1e-6)


@given(compliance=st.floats(1e-9, 3e-8))
@settings(max_examples=10)
def test_the_compliant_piston_yields_statically(compliance: float) -> None:
    got = run_a(np.full(400, 2e-3), actuator_effects=ActuatorEffects(compliance=compliance))
    displacement, force = got[-1]
    assert displacement == pytest.approx(2e-3 / (1.0 + compliance * K), rel=1e-5)
    assert force == pytest.approx(K * displacement)


def test_the_compliant_piston_goes_with_the_force_of_a_yielding_specimen() -> None:
    more, compliance = ColumnEffects(yield_displacement=1e-3, hardening=0.05), 1e-8
    command = tones(800, size=1.5e-3)
    servo = run_a(command)[:, 0]
    got = run_a(command, actuator_effects=ActuatorEffects(compliance=compliance), column_effects=more)
    error = got[:, 0] - (servo - compliance * got[:, 1])
    assert np.max(np.abs(compliance * got[:, 1])) > 1e-4
    speed = np.max(np.abs(np.diff(servo))) / DT
    # within the force that a first stiffness overestimates in one short step
    assert np.max(np.abs(error)) < compliance * K * speed * SHORT


def behind_compliance(servo: Array, compliance: float, friction: float, contact: float) -> Array:
    """Deformation δ + c·(K·δ + F·s/contact) = servo at each step, the contact sticking or sliding."""
    before, slider, result = 0.0, 0.0, []
    for piston in servo:
        stick = compliance * friction / contact
        after = (piston + stick * (before - slider)) / (1.0 + compliance * K + stick)
        moved = slider + after - before
        if abs(moved) > contact:
            moved = math.copysign(contact, moved)
            after = (piston - compliance * math.copysign(friction, moved)) / (1.0 + compliance * K)
        before, slider = after, moved
        result.append(after)
    return np.array(result)


STIFF_CONTACT = pytest.mark.xfail(strict=True, reason="c·F/presliding above 1 + c·k: the step is unstable")


@pytest.mark.parametrize(
    ("compliance", "friction"),
    [
        (3e-9, 900.0),
        (1e-8, 900.0),
        pytest.param(3e-8, 900.0, marks=STIFF_CONTACT),
        pytest.param(1e-8, 3000.0, marks=STIFF_CONTACT),
    ],
)
def test_friction_behind_a_compliant_piston_is_its_balance(compliance: float, friction: float) -> None:
    t = np.arange(1, 751) * DT
    more = ActuatorEffects(compliance=compliance)
    rubbing = ColumnEffects(friction=friction, presliding=1e-5)
    command = 2e-3 * np.sin(2.0 * np.pi * 2.0 * t)
    got = run_a(command, DIRECT, actuator_effects=more, column_effects=rubbing)[:, 0]
    expected = behind_compliance(command, compliance, friction, 1e-5)
    assert np.max(np.abs(got - expected)) < 0.1 * compliance * friction


def test_the_dead_band_stops_short_by_half_of_it_from_either_side() -> None:
    for target in (3e-3, -3e-3):
        got = run_a(np.full(2000, target), actuator_effects=ActuatorEffects(deadband=4e-4))[:, 0]
        assert got[-1] == pytest.approx(target - math.copysign(2e-4, target), abs=1e-9)
    inside = run_a(np.full(500, 1.9e-4), actuator_effects=ActuatorEffects(deadband=4e-4))
    assert not inside.any()


# ---------------------------------------------------------------- the table


STILL = Damper(mass=16.0, stiffness=0.0, damping=0.0)


def run_b(
    command: Array,
    motor: Array | None = None,
    table: ShakingTable | None = None,
    damper: Damper | None = None,
    table_effects: TableEffects | None = None,
    damper_effects: DamperEffects | None = None,
    interval: float = DT,
) -> Array:
    """Table displacement, acceleration, stroke, force, and both velocities at the ends of the intervals."""
    lab = table_lab.build(
        interval, table or ShakingTable(), damper or Damper(), table_effects, damper_effects
    )
    pushes = np.zeros(command.size) if motor is None else motor
    rows = []
    for value, push in zip(command.tolist(), pushes.tolist(), strict=True):
        result = table_lab.advance(lab, value, push)
        rows.append((*result, lab.state[table_lab.TABLE_RATE], lab.state[table_lab.STROKE_RATE]))
    return np.array(rows)


Y, ACCELERATION, STROKE, FORCE, RATE, STROKE_RATE = range(6)


def phasor(values: Array, t: Array, frequency: float, after: float) -> complex:
    """Complex amplitude over whole cycles from `after` s on: value = Re(phasor·e^(jωt))."""
    late = t > after + 1e-9
    cycles_ = math.floor(np.sum(late) * DT * frequency + 1e-6)
    count = round(cycles_ / (frequency * DT))
    turning = np.exp(-2j * np.pi * frequency * t[-count:])
    return complex(2.0 * np.mean(values[-count:] * turning))


def second_order(s: complex, frequency: float, damping: float) -> complex:
    omega = 2.0 * math.pi * frequency
    return omega**2 / (s**2 + 2.0 * damping * omega * s + omega**2)


@pytest.mark.parametrize("frequency", [1.0, 5.0, 10.0, 15.625])
@pytest.mark.parametrize("gain", [1.0, 0.93])
@pytest.mark.parametrize(("oil", "damping"), [(math.inf, 0.1), (16.0, 0.1), (10.0, 0.03), (40.0, 0.3)])
def test_gain_and_oil_column_are_their_transfer_functions(
    frequency: float, gain: float, oil: float, damping: float
) -> None:
    t = np.arange(1, 3001) * DT
    command = 5e-3 * np.cos(2.0 * np.pi * frequency * t) * np.minimum(t, 1.0)
    more = TableEffects(gain=gain, oil_frequency=oil, oil_damping=damping)
    got = run_b(command, damper=STILL, table_effects=more)
    s = 2j * math.pi * frequency
    # straight lines through the samples of a sine carry it with the square of a sinc
    ramps = np.sinc(frequency * DT) ** 2
    expected = gain * np.exp(-0.004 * s) * second_order(s, 15.0, 0.7) * 5e-3 * ramps
    if not math.isinf(oil):
        expected *= second_order(s, oil, damping)
    found = phasor(got[:, Y], t, frequency, 4.0)
    assert abs(found - expected) < 2e-3 * abs(expected)
    assert phasor(got[:, ACCELERATION], t, frequency, 4.0) == pytest.approx(s**2 * found, rel=2e-2)


@pytest.mark.parametrize("compliance", [6e-6, 2.5e-5])
def test_at_rest_the_damper_does_not_move_the_table_and_in_motion_by_its_force(compliance: float) -> None:
    frequency = 2.0
    t = np.arange(1, 3001) * DT
    motor = 50.0 * np.cos(2.0 * np.pi * frequency * t) * np.minimum(t, 1.0)
    more, damper = TableEffects(compliance=compliance), Damper(damping=60.0)
    got = run_b(np.zeros(t.size), motor, damper=damper, table_effects=more)
    pushed, force = (phasor(got[:, place], t, frequency, 5.0) for place in (Y, FORCE))
    expected = compliance * second_order(2j * math.pi * frequency, 15.0, 0.7) * force
    # the motor's held command has harmonics, whose force moves the table hardly
    assert pushed == pytest.approx(expected, rel=3e-3)
    pushing = run_b(np.zeros(8000), np.full(8000, 30.0), damper=damper, table_effects=more)
    assert pushing[-1, STROKE] == pytest.approx(30.0 / 56.8, rel=1e-3)
    assert abs(pushing[-1, Y]) < 0.01 * compliance * 30.0


@pytest.mark.parametrize("motor_lag", [0.003, 0.0])
@pytest.mark.parametrize("oil", [math.inf, 16.0])
def test_the_payload_solves_the_coupled_equations(motor_lag: float, oil: float) -> None:
    ticks, compliance = 300, 2.5e-5
    table, damper = ShakingTable(), Damper(motor_time_constant=motor_lag)
    command, motor = tones(ticks, size=5e-3), tones(ticks, seed=2, size=30.0)
    more = TableEffects(compliance=compliance, oil_frequency=oil, oil_damping=0.1)
    got = run_b(command, motor, table, damper, more)
    omega, swing = 2.0 * math.pi * 15.0, 2.0 * math.pi * oil
    reached = ramped(command, table.delay)

    def force(z: Array, push: float) -> float:
        return float(56.8 * z[2] + 6.0 * z[3] - (z[4] if motor_lag else push))

    def slope(t: float, z: Array, push: float) -> list[float]:
        y, rate, _, stroke_rate, lagged, platform, platform_rate = z
        load = force(z, push)
        a = omega**2 * (reached(t) + compliance * load - y) - 1.4 * omega * rate
        felt = a
        if not math.isinf(oil):
            felt = swing**2 * (y - platform) - 0.2 * swing * platform_rate
        turning = (push - lagged) / motor_lag if motor_lag else 0.0
        return [rate, a, stroke_rate, -load / 16.0 - felt, turning, platform_rate, felt]

    z, exact = np.zeros(7), []
    for tick, push in enumerate(motor):
        span = (tick * DT, (tick + 1) * DT)
        z = solve_ivp(slope, span, z, args=(push,), max_step=DT / 2, rtol=1e-9, atol=1e-13).y[:, -1]
        top = 0 if math.isinf(oil) else 5
        exact.append((z[top], slope(span[1], z, push)[1 if top == 0 else 6], z[2], force(z, push)))
    scale = np.max(np.abs(exact), axis=0)
    assert np.all(np.max(np.abs(got[:, :4] - exact), axis=0) < 1e-5 * scale)


def test_the_tables_play_is_its_dead_travel() -> None:
    width, command = 1.5e-3, there_and_back(0.02, 0.01, 4000)
    got = run_b(
        command, damper=STILL, table=ShakingTable(delay=0.0), table_effects=TableEffects(backlash=width)
    )[:, Y]
    plain = run_b(command, damper=STILL, table=ShakingTable(delay=0.0))[:, Y]
    assert plain[3900] - got[3900] == pytest.approx(width / 2, rel=1e-6)
    assert plain[-1] - got[-1] == pytest.approx(-width / 2, rel=1e-6)
    turn = 3999
    standing = np.flatnonzero(np.abs(got[turn:] - got[turn + 300]) < 1e-8)
    assert standing.size * DT == pytest.approx(width / (0.01 / (3999 * DT)), abs=0.12)  # it settles first


def test_the_table_sticks_below_its_friction() -> None:
    omega = 2.0 * math.pi * 15.0
    stuck = 0.95 * 1.0 / omega**2
    got = run_b(np.full(500, stuck), damper=STILL, table_effects=TableEffects(friction=1.0))
    assert np.max(np.abs(got[:, Y])) < 1e-8  # less than a millionth of what it would be
    assert np.ptp(got[20:, Y]) < 1e-18
    assert np.max(np.abs(got[20:, RATE])) < 1e-15
    assert np.max(np.abs(got[20:, ACCELERATION])) < 1e-11
    loose = run_b(np.full(500, 1.2 / 0.95 * stuck), damper=STILL, table_effects=TableEffects(friction=1.0))
    assert loose[-1, Y] > 0.0
    assert abs(loose[-1, RATE]) < 1e-12


@pytest.mark.parametrize("oil", [math.inf, 25.0])
def test_table_friction_loses_its_force_times_the_way(oil: float) -> None:
    friction, frequency, omega = 0.3, 2.0, 2.0 * math.pi * 15.0
    t = np.arange(1, 8001) * SHORT
    command = 0.02 * np.sin(2.0 * np.pi * frequency * t)
    table = ShakingTable(delay=0.0)
    more = TableEffects(friction=friction, oil_frequency=oil)
    lab = table_lab.build(SHORT, table, STILL, more)
    place, rate = (
        (table_lab.TABLE, table_lab.TABLE_RATE) if math.isinf(oil) else (table_lab.BASE, table_lab.BASE_RATE)
    )
    states = []
    for value in command.tolist():
        table_lab.advance(lab, value, 0.0)
        states.append((lab.state[place], lab.state[rate]))
    y, v = np.array(states).T
    last = slice(-round(1.0 / (frequency * SHORT)) - 1, None)
    drive = trapezoid((omega**2 * (command - y))[last], y[last])
    viscous = trapezoid((1.4 * omega * v**2)[last], t[last])
    assert drive - viscous == pytest.approx(2.0 * friction * np.ptp(y[last]), rel=0.01)


def test_table_friction_falls_off_with_its_velocity() -> None:
    more = TableEffects(friction=0.5, friction_velocity=0.05)
    omega, ramp = 2.0 * math.pi * 15.0, 0.02 * DT * np.arange(1, 1001)
    got = run_b(ramp, table=ShakingTable(delay=0.0), damper=STILL, table_effects=more)
    # steady: ω²(u − y) = 2ζω·v + a·tanh(v/v0)
    behind = (1.4 * omega * 0.02 + 0.5 * math.tanh(0.02 / 0.05)) / omega**2
    assert ramp[-1] - got[-1, Y] == pytest.approx(behind, rel=1e-6)


def test_table_friction_by_direction_and_speed() -> None:
    omega, speed = 2.0 * math.pi * 15.0, 0.02
    more = TableEffects(friction=0.5, friction_asymmetry=0.2, friction_drop=0.4, friction_speed=0.01)
    for way, share in ((1.0, 1.2), (-1.0, 0.8)):
        ramp = way * speed * DT * np.arange(1, 1001)
        got = run_b(ramp, table=ShakingTable(delay=0.0), damper=STILL, table_effects=more)
        rubbing = 0.5 * share * (1.0 - 0.4 * (1.0 - math.exp(-speed / 0.01)))
        behind = (1.4 * omega * speed + rubbing) / omega**2
        assert way * (ramp[-1] - got[-1, Y]) == pytest.approx(behind, rel=1e-6)


def test_a_law_of_the_tables_motion_brakes_it() -> None:
    """One that says a spring does what a stiffer servo loop with a smaller gain would: ω²·(u − y) − s·y."""
    omega, spring = 2.0 * math.pi * 15.0, 900.0
    grid = preisach.pack(preisach.Grid((0.0,), (), ()), 0.02, 1.0)
    weights = np.zeros(preisach.count(grid))
    weights[0] = spring * 0.02  # of the play without width, which is the place over the reach
    more = TableEffects(learned=tuple(np.concatenate([grid, weights]).tolist()))
    command = tones(800, size=5e-3)
    got = run_b(command, table=ShakingTable(delay=0.0), damper=STILL, table_effects=more)
    stiff = math.sqrt(omega**2 + spring)
    table = ShakingTable(frequency=stiff / (2.0 * math.pi), damping_ratio=0.7 * omega / stiff, delay=0.0)
    expected = run_b(omega**2 / stiff**2 * command, table=table, damper=STILL)
    for signal in (Y, ACCELERATION):
        assert np.std(got[:, signal] - expected[:, signal]) < 0.01 * np.std(expected[:, signal])


@pytest.mark.parametrize(
    ("name", "effects"),
    [
        ("compliance", TableEffects(compliance=1e-6)),
        ("friction", TableEffects(friction=0.1)),
        ("oil_frequency", TableEffects(oil_frequency=25.0)),
        ("learned", TableEffects(learned=(0.0,) * 16)),
    ],
)
def test_an_ideal_table_refuses_what_it_cannot_have(name: str, effects: TableEffects) -> None:
    with pytest.raises(InputError, match=r"ideal table .*cannot have the effect") as caught:
        table_lab.build(DT, ShakingTable(frequency=math.inf, delay=0.0), Damper(), effects)
    assert name in str(caught.value)
    assert str(caught.value).count("\n") == 0


def test_an_ideal_table_may_have_gain_and_play() -> None:
    command = there_and_back(0.02, 0.01, 500)
    table = ShakingTable(frequency=math.inf, delay=0.0)
    got = run_b(command, table=table, damper=STILL, table_effects=TableEffects(gain=1.1, backlash=1e-3))[:, Y]
    assert got[498] == pytest.approx(1.1 * 0.02 - 0.5e-3)
    assert got[-1] == pytest.approx(1.1 * 0.01 + 0.5e-3)


# ---------------------------------------------------------------- the damper


def released(
    damper: Damper, effects: DamperEffects, seconds: float, stroke: float = 0.0, rate: float = 0.0
) -> Array:
    """Stroke, its velocity and the force of a damper let go on a standing table, at every tick."""
    lab = table_lab.build(DT, ShakingTable(), damper, None, effects)
    lab.state[table_lab.STROKE], lab.state[table_lab.STROKE_RATE] = stroke, rate
    rows = []
    for _ in range(round(seconds / DT)):
        _, _, s, force = table_lab.advance(lab, 0.0, 0.0)
        rows.append((s, lab.state[table_lab.STROKE_RATE], force))
    return np.array(rows)


def peaks(stroke: Array) -> Array:
    """Turning points, by parabolas through three ticks."""
    a, b, c = stroke[:-2], stroke[1:-1], stroke[2:]
    place = np.flatnonzero(((b - a) * (c - b) < 0.0) & (np.abs(b) > 0.0))
    curve = a[place] - 2.0 * b[place] + c[place]
    result: Array = b[place] - (c[place] - a[place]) ** 2 / (8.0 * curve)
    return result


@given(friction=st.floats(0.3, 3.0), spring=st.sampled_from([56.8, 500.0, 2000.0]))
@settings(max_examples=12)
def test_the_rubbing_damper_decays_on_a_straight_line_and_rests(friction: float, spring: float) -> None:
    damper = Damper(mass=16.0, stiffness=spring, damping=0.0)
    zone = friction / spring
    start = 9.3 * zone
    period = 2.0 * math.pi * math.sqrt(16.0 / spring)
    got = released(damper, DamperEffects(friction=friction), 6.0 * period, stroke=start)
    found = peaks(got[:, 0])
    expected = np.array([start - 2.0 * zone * half for half in (1, 2, 3, 4)]) * [-1.0, 1.0, -1.0, 1.0]
    assert np.allclose(found[:4], expected, atol=0.02 * zone)
    # within the dead zone ±F/k it rests: not one turn more, no creep, and no force that moves anything
    late = got[round(3.2 * period / DT) :]
    assert np.max(np.abs(late[:, 0])) <= zone
    assert np.ptp(late[:, 0]) < 1e-12 * start
    assert np.max(np.abs(late[:, 1])) < 1e-12
    assert np.max(np.abs(late[:, 2])) < 1e-9


@pytest.mark.parametrize("push", [0.9, -0.9, 1.1])
def test_the_rubbing_damper_sticks_below_its_friction(push: float) -> None:
    got = run_b(np.zeros(500), np.full(500, push * 3.0), damper_effects=DamperEffects(friction=3.0))
    if abs(push) < 1.0:
        assert np.max(np.abs(got[:, STROKE])) < 1e-8
        assert np.ptp(got[60:, STROKE]) < 1e-15
        assert np.max(np.abs(got[60:, FORCE])) < 1e-6
    else:
        assert got[-1, STROKE] > 1e-3


def test_the_rubbing_damper_loses_its_force_times_the_way() -> None:
    frequency, friction = 2.0, 3.0
    t = np.arange(1, 3001) * DT
    motor = 60.0 * np.sin(2.0 * np.pi * frequency * t)
    damper = Damper(damping=60.0)  # so that the free vibration is over in time
    got = run_b(np.zeros(t.size), motor, damper=damper, damper_effects=DamperEffects(friction=friction))
    last = slice(-round(1.0 / (frequency * DT)) - 1, None)
    stroke, rate, force = got[last, STROKE], got[last, STROKE_RATE], got[last, FORCE]
    lagged = phasor(motor, t, frequency, 4.0) / (1.0 + 2j * np.pi * frequency * 0.003)
    # the motor's command is held from the interval's beginning to its end, where the rows are
    lagged *= np.exp(1j * np.pi * frequency * DT) * np.sinc(frequency * DT)
    work = math.pi * (phasor(stroke, t[last], frequency, 0.0).conjugate() * lagged).imag
    viscous = 60.0 * trapezoid(rate**2, t[last])
    assert abs(work) - viscous == pytest.approx(2.0 * friction * np.ptp(stroke), rel=0.03)
    # without motor and inertia the rail would be all of the force: m·s̈ + F = 0 whatever F is made of
    assert np.max(np.abs(16.0 * np.gradient(rate, DT)[5:-5] + force[5:-5])) < 0.1 * np.max(np.abs(force))


def test_friction_that_falls_off_slowly_damps_like_a_dashpot_at_small_speed() -> None:
    damper = Damper(mass=16.0, stiffness=500.0, damping=0.0)
    more = DamperEffects(friction=2.0, friction_velocity=0.05)
    start, period = 1e-4, 2.0 * math.pi * math.sqrt(16.0 / 500.0)
    found = peaks(released(damper, more, 4.0 * period, stroke=start)[:, 0])
    dashpot = 2.0 / 0.05  # F·tanh(v/v0) ≈ F/v0·v
    ratio = dashpot / (2.0 * math.sqrt(500.0 * 16.0))
    decrement = math.log(found[1] / found[3])
    assert decrement == pytest.approx(2.0 * math.pi * ratio / math.sqrt(1.0 - ratio**2), rel=0.01)


@pytest.mark.parametrize("limit", [35.0, 20.0])
def test_the_motors_force_is_limited(limit: float) -> None:
    """A damper without spring and dashpot, and no motor lag: its force is the motor's, the other way."""
    bare = Damper(mass=16.0, stiffness=0.0, damping=0.0, motor_time_constant=0.0)
    motor = tones(500, size=30.0)
    more = DamperEffects(force_limit=limit, gain=1.07)
    got = run_b(np.zeros(500), motor, damper=bare, damper_effects=more)
    assert np.allclose(got[:, FORCE], -np.clip(1.07 * motor, -limit, limit), atol=1e-12)


def test_the_motors_lag_is_of_first_order() -> None:
    plan = lay(System(Plan()), [("damper.motor_lag", {"time_constant": 0.008})]).plan
    damper = dataclasses.replace(plan.damper, stiffness=0.0, damping=0.0)
    got = run_b(np.zeros(60), np.full(60, 30.0), damper=damper)[:, FORCE]
    t = DT * np.arange(1, 61)
    assert np.allclose(got, -30.0 * (1.0 - np.exp(-t / 0.011)), atol=1e-9)


@given(force=st.floats(-50.0, 50.0))
@settings(max_examples=10)
def test_a_constant_force_moves_the_damper_by_its_statics(force: float) -> None:
    damper = Damper(damping=60.0)
    got = run_b(np.zeros(6000), damper=damper, damper_effects=DamperEffects(offset=force))
    assert got[-1, STROKE] == pytest.approx(force / 56.8, rel=1e-4, abs=1e-9)
    assert abs(got[-1, FORCE]) < 1e-4 * abs(force) + 1e-9  # nothing is accelerated any more
    assert got[0, FORCE] == pytest.approx(-force, rel=0.01, abs=1e-9)  # at first all of it is
    # on a table that yields to it too, it is what a motor without lag would give
    quick, table = Damper(motor_time_constant=0.0), TableEffects(compliance=2.5e-5)
    driven = run_b(np.zeros(200), np.full(200, force), damper=quick, table_effects=table)
    more = DamperEffects(offset=force)
    pushed = run_b(np.zeros(200), damper=quick, table_effects=table, damper_effects=more)
    assert np.allclose(pushed, driven, rtol=1e-12, atol=1e-12)


FREE = Damper(mass=16.0, stiffness=0.0, damping=0.0)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("stiffness", "tolerance"), [(500.0, 0.005), (2000.0, 0.005), (20000.0, 0.016)])
def test_the_end_stop_is_an_elastic_spring(stiffness: float, tolerance: float, direction: float) -> None:
    stop, speed = 0.02, 0.5 * direction
    more = DamperEffects(stop_stroke=stop, stop_stiffness=stiffness)
    got = released(FREE, more, 0.08 + math.pi * math.sqrt(16.0 / stiffness), rate=speed)
    natural = math.sqrt(stiffness / 16.0)
    stroke, rate, force = got.T
    assert rate[-1] == pytest.approx(-speed, rel=tolerance)  # half of it in energy: tolerance·2
    assert np.max(np.abs(stroke)) == pytest.approx(stop + abs(speed) / natural, rel=5e-3)
    assert direction * force[np.argmax(np.abs(force))] == pytest.approx(
        abs(speed) * math.sqrt(stiffness * 16.0), rel=0.02
    )
    inside = np.abs(stroke) < stop - 2e-3
    assert not force[inside].any()
    beyond = np.maximum(np.abs(stroke) - stop, 0.0)
    # the force is held over a short step, in which the stroke moves on by as much as speed·0.25 ms
    assert np.max(np.abs(np.abs(force) - stiffness * beyond)) < stiffness * abs(speed) * SHORT * 1.01


@pytest.mark.parametrize(
    "stiffness",
    [2000.0, 20000.0],
)
def test_a_damper_that_bounces_solves_its_equation(stiffness: float) -> None:
    stop, start = 0.03, 0.05
    damper = Damper(mass=16.0, stiffness=56.8, damping=6.0)
    more = DamperEffects(stop_stroke=stop, stop_stiffness=stiffness)

    def slope(_: float, z: Array) -> list[float]:
        beyond = z[0] - np.clip(z[0], -stop, stop)
        return [z[1], (-56.8 * z[0] - 6.0 * z[1] - stiffness * beyond) / 16.0]

    got = released(damper, more, 0.8, stroke=0.0, rate=0.4)
    times = DT * np.arange(1, got.shape[0] + 1)
    exact = solve_ivp(slope, (0, times[-1]), [0.0, 0.4], t_eval=times, max_step=1e-3, rtol=1e-9, atol=1e-12).y
    assert np.max(np.abs(exact[0])) > stop
    assert np.max(np.abs(got[:, 0] - exact[0])) < 0.02 * start
    assert np.max(np.abs(got[:, 1] - exact[1])) < 0.02 * 0.4


ALL_TABLE = TableEffects(
    gain=1.05, oil_frequency=16.0, oil_damping=0.1, compliance=6e-6, backlash=4e-4, friction=0.1
)
ALL_DAMPER = DamperEffects(
    gain=0.93, friction=3.0, offset=2.0, force_limit=35.0, stop_stroke=0.03, stop_stiffness=2000.0
)


@pytest.mark.parametrize("table_effects", [TableEffects(), ALL_TABLE], ids=["plain", "everything"])
@pytest.mark.parametrize(
    "damper_effects",
    [
        DamperEffects(friction=3.0),
        DamperEffects(stop_stroke=0.02, stop_stiffness=20000.0),
        DamperEffects(force_limit=20.0, gain=1.1),
        ALL_DAMPER,
    ],
    ids=["friction", "stop", "motor", "everything"],
)
def test_the_force_balances_the_motion_with_every_effect(
    table_effects: TableEffects, damper_effects: DamperEffects
) -> None:
    """m·Δ(ṡ + ẏ) = −∫F dt over any stretch: what the damper gains in momentum the table's reading says."""
    t = np.arange(1, 8001) * SHORT
    command, motor = 0.01 * np.sin(12.0 * t), 60.0 * np.sin(12.5 * t + 1.0)
    table = ShakingTable(delay=0.0)
    got = run_b(command, motor, table, Damper(), table_effects, damper_effects, interval=SHORT)
    if math.isfinite(damper_effects.stop_stroke):
        assert np.max(np.abs(got[:, STROKE])) > damper_effects.stop_stroke
    momentum = 16.0 * (got[:, RATE] + got[:, STROKE_RATE])
    gained = -np.cumsum(0.5 * (got[1:, FORCE] + got[:-1, FORCE])) * SHORT
    error = momentum[1:] - momentum[0] - gained
    assert np.max(np.abs(error)) < 0.005 * np.max(np.abs(momentum))


def test_the_platform_s_reading_of_acceleration_is_its_velocitys_slope() -> None:
    t = np.arange(1, 4001) * SHORT
    command = 0.01 * np.sin(12.0 * t)
    got = run_b(
        command,
        table=ShakingTable(delay=0.0),
        table_effects=ALL_TABLE,
        damper_effects=ALL_DAMPER,
        interval=SHORT,
    )
    change = np.cumsum(0.5 * (got[1:, ACCELERATION] + got[:-1, ACCELERATION])) * SHORT
    assert np.max(np.abs(got[1:, RATE] - got[0, RATE] - change)) < 0.003 * np.max(np.abs(got[:, RATE]))


# ---------------------------------------------------------------- building and ground


def test_gravity_on_the_drift_is_a_change_of_stiffness(plan: Plan) -> None:
    gravity = -1.5e6
    leaning = lay(System(plan), [("structure.p_delta", {"stiffness": gravity})])
    # three of four columns are numerical, so their share of the storey's stiffness changes by all of it
    softer = System(plan).moved("structure", stiffness=(25e6 + gravity / 0.75,))
    left, right = everything(rollout(leaning, None)), everything(rollout(softer, None))
    assert np.allclose(left, right, rtol=1e-9, atol=1e-9 * np.max(np.abs(right), axis=0))
    assert not np.allclose(left, everything(rollout(System(plan), None)), rtol=1e-3)


def test_gravity_acts_in_every_storey(plan: Plan) -> None:
    tables = {"mass": (1.6e5,) * 3, "stiffness": (9e7, 8e7, 6e7), "damping": (4e5,) * 3}
    tall = System(plan).moved("structure", **tables).moved("column", storey=2, stiffness=40e6)
    leaning = lay(tall, [("structure.p_delta", {"stiffness": -4e6})])
    softer = tall.moved("structure", stiffness=(9e7 - 4e6, 8e7 - 4e6 / 0.75, 6e7 - 4e6))
    left, right = everything(rollout(leaning, None)), everything(rollout(softer, None))
    assert np.allclose(left, right, rtol=1e-9, atol=1e-9 * np.max(np.abs(right), axis=0))


@pytest.mark.parametrize("ticks", [5, -5, 25])
def test_a_motion_that_comes_whole_ticks_later_moves_everything_alike(plan: Plan, ticks: int) -> None:
    later = lay(System(plan), [("ground.time_shift", {"shift": ticks * DT})])
    shifted, plain = rollout(later, None), rollout(System(plan), None)
    motion = substructure.ground_rows(later.plan, substructure.motion(later.plan), ticks * DT)
    straight = substructure.ground_rows(plan, substructure.motion(plan))
    if ticks > 0:
        assert np.allclose(motion[:, ticks:], straight[:, :-ticks], atol=1e-12)
        assert not motion[:, :ticks].any()
        assert not shifted.master["table_target"][: ticks - 1].any()
        for name in ("displacement", "column_force", "table_displacement", "damper_force"):
            before, after = signals(plan, plain)[name], signals(plan, shifted)[name]
            assert np.allclose(after[ticks:], before[:-ticks], atol=1e-9 * np.max(np.abs(before))), name
    else:
        assert np.allclose(motion[:, :ticks], straight[:, -ticks:], atol=1e-12)


@given(shift=st.floats(-30.0, 30.0))
def test_a_shifted_ground_moves_on_straight_lines(shift: float) -> None:
    t = np.arange(200.0)
    rows = np.stack([np.sin(0.05 * t), t])
    found = substructure.shifted(rows, shift)
    assert np.allclose(found[1], np.clip(t - shift, 0.0, 199.0), atol=1e-9)
    inside = (t - shift >= 0.0) & (t - shift <= 199.0)
    assert np.allclose(found[0][inside], np.sin(0.05 * (t - shift))[inside], atol=0.05**2 / 8 + 1e-9)


def test_friction_work_by_quadrature_agrees_with_the_loop_under_falling_friction() -> None:
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
