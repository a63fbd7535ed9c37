"""Table and damper on the emulated laboratory and on continuous equations solved by scipy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from common.errors import InputError
from common.plan.laboratory_tables import Damper, ShakingTable
from laboratories.identification import damper, table
from laboratories.table import model as table_lab
from tests.rths.test_free_drive import DASHPOT, FRICTION, INTERVAL, MASS, OFFSET, drive

DT = 0.002
SEEDS = range(20)
Array = NDArray[np.float64]
TRUE = {"mass": 16.0, "damping": 6.0, "stiffness": 56.8, "motor_time_constant": 0.003, "gain": 1.0}
OFF = Damper(mass=18.0, damping=4.0, stiffness=40.0, motor_time_constant=0.006)


def emulated(command: Array, motor: Array, device: ShakingTable | None = None) -> Array:
    """Table displacement and acceleration, stroke and force; (4, n)."""
    lab = table_lab.build(DT, device or ShakingTable(), Damper())
    result = np.zeros((4, command.size))
    for k in range(command.size - 1):
        result[:, k + 1] = table_lab.advance(lab, float(command[k]), float(motor[k]))
    return result


def tones(ticks: int, lowest: float, highest: float, size: float, seed: int = 1) -> Array:
    random = np.random.default_rng(seed)
    t = np.arange(ticks) * DT
    parts = zip(random.uniform(lowest, highest, 10), random.uniform(0.0, 6.0, 10), strict=True)
    return (
        size
        / 3.0
        * np.tanh(2.0 * t)
        * np.sum([np.sin(2 * np.pi * f * t + phase) for f, phase in parts], axis=0)
    )


def white(seed: int, size: int, rms: float) -> Array:
    return rms * np.random.default_rng(seed).standard_normal(size)


@pytest.mark.parametrize(
    ("frequency", "ratio", "lag"), [(15.0, 0.7, 0.004), (8.0, 0.35, 0.0113), (30.0, 1.2, 0.0)]
)
def test_the_tables_parameters_are_found(frequency: float, ratio: float, lag: float) -> None:
    command = tones(2500, 0.5, 25.0, 0.002)
    moved = emulated(command, np.zeros(2500), ShakingTable(frequency, ratio, lag))[0] + white(1, 2500, 1e-5)
    fit = table.least_squares(command, moved, DT)
    assert fit["frequency"].value == pytest.approx(frequency, rel=0.01)
    assert fit["damping_ratio"].value == pytest.approx(ratio, rel=0.01)
    assert fit["delay"].value == pytest.approx(lag, abs=2e-4)
    assert fit.nrmse < 0.05
    assert [fit[name].unit for name in table.NAMES] == ["Hz", "", "s", ""]


def test_an_error_of_a_tables_calibration_is_no_slower_loop() -> None:
    command = tones(3000, 0.3, 8.0, 0.01, seed=5)
    moved = 1.012 * emulated(command, np.zeros(3000))[0] + 1e-4
    fit = table.least_squares(command, moved, DT)
    assert fit["gain"].value == pytest.approx(1.012, abs=1e-4)
    assert fit["frequency"].value == pytest.approx(15.0, rel=1e-3)
    assert fit["delay"].value == pytest.approx(0.004, abs=1e-5)


def test_the_table_agrees_with_the_continuous_equation() -> None:
    fine, ticks = 40, 1500
    command = tones(ticks, 0.5, 20.0, 0.002, seed=5)
    t = np.arange((ticks - 1) * fine + 1) * DT / fine
    reached = np.concatenate([[0.0], command[:-1]])
    omega = 2.0 * np.pi * 12.0
    ramped = np.interp(t - 0.0063, DT * np.arange(ticks), reached)
    _, moved, _ = signal.lsim(([omega**2], [1.0, 2.0 * 0.5 * omega, omega**2]), ramped, t)
    fit = table.least_squares(command, moved[::fine], DT)
    assert fit["frequency"].value == pytest.approx(12.0, rel=1e-4)
    assert fit["damping_ratio"].value == pytest.approx(0.5, rel=1e-4)
    assert fit["delay"].value == pytest.approx(0.0063, abs=1e-6)


@pytest.mark.slow
def test_the_tables_intervals_cover_its_true_parameters() -> None:
    command = tones(1500, 0.5, 20.0, 0.002, seed=3)
    clean = emulated(command, np.zeros(1500))[0]
    fits = [table.least_squares(command, clean + white(seed, 1500, 1e-5), DT) for seed in SEEDS]
    for name, true in (("frequency", 15.0), ("damping_ratio", 0.7), ("delay", 0.004)):
        assert np.mean([fit[name].low <= true <= fit[name].high for fit in fits]) >= 0.85, name


def test_the_frequency_response_and_bandwidth_agree_with_the_model() -> None:
    ticks = 30_000
    command = white(1, ticks, 1e-3)
    moved = emulated(command, np.zeros(ticks))[0] + white(2, ticks, 1e-5)
    found = table.frequency_response(command, moved, DT)
    f = found.frequency
    exact = np.exp(-2j * np.pi * f * 0.004) / (1.0 - (f / 15.0) ** 2 + 1.4j * f / 15.0)
    assert np.abs(found.response - exact)[f < 25.0].max() < 0.03
    read = table.bandwidth(found)
    fine = np.linspace(0.1, 40.0, 40_000)
    model = np.exp(-2j * np.pi * fine * 0.004) / (1.0 - (fine / 15.0) ** 2 + 1.4j * fine / 15.0)
    assert read.half_power == pytest.approx(fine[np.abs(model) < np.sqrt(0.5)][0], rel=0.03)
    assert read.quarter_turn == pytest.approx(fine[np.unwrap(np.angle(model)) < -np.pi / 2][0], rel=0.02)
    assert read.delay == pytest.approx(0.004 + 2.0 * 0.7 / (2.0 * np.pi * 15.0), abs=4e-4)


def test_a_table_that_lags_only_by_the_sampling_has_no_bandwidth() -> None:
    command = white(1, 4000, 1e-3)
    found = table.frequency_response(command, np.concatenate([[0.0], command[:-1]]), DT)
    read = table.bandwidth(found)
    assert np.isnan(read.quarter_turn)
    assert read.delay == pytest.approx(0.0, abs=1e-6)


def test_table_records_without_information_are_refused() -> None:
    command = tones(400, 0.5, 20.0, 0.002)
    moved = emulated(command, np.zeros(400))[0]
    cases: list[tuple[Any, Any, str]] = [
        (command[:30], moved[:30], "30 samples"),
        (np.zeros(400), moved, "constant"),
        (command, np.full(400, 0.1), "constant"),
        (command, -moved, "does not follow"),
        (command, np.where(np.arange(400) == 3, np.nan, moved), "not finite at tick 3"),
    ]
    for given, taken, what in cases:
        with pytest.raises(InputError, match=what):
            table.least_squares(given, taken, DT)
    with pytest.raises(InputError, match="constant"):
        table.frequency_response(np.zeros(400), moved, DT)
    with pytest.raises(InputError, match="not coherent"):
        table.bandwidth(table.frequency_response(white(1, 4000, 1.0), white(2, 4000, 1.0), DT))


def shaken(seed: int, motor: Array, clean: Array) -> damper.DamperFit:
    stroke = clean[2] + white(seed, motor.size, 2e-6)
    force = clean[3] + white(seed + 1000, motor.size, 0.2)
    return damper.least_squares(motor, stroke, force, None, DT, nominal=OFF)


@pytest.mark.slow
def test_the_dampers_parameters_are_found_and_its_intervals_cover() -> None:
    motor = tones(1000, 0.2, 5.0, 40.0)
    clean = emulated(np.zeros(1000), motor)
    fits = [shaken(seed, motor, clean) for seed in SEEDS]
    for name, true in (*TRUE.items(), ("friction", 0.0)):
        assert np.mean([fit[name].low <= true <= fit[name].high for fit in fits]) >= 0.85, name
    for name, true in TRUE.items():
        assert fits[0][name].value == pytest.approx(true, rel=5e-3)
    assert fits[0].stroke_nrmse < 1e-3
    assert fits[0].force_nrmse < 0.05


def test_without_a_force_mass_and_gain_are_not_separable() -> None:
    motor = tones(1500, 0.2, 5.0, 40.0)
    stroke = emulated(np.zeros(1500), motor)[2] + white(1, 1500, 2e-6)
    blind = damper.least_squares(motor, stroke, None, None, DT)
    assert np.isinf(blind["mass"].high)
    assert np.isinf(blind["gain"].high)
    assert np.isnan(blind.force_nrmse)
    held = damper.least_squares(motor, stroke, None, None, DT, free=("mass", "damping", "stiffness"))
    assert held["mass"].low < 16.0 < held["mass"].high
    assert set(held.parameters) == {"mass", "damping", "stiffness"}


def test_a_damper_without_a_spring_is_identified_piece_by_piece() -> None:
    force, position = drive()
    planned = replace(
        Damper(), mass=1.1 * MASS, stiffness=0.0, damping=0.8 * DASHPOT, motor_time_constant=0.0
    )
    free = ("mass", "damping", "friction", "offset")
    found = damper.least_squares(force, position, None, None, INTERVAL, free=free, nominal=planned)
    for name, true in {"mass": MASS, "damping": DASHPOT, "friction": FRICTION, "offset": OFFSET}.items():
        assert found[name].value == pytest.approx(true, rel=0.01), name
        assert found[name].high - found[name].low < 0.02 * true, name


@pytest.mark.parametrize("lag", [1.5e-3, 60e-3])
def test_a_drive_without_a_spring_shows_its_motor_under_a_held_command(lag: float) -> None:
    step, mass, dashpot, ticks = 1e-3, 80.0, 150.0, 6000
    t = step * np.arange(ticks)
    command = 90.0 * np.sign(np.sin(2.0 * np.pi * 0.8 * t)) + 40.0 * np.sin(2.0 * np.pi * 6.3 * t + 1.0)
    rates = np.array([[0.0, 1.0, 0.0], [0.0, -dashpot / mass, 1.0 / mass], [0.0, 0.0, -1.0 / lag]])
    whole = expm(step * np.block([[rates, np.array([[0.0], [0.0], [1.0 / lag]])], [np.zeros((1, 4))]]))
    states = np.zeros((ticks, 3))
    for k in range(ticks - 1):
        states[k + 1] = whole[:3, :3] @ states[k] + whole[:3, 3] * command[k]
    planned = replace(Damper(), mass=85.0, stiffness=0.0, damping=140.0, motor_time_constant=0.7 * lag)
    free = ("mass", "damping", "motor_time_constant", "friction", "offset")
    position = states[:, 0] + white(3, ticks, 1e-7)
    found = damper.least_squares(command, position, None, None, step, free=free, nominal=planned)
    assert found["mass"].value == pytest.approx(mass, rel=1e-3)
    assert found["damping"].value == pytest.approx(dashpot, rel=3e-3)
    assert found["motor_time_constant"].value == pytest.approx(lag, rel=0.03)
    assert found.stroke_nrmse < 3e-4


def test_a_shaken_table_excites_the_damper() -> None:
    command = tones(3000, 0.3, 3.0, 0.01)
    clean = emulated(command, np.zeros(3000))
    fit = damper.least_squares(
        np.zeros(3000),
        clean[2] + white(1, 3000, 2e-6),
        clean[3] + white(2, 3000, 0.2),
        clean[1],
        DT,
        free=("mass", "damping", "stiffness"),
        nominal=OFF,
    )
    for name in ("mass", "damping", "stiffness"):
        assert fit[name].value == pytest.approx(TRUE[name], rel=0.01), name


def test_friction_simulated_by_another_solver_is_found() -> None:
    """Coulomb friction with a sign 2.5 times as sharp, integrated by LSODA with the motor's states."""
    ticks, friction = 1500, 2.0
    motor = tones(ticks, 0.2, 4.0, 60.0, seed=4)

    def rate(_t: float, z: Array, target: float) -> list[float]:
        push = z[2] - 56.8 * z[0] - 6.0 * z[1] - friction * np.tanh(z[1] / 2e-4)
        return [z[1], push / 16.0, (1.1 * target - z[2]) / 0.003]

    state, states = np.zeros(3), [np.zeros(3)]
    for k in range(ticks - 1):
        state = solve_ivp(rate, (0.0, DT), state, method="LSODA", args=(motor[k],), rtol=1e-7, atol=1e-10).y[
            :, -1
        ]
        states.append(state)
    x, v, u = np.array(states).T
    force = 56.8 * x + 6.0 * v + friction * np.tanh(v / 2e-4) - u
    fit = damper.least_squares(
        motor, x + white(1, ticks, 2e-6), force + white(2, ticks, 0.2), None, DT, nominal=OFF
    )
    assert fit["friction"].value == pytest.approx(friction, rel=0.02)
    assert fit["gain"].value == pytest.approx(1.1, rel=0.01)
    assert fit["mass"].value == pytest.approx(16.0, rel=0.01)
    assert fit["damping"].value == pytest.approx(6.0, rel=0.05)
    assert fit["stiffness"].value == pytest.approx(56.8, rel=0.05)


def test_damper_records_without_information_are_refused() -> None:
    motor = tones(300, 0.2, 5.0, 40.0)
    clean = emulated(np.zeros(300), motor)
    stroke, force = clean[2], clean[3]
    good: dict[str, Any] = {
        "damper_command": motor,
        "stroke": stroke,
        "force": force,
        "table_acceleration": None,
        "interval": DT,
    }
    cases: list[tuple[dict[str, Any], str]] = [
        ({"damper_command": motor[:50]}, "50 samples"),
        ({"force": force[:-1]}, "one length"),
        ({"stroke": np.zeros(300)}, "constant"),
        ({"force": np.ones(300)}, "constant"),
        ({"damper_command": np.zeros(300)}, "without excitation"),
        ({"damper_command": np.zeros(300), "table_acceleration": np.zeros(300)}, "without excitation"),
        ({"stroke": np.where(np.arange(300) == 9, np.nan, stroke)}, "not finite at tick 9"),
        ({"free": ()}, "at least one"),
        ({"free": ("mess",)}, "Unknown parameter 'mess'"),
        ({"interval": -DT}, "above 0"),
    ]
    for change, what in cases:
        with pytest.raises(InputError, match=what):
            damper.least_squares(**{**good, **change})
