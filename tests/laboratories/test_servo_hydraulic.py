"""Servo-hydraulics in interaction with their specimen, against independent solutions of their equations."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from common.errors import InputError
from common.plan.laboratory_tables import Actuator, Column, ServoHydraulics
from common.plan.plan import Plan
from common.plan.read import parse, with_test
from laboratories.column import model as column_lab
from laboratories.column.kind import COLUMN as KIND
from laboratories.effects import lay
from loop import closed_loop, replay, substructure
from models.system import ActuatorEffects, ColumnEffects, System
from models.transfer_systems import servo_hydraulic
from tests.helpers import SERVO_PLAN, with_table

Array = NDArray[np.float64]
DT = 1.0 / 4096.0
SERVO = ServoHydraulics()
COLUMN = Column(stiffness=1.19e6, mass=29.13, damping=114.6)


def servo(command: str = "held", **values: float) -> Actuator:
    return Actuator(model="servo_hydraulic", command=command, servo=ServoHydraulics(**values))


def commands(ticks: int, interval: float = DT) -> Array:
    """A smooth random command, m."""
    random = np.random.default_rng(3)
    t = np.arange(ticks) * interval
    tones = zip(random.uniform(1.0, 15.0, size=5), random.uniform(0.0, 6.0, size=5), strict=True)
    return np.asarray(
        0.001 * sum(np.sin(2.0 * np.pi * f * t + phase) for f, phase in tones) * np.tanh(20.0 * t)
    )


def run(lab: column_lab.ColumnLab, command: Array) -> Array:
    """Displacement and force at the ends of the intervals."""
    return np.array([column_lab.advance(lab, float(value)) for value in command])


def arriving(values: Array, actuator: Actuator, interval: float) -> Callable[[float], float]:
    """The command at the valve: held from its tick on or ramped, after the dead time."""
    lag = actuator.servo.delay
    if actuator.command == "ramp":
        times, reached = interval * np.arange(values.size + 1), np.concatenate([[0.0], values])
        return lambda t: float(np.interp(t - lag, times, reached))

    def held(t: float) -> float:
        place = math.floor((t - lag) / interval + 1e-9)
        return float(values[min(place, values.size - 1)]) if place >= 0 else 0.0

    return held


def solved(
    values: Array,
    actuator: Actuator,
    column: Column = COLUMN,
    compliance: float = 0.0,
    within: float = 0.0,
    interval: float = DT,
    excess: Callable[[float], float] = lambda _x: 0.0,
) -> Array:
    """Displacement and force at the ends of the intervals, piece by piece between the kinks of the command."""
    p, command = actuator.servo, arriving(values, actuator, interval)

    def rate(t: float, z: Array, u: Callable[[float], float]) -> list[float]:
        q, flow_rate, f, x, v = z
        error = p.gain * u(t) - x - (compliance + within) * f
        force_rate = (q - p.leakage * f - p.piston * v) / (1.0 + p.piston * compliance)
        pull = f - column.damping * v - column.stiffness * x - excess(x)
        return [
            flow_rate,
            p.valve * error - p.valve_damping * flow_rate - p.valve_stiffness * q,
            force_rate,
            v,
            pull / column.mass,
        ]

    kink = (p.delay / interval) % 1.0
    scale = np.array([1e6, 1e8, 1e3, 1e-3, 0.1])
    z, rows = np.zeros(5), []
    for tick in range(values.size):
        borders = sorted({tick * interval, (tick + kink) * interval, (tick + 1) * interval})
        for begin, end in pairwise(borders):
            middle = command(0.5 * (begin + end))
            u = (lambda _t, m=middle: m) if actuator.command == "held" else command
            z = solve_ivp(
                rate, (begin, end), z, args=(u,), method="DOP853", rtol=1e-11, atol=1e-12 * scale
            ).y[:, -1]
        rows.append((z[3], z[2]))
    return np.array(rows)


@pytest.mark.parametrize("kind", ["held", "ramp"])
@pytest.mark.parametrize("delay", [0.0, 3.0 * DT, 2.37 * DT])
def test_a_linear_specimen_is_solved_without_error(kind: str, delay: float) -> None:
    actuator, values = servo(kind, delay=delay), commands(400)
    found = run(column_lab.build(DT, actuator, COLUMN), values)
    expected = solved(values, actuator)
    for got, wanted in zip(found.T, expected.T, strict=True):
        np.testing.assert_allclose(got, wanted, atol=1e-8 * np.abs(wanted).max(), rtol=0)


def test_the_solution_is_exact_with_another_interval() -> None:
    values = commands(60, 0.002)
    found = run(column_lab.build(0.002, servo("ramp"), COLUMN), values)
    expected = solved(values, servo("ramp"), interval=0.002)
    np.testing.assert_allclose(found[:, 0], expected[:, 0], atol=1e-8 * np.abs(expected[:, 0]).max(), rtol=0)


@pytest.mark.parametrize(("law", "known"), [(0.0, "compliance"), (1.0, "within")])
def test_compliance_mass_and_dashpot_of_effects_act_inside_the_servo_loop(law: float, known: str) -> None:
    values = commands(300)
    lab = column_lab.build(
        DT,
        servo(),
        Column(stiffness=1.19e6, mass=20.0, damping=100.0),
        ActuatorEffects(compliance=3e-8, compliance_law=law),
        ColumnEffects(inertia=9.13, viscous=14.6),
    )
    expected = solved(values, servo(), **{known: 3e-8})  # type: ignore[arg-type]
    np.testing.assert_allclose(
        run(lab, values), expected, atol=1e-8 * np.abs(expected[:, 1]).max(), rtol=1e-6
    )
    assert np.abs(expected - solved(values, servo())).max() > 1.0


def test_a_specimen_beyond_its_first_stiffness_is_solved_in_short_steps() -> None:
    """A gap in the grip gives a force that needs no memory: none inside, its stiffness outside."""
    values, gap = commands(400), 4e-4

    def beyond(x: float) -> float:
        return COLUMN.stiffness * (math.copysign(max(abs(x) - 0.5 * gap, 0.0), x) - x)

    found = run(column_lab.build(DT, servo(), COLUMN, None, ColumnEffects(slip=gap)), values)
    expected = solved(values, servo(), excess=beyond)
    plain = solved(values, servo())
    for got, wanted, without in zip(found.T, expected.T, plain.T, strict=True):
        error = np.abs(got - wanted).max()
        assert error < 0.01 * np.abs(wanted).max()
        assert error < 0.05 * np.abs(wanted - without).max()


def test_a_yielding_specimens_history_is_kept_between_ticks() -> None:
    bilinear = Column(
        model="bilinear",
        stiffness=1.19e6,
        mass=29.13,
        damping=114.6,
        parameters={"yield_displacement": 5e-4, "hardening": 0.05},
    )
    t = np.arange(12_000) * DT
    slow = 2e-3 * np.sin(2.0 * np.pi * 1.0 * t) * np.tanh(5.0 * t)
    x, f = run(column_lab.build(DT, servo(), bilinear), slow)[-4097:].T
    work = float(np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(x)))
    top = 0.5 * float(np.ptp(x))
    loop = 4.0 * 0.95 * 1.19e6 * 5e-4 * (top - 5e-4)  # of a bilinear spring, per cycle
    assert work == pytest.approx(loop, rel=0.03)


def test_the_low_frequency_inverse_of_the_actuator_is_the_published_one() -> None:
    a, b = servo_hydraulic.rates(SERVO, COLUMN.stiffness, COLUMN.damping, COLUMN.mass, 0.0)
    state: Array = b[:, 0]
    moments = []
    for _ in range(4):  # G(s) = −Σ c·A^(−1−i)·b·s^i
        state = np.asarray(np.linalg.solve(a, state), dtype=np.float64)
        moments.append(-state[servo_hydraulic.POSITION])
    inverse = [1.0 / moments[0]]
    for k in range(1, 4):
        inverse.append(-sum(moments[j] * inverse[k - j] for j in range(1, k + 1)) / moments[0])
    np.testing.assert_allclose(inverse, [0.99254, 0.024889, 1.0662e-4, 3.8564e-7], rtol=5e-5)
    assert inverse[1] / inverse[0] == pytest.approx(0.0251, abs=5e-5)  # s, its delay


def test_the_flow_saturates_at_the_fully_open_valve() -> None:
    limit = 0.05
    lab = column_lab.build(DT, servo(), COLUMN, ActuatorEffects(velocity_limit=limit))
    fast = 5e-3 * np.sin(2.0 * np.pi * 5.0 * np.arange(2000) * DT)
    flows = []
    for value in fast:
        column_lab.advance(lab, float(value))
        flows.append(abs(lab.state[column_lab.STATES + servo_hydraulic.FLOW]))
    assert max(flows) == limit * SERVO.piston
    free = run(column_lab.build(DT, servo(), COLUMN), fast)
    bound = run(column_lab.build(DT, servo(), COLUMN, ActuatorEffects(velocity_limit=limit)), fast)
    assert np.abs(free[1000:, 0]).max() > 4e-3
    assert np.abs(bound[1000:, 0]).max() == pytest.approx(limit / (4.0 * 5.0), rel=0.15)  # of a triangle


def test_the_flow_of_the_open_valve_falls_with_the_load() -> None:
    limit, stall = 0.05, 8e3
    more = ActuatorEffects(velocity_limit=limit, stall_force=stall)
    lab = column_lab.build(DT, servo(), COLUMN, more)
    at_limit = 0
    for value in 5e-3 * np.sin(2.0 * np.pi * 5.0 * np.arange(2000) * DT):
        column_lab.advance(lab, float(value))
        flow, force = lab.state[[column_lab.STATES + servo_hydraulic.FLOW, column_lab.FORCE]]
        most = limit * SERVO.piston * math.sqrt(1.0 - math.copysign(1.0, flow) * force / stall)
        at_limit += abs(flow) == pytest.approx(most, rel=1e-12)
        assert abs(flow) < (1.0 + 1e-12) * most
    assert at_limit > 200


def test_a_command_within_the_overlap_moves_nothing_and_a_larger_one_falls_short() -> None:
    overlap = ActuatorEffects(deadband=2e-4)
    small = run(column_lab.build(DT, servo(), COLUMN, overlap), np.full(2000, 0.9e-4 / SERVO.gain))
    assert not small.any()
    short = run(column_lab.build(DT, servo(), COLUMN, overlap), np.full(4000, 1e-3))
    whole = run(column_lab.build(DT, servo(), COLUMN), np.full(4000, 1e-3))
    assert whole[-1, 0] - short[-1, 0] == pytest.approx(1e-4 / (SERVO.gain * 0.99254), rel=1e-3)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return parse(SERVO_PLAN, Path())


def driven(command: Array) -> Array:
    """The command of an actuator (m) and a zero command in place of a motor's."""
    return np.stack([command, np.zeros_like(command)], axis=1)


def test_gain_and_dead_time_act_on_the_command(plan: Plan) -> None:
    values = commands(300)
    laid = lay(System(plan), [("actuator.gain", {"factor": 0.9}), ("actuator.delay", {"delay": 0.002})])
    found = replay.laboratory(KIND, laid, driven(values))
    expected = solved(values, servo(gain=0.9 * SERVO.gain, delay=0.002))
    np.testing.assert_allclose(
        found[1:, 0], expected[:-1, 0], atol=1e-8 * np.abs(expected[:, 0]).max(), rtol=0
    )
    back = lay(laid, [("actuator.delay", {"delay": -0.05})])
    assert back.plan.actuator.servo.delay == 0.0


@pytest.mark.parametrize(
    "entry", [("actuator.time_constant", {"factor": 1.3}), ("actuator.backlash", {"width": 2e-4})]
)
def test_effects_that_servo_hydraulics_cannot_have_are_refused(
    plan: Plan, entry: tuple[str, dict[str, float]]
) -> None:
    with pytest.raises(InputError, match=f"'{entry[0]}' needs the actuator model 'fopdt'"):
        lay(System(plan), [entry])
    with pytest.raises(InputError, match="cannot have the effect 'actuator.backlash'"):
        column_lab.build(DT, servo(), COLUMN, ActuatorEffects(backlash=1e-4))
    gradual = ActuatorEffects(velocity_limit=0.05, velocity_limit_sharpness=3.0)
    with pytest.raises(InputError, match=r"'actuator.velocity_limit' with law 1"):
        column_lab.build(DT, servo(), COLUMN, gradual)
    with pytest.raises(InputError, match=r"'column.viscous' with a law but 0"):
        column_lab.build(DT, servo(), COLUMN, None, ColumnEffects(viscous=1e4, viscous_law=1.0))
    with pytest.raises(InputError, match="above 0 kg"):
        column_lab.build(DT, servo(), Column())


def test_a_replay_may_begin_in_steady_state_under_a_constant_command(plan: Plan) -> None:
    found = replay.laboratory(KIND, System(plan), driven(np.full(200, 2e-3)), 2e-3)
    np.testing.assert_allclose(found[:, 0], 2e-3 / 0.9925416, rtol=1e-6)
    np.testing.assert_allclose(found[:, 1], 1.19e6 * 2e-3 / 0.9925416, rtol=1e-5)


def test_the_force_behind_a_lag_includes_mass_and_dashpot_of_the_specimen() -> None:
    lagging = Actuator(gain=1.0, delay=0.003, time_constant=0.02)
    t = np.arange(4000) * DT
    omega = 2.0 * np.pi * 6.0
    found = run(column_lab.build(DT, lagging, COLUMN), 2e-3 * np.sin(omega * t))[2000:]
    x, f = found.T
    c, s = np.cos(omega * t[2000:]), np.sin(omega * t[2000:])
    base = np.column_stack([c, s])
    position, force = (complex(*np.linalg.lstsq(base, row, rcond=None)[0]) for row in (x, f))
    ratio = (force / position).conjugate()  # of phasors a·cos + b·sin
    wanted = COLUMN.stiffness - omega**2 * COLUMN.mass + 1j * omega * COLUMN.damping
    assert ratio.real == pytest.approx(wanted.real, rel=1e-3)
    assert ratio.imag == pytest.approx(wanted.imag, rel=0.06)  # the differences are half a step late


def test_a_replay_of_the_laboratory_alone_gives_the_readings_of_the_loop(plan: Plan) -> None:
    short = with_test(plan, duration=0.5)
    for base in (short, with_table(short, "actuator", command="ramp")):
        ground = substructure.ground_rows(base, substructure.motion(base))
        found = closed_loop.simulate(base, ground)
        again = replay.laboratory(KIND, System(base), driven(found.master["actuator_command"]))
        for values, name in zip(again.T, KIND.channels.names, strict=True):
            assert np.array_equal(values, found.master[name])
