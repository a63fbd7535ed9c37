"""Effects of the shaking table against transfer functions, energy balances and other solvers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp, trapezoid
from scipy.optimize import brentq

from common.errors import InputError
from common.plan.laboratory_tables import Damper, ShakingTable
from laboratories.table import linear, transfer
from laboratories.table import model as table_lab
from models import preisach
from models.system import DamperEffects, TableEffects
from tests.laboratories.effects.histories import (
    ACCELERATION,
    DT,
    FORCE,
    RATE,
    SHORT,
    STROKE,
    Array,
    Y,
    phasor,
    ramped,
    run_b,
    there_and_back,
    tones,
)

STILL = Damper(mass=16.0, stiffness=0.0, damping=0.0)


def second_order(s: complex, frequency: float, damping: float) -> complex:
    omega = 2.0 * math.pi * frequency
    return omega**2 / (s**2 + 2.0 * damping * omega * s + omega**2)


def spectrum(s: complex, more: TableEffects) -> complex:
    """What the transfer function of the default table says at one frequency."""
    return complex(transfer.displacement(np.array([s]), DT, ShakingTable(), more)[0])


@pytest.mark.parametrize("frequency", [1.0, 5.0, 10.0, 15.625])
@pytest.mark.parametrize("gain", [1.0, 0.93])
@pytest.mark.parametrize(("oil", "damping"), [(math.inf, 0.1), (16.0, 0.1), (10.0, 0.03), (40.0, 0.3)])
def test_gain_and_oil_column_have_their_transfer_functions(
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


@pytest.mark.parametrize("frequency", [2.0, 9.0, 14.0])
@pytest.mark.parametrize(
    ("law", "share", "damping"), [(1.0, 0.06, 0.1), (1.0, 0.5, 0.1), (2.0, 1.0, 0.05), (2.0, 1.0, 0.3)]
)
def test_a_share_passes_through_the_oil_column_or_its_dashpot_moves_with_the_loop(
    frequency: float, law: float, share: float, damping: float
) -> None:
    t = np.arange(1, 4001) * DT
    command = 5e-3 * np.cos(2.0 * np.pi * frequency * t) * np.minimum(t, 1.0)
    more = TableEffects(oil_frequency=17.0, oil_damping=damping, oil_law=law, oil_share=share)
    got = run_b(command, damper=STILL, table_effects=more)
    s, lead = 2j * math.pi * frequency, 2j * damping * frequency / 17.0 if law == 2.0 else 0.0
    whole = 1.0 - share + share * (1.0 + lead) * second_order(s, 17.0, damping)
    expected = np.exp(-0.004 * s) * second_order(s, 15.0, 0.7) * whole * 5e-3 * np.sinc(frequency * DT) ** 2
    found = phasor(got[:, Y], t, frequency, 4.0)
    assert abs(found - expected) < 2e-3 * abs(expected)
    assert phasor(got[:, ACCELERATION], t, frequency, 4.0) == pytest.approx(s**2 * found, rel=2e-2)
    assert spectrum(s, more) == pytest.approx(expected / 5e-3, rel=1e-9)


@pytest.mark.parametrize("frequency", [2.0, 9.0, 14.0])
@pytest.mark.parametrize(("velocity", "acceleration", "lag"), [(0.9, 0.8, 2e-3), (-0.5, 0.0, 6e-3)])
@pytest.mark.parametrize("oil", [math.inf, 20.0])
def test_velocity_and_acceleration_fed_forward_have_their_transfer_function(
    frequency: float, velocity: float, acceleration: float, lag: float, oil: float
) -> None:
    t = np.arange(1, 4001) * DT
    command = 5e-3 * np.cos(2.0 * np.pi * frequency * t) * np.minimum(t, 1.0)
    more = TableEffects(
        feed_velocity=velocity, feed_acceleration=acceleration, feed_lag=lag, oil_frequency=oil
    )
    got = run_b(command, damper=STILL, table_effects=more)
    s, omega = 2j * math.pi * frequency, 2.0 * math.pi * 15.0
    back = np.exp(-s * DT)  # to the tick before
    left = math.exp(-DT / lag)  # what the filter keeps of a rate over an interval
    rate = (1.0 - left) * (1.0 - back) / DT / (1.0 - left * back)
    whole = 1.0 + velocity * 1.4 / omega * rate + acceleration / omega**2 * rate * (1.0 - back) / DT
    ramps = np.sinc(frequency * DT) ** 2
    expected = np.exp(-0.004 * s) * second_order(s, 15.0, 0.7) * whole * 5e-3 * ramps
    if not math.isinf(oil):
        expected *= second_order(s, oil, 0.1)
    found = phasor(got[:, Y], t, frequency, 4.0)
    assert abs(found - expected) < 2e-3 * abs(expected)
    assert phasor(got[:, ACCELERATION], t, frequency, 4.0) == pytest.approx(s**2 * found, rel=2e-2)


@pytest.mark.parametrize("frequency", [2.0, 4.0, 9.0])
@pytest.mark.parametrize("law", [0.0, 1.0, 2.0])
@pytest.mark.parametrize(("oil", "share"), [(math.inf, 1.0), (17.0, 1.0), (17.0, 0.2)])
def test_a_mass_that_swings_on_the_platform_pulls_at_its_loop(
    frequency: float, law: float, oil: float, share: float
) -> None:
    t = np.arange(1, 6001) * DT
    command = 5e-3 * np.cos(2.0 * np.pi * frequency * t) * np.minimum(t, 1.0)
    more = TableEffects(
        second_frequency=4.2,
        second_share=0.3,
        second_damping=0.05,
        second_law=law,
        oil_frequency=oil,
        oil_share=share,
    )
    got = run_b(command, damper=STILL, table_effects=more)
    s, omega, second = 2j * math.pi * frequency, 2.0 * math.pi * 15.0, 2.0 * math.pi * 4.2
    ahead = -(s**2) / (s**2 + 0.1 * second * s + second**2)  # of the mass, over the platform's motion
    spring = second**2 + 0.1 * second * s
    pull = {0.0: 0.3 * spring, 1.0: 0.3 / 0.7 * second**2 * s / omega, 2.0: 0.3 / 0.7 * spring}[law] * ahead
    platform = 1.0 - share + share * second_order(s, oil, 0.1) if math.isfinite(oil) else 1.0
    loop = (0.7 if law == 0.0 else 1.0) * s**2 + 1.4 * omega * s + omega**2
    expected = np.exp(-0.004 * s) * omega**2 * platform / (loop - pull * platform)
    expected *= 5e-3 * np.sinc(frequency * DT) ** 2
    found = phasor(got[:, Y], t, frequency, 8.0)
    assert abs(found - expected) < 2e-3 * abs(expected)
    assert phasor(got[:, ACCELERATION], t, frequency, 8.0) == pytest.approx(s**2 * found, rel=2e-2)
    assert spectrum(s, more) == pytest.approx(expected / 5e-3, rel=1e-9)


@pytest.mark.parametrize("sharpness", [math.inf, 3.0])
def test_a_table_whose_valve_saturates_follows_as_another_solver_says(sharpness: float) -> None:
    limit, omega, ratio, size, pace = 0.04, 2.0 * math.pi * 15.0, 0.7, 0.01, 2.0 * math.pi * 1.5

    def bent(speed: float) -> float:
        if math.isinf(sharpness):
            return min(max(speed, -limit), limit)
        return speed / (1.0 + abs(speed / limit) ** sharpness) ** (1.0 / sharpness)

    def rates(t: float, x: Array) -> list[float]:
        wanted = omega / (2.0 * ratio) * (size * math.sin(pace * t) - x[0])
        return [x[1], 2.0 * ratio * omega * (bent(wanted) - x[1])]

    t = np.arange(1, 6001) * SHORT
    table = ShakingTable(delay=0.0)
    more = TableEffects(velocity_limit=limit, velocity_limit_sharpness=sharpness)
    got = run_b(size * np.sin(pace * t), table=table, damper=STILL, table_effects=more, interval=SHORT)
    expected = solve_ivp(rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, max_step=1e-3, rtol=1e-8, atol=1e-12)
    assert (
        np.max(np.abs(expected.y[1])) > (0.99 if math.isinf(sharpness) else 0.8) * limit
    )  # it does saturate
    assert np.max(np.abs(got[:, Y] - expected.y[0])) < 2e-3 * np.max(np.abs(expected.y[0]))
    assert np.max(np.abs(got[:, RATE])) < 1.005 * limit


QUICK = ShakingTable(delay=0.0, frequency=2000.0)  # its loop follows the command


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_platform_with_play_behind_the_loop_bounces_off_its_flank(direction: float) -> None:
    """A spring and dashpot take it along by V·(1 + exp(−ζπ/√(1 − ζ²))), V the speed of the loop."""
    speed, half, frequency, damping = 0.1 * direction, 2e-3, 50.0, 0.2
    t = np.arange(1, 241) * SHORT
    more = TableEffects(
        backlash=2.0 * half, backlash_law=1.0, flank_frequency=frequency, flank_damping=damping
    )
    got = run_b(speed * t, table=QUICK, damper=STILL, table_effects=more, interval=SHORT)
    met = half / abs(speed)
    # the loop's velocity has a step at first, of which a short segment sees a part
    assert np.max(np.abs(got[t < met - 5e-4, Y])) < 5e-3 * half
    kept = math.exp(-damping * math.pi / math.sqrt(1.0 - damping**2))
    late = t > met + 0.5 / (frequency * math.sqrt(1.0 - damping**2)) + 1e-3
    np.testing.assert_allclose(got[late, RATE], speed * (1.0 + kept), rtol=0.02)
    assert np.max(np.abs(got[late, ACCELERATION])) < 5e-3 * 2.0 * math.pi * frequency * abs(speed)


def test_a_guide_drags_the_platform_along_inside_its_play() -> None:
    """ẏ = V·(1 − exp(−guide·t)) under a loop of constant speed V."""
    speed, guide = 0.05, 40.0
    t = np.arange(1, 201) * SHORT
    more = TableEffects(backlash=0.02, backlash_law=1.0, guide=guide)
    got = run_b(speed * t, table=QUICK, damper=STILL, table_effects=more, interval=SHORT)
    np.testing.assert_allclose(got[:, RATE], speed * -np.expm1(-guide * t), atol=0.02 * speed)


def test_a_play_of_nothing_behind_the_loop_leaves_the_resonance_of_its_flanks() -> None:
    drive, flanks, damping = 5.0, 20.0, 0.3
    t = np.arange(1, 8001) * SHORT
    more = TableEffects(backlash=1e-12, backlash_law=1.0, flank_frequency=flanks, flank_damping=damping)
    command = 5e-3 * np.sin(2.0 * np.pi * drive * t)
    got = run_b(command, table=QUICK, damper=STILL, table_effects=more, interval=SHORT)
    omega, s = 2.0 * math.pi * flanks, 2j * math.pi * drive
    passed = (2.0 * damping * omega * s + omega**2) / (s**2 + 2.0 * damping * omega * s + omega**2)
    expected = 5e-3 * passed * second_order(s, QUICK.frequency, QUICK.damping_ratio)
    late = t > 1.0
    wave = np.exp(s * t)
    assert np.max(np.abs(got[:, Y] - (expected * wave).imag)[late]) < 2e-3 * abs(expected)


@pytest.mark.parametrize("compliance", [6e-6, 2.5e-5])
def test_the_damper_moves_the_compliant_table_by_its_force_and_not_in_statics(compliance: float) -> None:
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


@pytest.mark.parametrize(("motor_lag", "damping"), [(0.003, math.inf), (0.0, math.inf), (0.02, 0.5)])
@pytest.mark.parametrize("oil", [math.inf, 16.0])
def test_the_payload_solves_the_coupled_equations(motor_lag: float, damping: float, oil: float) -> None:
    ticks, compliance = 300, 2.5e-5
    table, damper = ShakingTable(), Damper(motor_time_constant=motor_lag)
    command, motor = tones(ticks, size=5e-3), tones(ticks, seed=2, size=30.0)
    more = TableEffects(compliance=compliance, oil_frequency=oil, oil_damping=0.1)
    got = run_b(command, motor, table, damper, more, DamperEffects(motor_damping=damping))
    omega, swing = 2.0 * math.pi * 15.0, 2.0 * math.pi * oil
    reached = ramped(command, table.delay)

    def force(z: Array, push: float) -> float:
        return float(56.8 * z[2] + 6.0 * z[3] - (z[4] if motor_lag else push))

    def slope(t: float, z: Array, push: float) -> list[float]:
        y, rate, _, stroke_rate, lagged, platform, platform_rate, lagged_rate = z
        load = force(z, push)
        a = omega**2 * (reached(t) + compliance * load - y) - 1.4 * omega * rate
        felt = a
        if not math.isinf(oil):
            felt = swing**2 * (y - platform) - 0.2 * swing * platform_rate
        turning = (push - lagged) / motor_lag if motor_lag else 0.0
        bent = 0.0
        if math.isfinite(damping):
            turning, bent = (
                lagged_rate,
                (push - lagged - motor_lag * lagged_rate) * (2.0 * damping / motor_lag) ** 2,
            )
        return [rate, a, stroke_rate, -load / 16.0 - felt, turning, platform_rate, felt, bent]

    z, exact = np.zeros(8), []
    for tick, push in enumerate(motor):
        span = (tick * DT, (tick + 1) * DT)
        z = solve_ivp(slope, span, z, args=(push,), max_step=DT / 2, rtol=1e-9, atol=1e-13).y[:, -1]
        top = 0 if math.isinf(oil) else 5
        exact.append((z[top], slope(span[1], z, push)[1 if top == 0 else 6], z[2], force(z, push)))
    scale = np.max(np.abs(exact), axis=0)
    assert np.all(np.max(np.abs(got[:, :4] - exact), axis=0) < 1e-5 * scale)


def test_the_tables_dead_travel_equals_its_play() -> None:
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
def test_table_friction_dissipates_force_times_distance(oil: float) -> None:
    friction, frequency, omega = 0.3, 2.0, 2.0 * math.pi * 15.0
    t = np.arange(1, 8001) * SHORT
    command = 0.02 * np.sin(2.0 * np.pi * frequency * t)
    table = ShakingTable(delay=0.0)
    more = TableEffects(friction=friction, oil_frequency=oil)
    lab = table_lab.build(SHORT, table, STILL, more)
    place, rate = (linear.TABLE, linear.TABLE_RATE) if math.isinf(oil) else (linear.BASE, linear.BASE_RATE)
    states = []
    for value in command.tolist():
        table_lab.advance(lab, value, 0.0)
        states.append((lab.state[place], lab.state[rate]))
    y, v = np.array(states).T
    last = slice(-round(1.0 / (frequency * SHORT)) - 1, None)
    drive = trapezoid((omega**2 * (command - y))[last], y[last])
    viscous = trapezoid((1.4 * omega * v**2)[last], t[last])
    assert drive - viscous == pytest.approx(2.0 * friction * np.ptp(y[last]), rel=0.01)


def test_smoothed_table_friction_depends_on_the_velocity() -> None:
    more = TableEffects(friction=0.5, friction_velocity=0.05)
    omega, ramp = 2.0 * math.pi * 15.0, 0.02 * DT * np.arange(1, 1001)
    got = run_b(ramp, table=ShakingTable(delay=0.0), damper=STILL, table_effects=more)
    # steady: ω²(u − y) = 2ζω·v + a·tanh(v/v0)
    behind = (1.4 * omega * 0.02 + 0.5 * math.tanh(0.02 / 0.05)) / omega**2
    assert ramp[-1] - got[-1, Y] == pytest.approx(behind, rel=1e-6)


def test_table_friction_depends_on_direction_and_speed() -> None:
    omega, speed = 2.0 * math.pi * 15.0, 0.02
    more = TableEffects(friction=0.5, friction_asymmetry=0.2, friction_drop=0.4, friction_speed=0.01)
    for way, share in ((1.0, 1.2), (-1.0, 0.8)):
        ramp = way * speed * DT * np.arange(1, 1001)
        got = run_b(ramp, table=ShakingTable(delay=0.0), damper=STILL, table_effects=more)
        rubbing = 0.5 * share * (1.0 - 0.4 * (1.0 - math.exp(-speed / 0.01)))
        behind = (1.4 * omega * speed + rubbing) / omega**2
        assert way * (ramp[-1] - got[-1, Y]) == pytest.approx(behind, rel=1e-6)


@pytest.mark.parametrize("oil", [math.inf, 25.0])
@pytest.mark.parametrize("share", [0.5, -0.9])
def test_a_bearing_with_presliding_gives_way_below_its_friction(share: float, oil: float) -> None:
    """At rest its bristles carry what the loop pulls: ω²·(u − y) = ±F·(1 − exp(−|y|/s₀))."""
    omega, friction, presliding = 2.0 * math.pi * 15.0, 1.0, 1e-4
    command = share * friction / omega**2
    table = ShakingTable(delay=0.0, damping_ratio=5.0)  # so slow that it does not swing over
    more = TableEffects(friction=friction, presliding=presliding, oil_frequency=oil)
    got = run_b(np.full(2000, command), table=table, damper=STILL, table_effects=more)
    rest = brentq(
        lambda y: omega**2 * (abs(command) - y) - friction * (1.0 - math.exp(-y / presliding)), 0.0, 1.0
    )
    assert got[-1, Y] == pytest.approx(math.copysign(rest, share), rel=0.01)


def test_a_bearing_with_stiff_bristles_sticks_and_slides_as_coulombs_friction_does() -> None:
    command = tones(2000, size=2e-3)
    sticking = run_b(command, damper=STILL, table_effects=TableEffects(friction=0.5))
    bristled = run_b(command, damper=STILL, table_effects=TableEffects(friction=0.5, presliding=1e-9))
    # dry friction has shorter segments at its jumps
    assert np.max(np.abs(bristled - sticking)[:, Y]) < 1e-3 * np.max(np.abs(sticking[:, Y]))
    loose = run_b(command, damper=STILL, table_effects=TableEffects(friction=0.5, presliding=1e-3))
    assert np.max(np.abs(loose - sticking)[:, Y]) > 0.01 * np.max(np.abs(sticking[:, Y]))


def test_a_learned_force_of_the_tables_motion_acts_against_it() -> None:
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
        ("feed_velocity", TableEffects(feed_velocity=0.5)),
        ("second_frequency", TableEffects(second_frequency=4.0)),
        ("learned", TableEffects(learned=(0.0,) * 16)),
    ],
)
def test_an_ideal_table_refuses_effects_that_it_cannot_have(name: str, effects: TableEffects) -> None:
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
