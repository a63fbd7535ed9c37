"""Effects of the active mass damper against closed forms, energy balances and other solvers."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp, trapezoid
from scipy.optimize import brentq

from common.plan.laboratory_tables import Damper, ShakingTable
from common.plan.plan import Plan
from laboratories.effects import lay
from laboratories.table import linear
from laboratories.table import model as table_lab
from models.system import DamperEffects, System, TableEffects
from tests.laboratories.effects.histories import (
    ACCELERATION,
    DT,
    FORCE,
    RATE,
    SHORT,
    STROKE,
    STROKE_RATE,
    Array,
    phasor,
    run_b,
    tones,
)


def released(
    damper: Damper, effects: DamperEffects, seconds: float, stroke: float = 0.0, rate: float = 0.0
) -> Array:
    """Stroke, its velocity and the force of a damper let go on a standing table, at every tick."""
    lab = table_lab.build(DT, ShakingTable(), damper, None, effects)
    lab.state[linear.STROKE], lab.state[linear.STROKE_RATE] = stroke, rate
    rows = []
    for _ in range(round(seconds / DT)):
        _, _, s, force = table_lab.advance(lab, 0.0, 0.0)
        rows.append((s, lab.state[linear.STROKE_RATE], force))
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
def test_a_damper_with_friction_decays_linearly_and_comes_to_rest(friction: float, spring: float) -> None:
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
def test_a_damper_sticks_below_its_friction(push: float) -> None:
    got = run_b(np.zeros(500), np.full(500, push * 3.0), damper_effects=DamperEffects(friction=3.0))
    if abs(push) < 1.0:
        assert np.max(np.abs(got[:, STROKE])) < 1e-8
        assert np.ptp(got[60:, STROKE]) < 1e-15
        assert np.max(np.abs(got[60:, FORCE])) < 1e-6
    else:
        assert got[-1, STROKE] > 1e-3


def test_a_dampers_friction_dissipates_force_times_distance() -> None:
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


def test_smoothed_friction_acts_like_a_dashpot_at_small_speed() -> None:
    damper = Damper(mass=16.0, stiffness=500.0, damping=0.0)
    more = DamperEffects(friction=2.0, friction_velocity=0.05)
    start, period = 1e-4, 2.0 * math.pi * math.sqrt(16.0 / 500.0)
    found = peaks(released(damper, more, 4.0 * period, stroke=start)[:, 0])
    dashpot = 2.0 / 0.05  # F·tanh(v/v0) ≈ F/v0·v
    ratio = dashpot / (2.0 * math.sqrt(500.0 * 16.0))
    decrement = math.log(found[1] / found[3])
    assert decrement == pytest.approx(2.0 * math.pi * ratio / math.sqrt(1.0 - ratio**2), rel=0.01)


RESTING = Damper(
    mass=1e7, stiffness=0.0, damping=0.0, motor_time_constant=0.0
)  # while the table moves under it


def test_a_rail_with_presliding_follows_dahls_loop() -> None:
    """Over half a cycle from one turn to the next: F·(1 − (1 + tanh(A/s₀))·exp(−x/s₀)), A the amplitude."""
    friction, presliding, amplitude, frequency = 3.0, 2e-3, 4e-3, 2.0
    t = np.arange(1, 8001) * SHORT
    motion = amplitude * np.sin(2.0 * np.pi * frequency * t)
    more = DamperEffects(friction=friction, presliding=presliding)
    table = ShakingTable(delay=0.0, frequency=2000.0)  # follows its command
    got = run_b(motion, table=table, damper=RESTING, damper_effects=more, interval=SHORT)
    last = got[-round(1.0 / (frequency * SHORT)) :]
    stroke, force = last[:, STROKE], last[:, FORCE]
    low, high = int(np.argmin(stroke)), int(np.argmax(stroke))
    way = np.arange(low, high + (stroke.size if high < low else 0)) % stroke.size
    x = stroke[way] - stroke[low]
    height = np.tanh(0.5 * (stroke[high] - stroke[low]) / presliding)
    expected = friction * (1.0 - (1.0 + height) * np.exp(-x / presliding))
    assert np.max(np.abs(force[way] - expected)) < 0.01 * friction


@pytest.mark.parametrize("share", [0.5, -0.9])
def test_a_rail_with_presliding_gives_way_under_a_push_below_its_friction(share: float) -> None:
    """At rest its bristles carry the push: s = −s₀·ln(1 − |push|/F)."""
    friction, presliding = 3.0, 1e-4
    damper = Damper(stiffness=0.0, damping=3000.0)  # so slow that it does not swing over
    more = DamperEffects(friction=friction, presliding=presliding)
    push = np.full(4000, share * friction)
    got = run_b(np.zeros(push.size), push, damper=damper, damper_effects=more)
    bent = -presliding * math.log(1.0 - abs(share))
    assert got[-1, STROKE] == pytest.approx(math.copysign(bent, share), rel=0.01)
    assert abs(got[-1, FORCE]) < 1e-3 * friction


def test_friction_with_stiff_bristles_becomes_coulombs() -> None:
    motor = tones(2000, size=20.0)
    sticking = run_b(np.zeros(2000), motor, damper_effects=DamperEffects(friction=3.0))
    bristled = run_b(np.zeros(2000), motor, damper_effects=DamperEffects(friction=3.0, presliding=1e-9))
    # dry friction has shorter segments at its jumps
    assert np.max(np.abs(bristled - sticking)[:, STROKE]) < 1e-3 * np.max(np.abs(sticking[:, STROKE]))
    sides = DamperEffects(friction=3.0, friction_asymmetry=0.2, presliding=1e-4)
    push = np.full(200, 60.0)
    rubbing = run_b(np.zeros(200), push, damper_effects=sides)[100:, STROKE_RATE]
    braked = run_b(np.zeros(200), push, damper_effects=DamperEffects(offset=-3.6))[100:, STROKE_RATE]
    assert rubbing[-1] - rubbing[0] == pytest.approx(braked[-1] - braked[0], rel=1e-3)


@pytest.mark.parametrize("limit", [35.0, 20.0])
def test_the_motors_force_is_limited(limit: float) -> None:
    """A damper without spring and dashpot, and no motor lag: its force is the motor's, the other way."""
    bare = Damper(mass=16.0, stiffness=0.0, damping=0.0, motor_time_constant=0.0)
    motor = tones(500, size=30.0)
    more = DamperEffects(force_limit=limit, gain=1.07)
    got = run_b(np.zeros(500), motor, damper=bare, damper_effects=more)
    assert np.allclose(got[:, FORCE], -np.clip(1.07 * motor, -limit, limit), atol=1e-12)


def test_the_motors_lag_is_first_order() -> None:
    plan = lay(System(Plan()), [("damper.motor_lag", {"time_constant": 0.008})]).plan
    damper = dataclasses.replace(plan.damper, stiffness=0.0, damping=0.0)
    got = run_b(np.zeros(60), np.full(60, 30.0), damper=damper)[:, FORCE]
    t = DT * np.arange(1, 61)
    assert np.allclose(got, -30.0 * (1.0 - np.exp(-t / 0.011)), atol=1e-9)


@pytest.mark.parametrize("zeta", [0.3, 0.8])
def test_the_motors_lag_is_second_order_under_its_second_law(zeta: float) -> None:
    values = {"time_constant": 0.008, "law": 1.0, "damping": zeta}
    system = lay(System(Plan()), [("damper.motor_lag", values)])
    damper = dataclasses.replace(system.plan.damper, stiffness=0.0, damping=0.0)
    got = run_b(np.zeros(60), np.full(60, 30.0), damper=damper, damper_effects=system.effects.damper)
    t, omega = DT * np.arange(1, 61), 2.0 * zeta / 0.011
    turned = omega * math.sqrt(1.0 - zeta**2)
    step = 1.0 - np.exp(-zeta * omega * t) * (np.cos(turned * t) + zeta * omega / turned * np.sin(turned * t))
    assert np.allclose(got[:, FORCE], -30.0 * step, atol=1e-9)
    # on an ideal table too, and not where nothing is added to the plan's motor
    ideal = run_b(
        np.zeros(60), np.full(60, 30.0), ShakingTable(frequency=math.inf), damper, None, system.effects.damper
    )
    assert np.allclose(ideal[:, FORCE], got[:, FORCE], atol=1e-9)
    assert lay(System(Plan()), [("damper.motor_lag", values | {"time_constant": 0.0})]) == System(Plan())


FREE = Damper(mass=16.0, stiffness=0.0, damping=0.0)


def test_a_dashpot_that_is_stronger_in_one_direction_has_two_final_speeds() -> None:
    damper = Damper(mass=16.0, stiffness=0.0, damping=100.0)
    for push, expected in ((30.0, 30.0 / 130.0), (-30.0, -30.0 / 70.0)):
        got = run_b(
            np.zeros(2000), np.full(2000, push), damper=damper, damper_effects=DamperEffects(asymmetry=0.3)
        )
        assert got[-1, STROKE_RATE] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("play", [0.0, 4e-4])
def test_two_masses_with_a_coupling_move_as_another_solver_says(play: float) -> None:
    """On a table that moves, with spring and dashpot, so that all forces act on both masses as they should."""
    share, frequency, damping, pace = 0.3, 6.0, 0.1, 2.0 * math.pi * 3.0
    damper = Damper(mass=16.0, stiffness=900.0, damping=20.0, motor_time_constant=0.0)
    first, second = (1.0 - share) * 16.0, share * 16.0
    omega = 2.0 * math.pi * frequency

    def coupled(x: Array) -> float:
        ahead = x[2] - x[0]
        bent = ahead - min(max(ahead, -0.5 * play), 0.5 * play)
        force = second * (omega**2 * bent + 2.0 * damping * omega * (x[3] - x[1]))
        if play == 0.0:
            return force
        return 0.0 if bent == 0.0 else max(force, 0.0) if bent > 0.0 else min(force, 0.0)

    def rates(t: float, x: Array) -> list[float]:  # stroke, rate, of both masses over the table
        ground, force = -2.0 * (pace**2) * 1e-3 * math.sin(pace * t), coupled(x)
        push = 15.0 * math.sin(1.7 * pace * t)
        on_first = push - 900.0 * x[0] - 20.0 * x[1] + force
        return [x[1], on_first / first - ground, x[3], -force / second - ground]

    t = np.arange(1, 8001) * SHORT
    table = ShakingTable(delay=0.0, frequency=2000.0)
    got = run_b(
        2e-3 * np.sin(pace * t),
        15.0 * np.sin(1.7 * pace * (t - 0.5 * SHORT)),
        table=table,
        damper=damper,
        interval=SHORT,
        damper_effects=DamperEffects(
            second_mass=share, second_frequency=frequency, second_damping=damping, second_play=play
        ),
    )
    start = [0.0, -2e-3 * pace, 0.0, -2e-3 * pace]  # at rest in space
    found = solve_ivp(rates, (0.0, t[-1]), start, t_eval=t, max_step=2e-4, rtol=1e-9, atol=1e-12)
    assert np.max(np.abs(got[:, STROKE] - found.y[0])) < 5e-3 * np.max(np.abs(found.y[0]))
    rigid = run_b(
        2e-3 * np.sin(pace * t), 15.0 * np.sin(1.7 * pace * t), table=table, damper=damper, interval=SHORT
    )
    assert np.max(np.abs(rigid[:, STROKE] - found.y[0])) > 0.05 * np.max(np.abs(found.y[0]))
    force = 900.0 * found.y[0] + 20.0 * found.y[1] - 15.0 * np.sin(1.7 * pace * t)
    assert np.max(np.abs(got[200:, FORCE] - force[200:])) < 0.02 * np.max(np.abs(force))


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("stiffness", "tolerance"), [(500.0, 0.005), (2000.0, 0.005), (20000.0, 0.016)])
def test_the_end_stop_acts_as_an_elastic_spring(stiffness: float, tolerance: float, direction: float) -> None:
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


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("exponent", "damping"), [(1.5, 0.0), (1.5, 1.0), (1.2, 0.3), (1.0, 2.0)])
def test_the_contact_of_hunt_and_crossley_goes_as_deep_and_returns_as_slowly_as_it_must(
    exponent: float, damping: float, direction: float
) -> None:
    """From m·v·dv/dd = −K·d·(d/d₀)^(n−1)·(1 + λ·v): G(v) = v/λ − ln(1 + λ·v)/λ² is the same before and after."""
    speed, stiffness, stop = 0.5, 2000.0, 0.02

    def energy(v: float) -> float:
        return v / damping - math.log1p(damping * v) / damping**2 if damping else 0.5 * v**2

    away = brentq(lambda v: energy(-v) - energy(speed), 0.0, min(speed, 0.999 / (damping or 1.0)))
    work = 16.0 * energy(speed) * (exponent + 1.0) * 1e-3 ** (exponent - 1.0) / stiffness
    more = DamperEffects(
        stop_stroke=stop, stop_stiffness=stiffness, stop_exponent=exponent, stop_damping=damping
    )
    got = released(FREE, more, 0.5, rate=speed * direction)
    assert np.max(np.abs(got[:, 0])) == pytest.approx(stop + work ** (1.0 / (exponent + 1.0)), rel=5e-3)
    left = np.flatnonzero((np.abs(got[:, 0]) < stop - 2e-3) & (got[:, 1] * direction < 0.0))
    assert got[left[0], 1] == pytest.approx(-away * direction, rel=0.01)
    pushed = got[:, 2] * np.sign(got[:, 0])
    assert np.min(pushed) >= 0.0


@pytest.mark.parametrize(
    "stiffness",
    [2000.0, 20000.0],
)
def test_a_damper_that_hits_its_end_stop_solves_its_equation(stiffness: float) -> None:
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
    gain=1.05,
    feed_velocity=0.5,
    feed_acceleration=0.4,
    oil_frequency=16.0,
    oil_damping=0.1,
    second_frequency=5.0,
    compliance=6e-6,
    backlash=4e-4,
    friction=0.1,
)
ALL_DAMPER = DamperEffects(
    gain=0.93, friction=3.0, offset=2.0, force_limit=35.0, stop_stroke=0.03, stop_stiffness=2000.0
)


@pytest.mark.parametrize("table_effects", [TableEffects(), ALL_TABLE], ids=["plain", "everything"])
@pytest.mark.parametrize(
    "damper_effects",
    [
        DamperEffects(friction=3.0),
        DamperEffects(friction=3.0, presliding=1e-4),
        DamperEffects(stop_stroke=0.02, stop_stiffness=20000.0),
        DamperEffects(force_limit=20.0, gain=1.1),
        ALL_DAMPER,
    ],
    ids=["friction", "presliding", "stop", "motor", "everything"],
)
def test_the_dampers_force_balances_its_motion_with_every_effect(
    table_effects: TableEffects, damper_effects: DamperEffects
) -> None:
    """m·Δ(ṡ + ẏ) = −∫F dt over any stretch: what the damper gains in momentum the table's reading gives."""
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


def test_the_platforms_acceleration_reading_is_the_derivative_of_its_velocity() -> None:
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
