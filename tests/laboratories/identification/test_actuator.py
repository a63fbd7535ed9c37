"""Step response and least squares of the actuator, on the emulated laboratory and on scipy's simulation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from common.errors import InputError
from common.plan.laboratory_tables import Actuator, Column
from laboratories.column import model as column_lab
from laboratories.identification import actuator, estimate, step_response

DT = 0.002
NOISE = 5e-6
SEEDS = range(40)
Array = NDArray[np.float64]
TRUE = {"delay": 0.014, "time_constant": 0.030, "gain": 1.0}


def times(count: int) -> Array:
    """Of the ticks, s."""
    return np.asarray(DT * np.arange(count), dtype=np.float64)


def emulated(command: Array, device: Actuator | None = None) -> Array:
    lab = column_lab.build(DT, device or Actuator(), Column())
    result = np.zeros(command.size)
    for k in range(command.size - 1):
        result[k + 1] = column_lab.advance(lab, float(command[k]))[0]
    return result


@pytest.mark.parametrize("held", [False, True])
def test_a_held_command_is_distinguished_from_a_ramped_one(held: bool) -> None:
    device = Actuator(gain=0.97, delay=0.0133, time_constant=0.02, command="held" if held else "ramp")
    t = times(1500)
    command = 2e-3 * np.sin(2.0 * np.pi * (0.5 + 1.5 * t) * t)
    fit = actuator.least_squares(command, emulated(command, device), DT, held=held)
    other = actuator.least_squares(command, emulated(command, device), DT, held=not held)
    assert fit["delay"].value == pytest.approx(0.0133, abs=1e-7)
    assert other["delay"].value - fit["delay"].value == pytest.approx(
        DT / 2 * (1 if held else -1) * -1, rel=0.1
    )
    step = np.where(t < 0.2, 0.0, 2e-3)
    found = step_response.tangent(t[:600], step[:600], emulated(step, device)[:600], 100, held=held)
    assert found.delay.value == pytest.approx(0.0133, abs=1e-4)


def noise(seed: int, size: int) -> Array:
    return NOISE * np.random.default_rng(seed).standard_normal(size)


def step(ticks: int = 300, begin: int = 50, height: float = 0.005) -> Array:
    result = np.zeros(ticks)
    result[begin:] = height
    return result


def random_motion(ticks: int) -> Array:
    random = np.random.default_rng(7)
    t = times(ticks)
    tones = zip(random.uniform(0.3, 8.0, 8), random.uniform(0.0, 6.0, 8), strict=True)
    return 0.001 * np.tanh(t) * np.sum([np.sin(2.0 * np.pi * f * t + phase) for f, phase in tones], axis=0)


def continuous(command: Array, lag: float, constants: tuple[float, ...], fine: int = 40) -> Array:
    """The ramped command through lags in series by scipy's `lsim` on a grid 40 times finer."""
    t = np.arange((command.size - 1) * fine + 1) * DT / fine
    reached = np.concatenate([command[:1], command[:-1]])
    ramped = np.interp(t - lag, DT * np.arange(command.size), reached)
    denominator = np.array([1.0])
    for constant in constants:
        denominator = np.polymul(denominator, [constant, 1.0])
    _, result, _ = signal.lsim((np.array([1.0]), denominator), ramped, t)
    return np.asarray(result[::fine], dtype=np.float64)


def covers(value: estimate.Estimate, true: float) -> bool:
    return value.low <= true <= value.high


@pytest.mark.parametrize("lag", [0.0140, 0.0147, 0.0152])
def test_the_inflection_tangent_has_no_bias_without_noise(lag: float) -> None:
    command = step()
    t = times(command.size)
    for measured in (emulated(command, Actuator(delay=lag)), continuous(command, lag, (0.030,))):
        found = step_response.tangent(t, command, measured, 50)
        assert found.delay.value == pytest.approx(lag, abs=1e-4)
        assert found.time_constant.value == pytest.approx(0.030, abs=2e-4)
        assert found.gain.value == pytest.approx(1.0, abs=1e-4)
        assert (found.delay.unit, found.time_constant.unit, found.gain.unit) == ("s", "s", "")


def test_the_inflection_tangent_errs_by_less_than_a_millisecond_and_its_intervals_cover() -> None:
    command = step()
    t = times(command.size)
    clean = emulated(command)
    found = [step_response.tangent(t, command, clean + noise(seed, t.size), 50) for seed in SEEDS]
    for name, true in TRUE.items():
        values = [getattr(one, name) for one in found]
        assert np.mean([covers(value, true) for value in values]) >= 0.85, name
        if name != "gain":
            assert max(abs(value.value - true) for value in values) < 1e-3, name


def test_the_inflection_tangent_of_two_lags_agrees_with_the_exact_response() -> None:
    """Two lags T₁, T₂: inflection at `T₁T₂/(T₁ − T₂)·ln(T₁/T₂)`."""
    slow, fast, lag = 0.030, 0.006, 0.010
    place = slow * fast / (slow - fast) * np.log(slow / fast)
    fades = np.exp(-place / slow), np.exp(-place / fast)
    height = 1.0 - (slow * fades[0] - fast * fades[1]) / (slow - fast)
    steepest = (fades[0] - fades[1]) / (slow - fast)
    command = step(400)
    t = times(command.size)
    found = step_response.tangent(t, command, continuous(command, lag, (slow, fast)) + noise(1, t.size), 50)
    assert found.delay.value == pytest.approx(lag + place - height / steepest, abs=1e-3)
    assert found.time_constant.value == pytest.approx(1.0 / steepest, abs=1.5e-3)


def test_steps_up_and_down_are_averaged() -> None:
    steps = [50, 450, 850, 1250, 1650]
    command = np.zeros(2050)
    for i, begin in enumerate(steps):
        command[begin:] = 0.005 if i % 2 == 0 else 0.0
    t = times(command.size)
    found = step_response.tangents(t, command, emulated(command) + noise(2, t.size), steps, 400)
    assert found.delay.value == pytest.approx(0.014, abs=3e-4)
    assert found.time_constant.value == pytest.approx(0.030, abs=5e-4)
    assert found.gain.value == pytest.approx(1.0, abs=1e-3)
    single = step_response.tangents(t, command, emulated(command), steps[:1], 400)
    assert single.delay.value == pytest.approx(0.014, abs=2e-4)


def wrong(change: str) -> tuple[Array, Array, Array, int]:
    command = step()
    measured = emulated(command)
    t = times(command.size)
    if change == "short":
        return t[:20], command[:20], measured[:20], 10
    if change == "nan":
        measured[3] = np.nan
    if change == "elsewhere":
        return t, command, measured, 60
    if change == "twice":
        command[200:] = 0.0
    if change == "unsteady":
        return t[:90], command[:90], measured[:90], 50
    if change == "dead":
        measured[:] = 0.0
    if change == "time":
        t = t[::-1].copy()
    if change == "lengths":
        return t, command, measured[:-1], 50
    return t, command, measured, 2 if change == "early" else 50


@pytest.mark.parametrize(
    "change", ["short", "nan", "elsewhere", "twice", "unsteady", "dead", "time", "lengths", "early"]
)
def test_a_record_without_a_readable_step_is_refused(change: str) -> None:
    with pytest.raises(InputError, match=r"^[A-Z].*\.$"):
        step_response.tangent(*wrong(change))


def test_steps_that_are_not_in_the_record_are_refused() -> None:
    command = step()
    t = times(command.size)
    with pytest.raises(InputError, match="No step"):
        step_response.tangents(t, command, command, [], 100)
    with pytest.raises(InputError, match="over the record"):
        step_response.tangents(t, command, command, [250], 100)


@pytest.mark.parametrize("kind", ["step", "sweep", "random"])
def test_least_squares_finds_any_actuator_from_any_motion(kind: str) -> None:
    t = times(1500)
    motions = {
        "step": step(1500),
        "sweep": 0.003 * signal.chirp(t, 0.5, 3.0, 8.0, phi=-90.0),
        "random": random_motion(1500),
    }
    for lag, constant, gain in ((0.014, 0.030, 1.0), (0.0205, 0.012, 0.9), (0.0, 0.05, 1.1)):
        device = Actuator(gain=gain, delay=lag, time_constant=constant)
        fit = actuator.least_squares(motions[kind], emulated(motions[kind], device) + noise(3, t.size), DT)
        assert fit["delay"].value == pytest.approx(lag, abs=2e-4)
        assert fit["time_constant"].value == pytest.approx(constant, abs=3e-4)
        assert fit["gain"].value == pytest.approx(gain, abs=2e-3)
        assert fit.nrmse < 0.02


def test_least_squares_agrees_with_the_continuous_equation() -> None:
    command = random_motion(1500)
    measured = 0.95 * continuous(command, 0.0163, (0.027,)) + 0.0005
    fit = actuator.least_squares(command, measured, DT)
    assert fit["delay"].value == pytest.approx(0.0163, abs=2e-6)
    assert fit["time_constant"].value == pytest.approx(0.027, abs=2e-6)
    assert fit["gain"].value == pytest.approx(0.95, abs=1e-5)


@pytest.mark.parametrize("kind", ["step", "random"])
def test_least_squares_intervals_cover_the_true_parameters(kind: str) -> None:
    command = step(500) if kind == "step" else random_motion(1000)
    clean = emulated(command)
    fits = [actuator.least_squares(command, clean + noise(seed, clean.size), DT) for seed in SEEDS]
    for name, true in TRUE.items():
        assert np.mean([covers(fit[name], true) for fit in fits]) >= 0.85, name


def test_intervals_cover_under_coloured_noise() -> None:
    command = random_motion(1500)
    clean = emulated(command)
    fits = []
    for seed in SEEDS:
        colour = signal.lfilter([1.0], [1.0, -0.9], noise(seed, clean.size))
        fits.append(actuator.least_squares(command, clean + colour, DT))
    for name, true in TRUE.items():
        assert np.mean([covers(fit[name], true) for fit in fits]) >= 0.85, name


def test_a_steady_sine_gives_wider_intervals_than_a_random_motion() -> None:
    t = times(1500)
    sine = 0.004 * np.sin(2.0 * np.pi * t)
    late = emulated(sine)[500:] + noise(4, 1000)
    alone = actuator.least_squares(sine[500:], late, DT)
    rich = actuator.least_squares(random_motion(1000), emulated(random_motion(1000)) + noise(4, 1000), DT)
    (low, high), (least, most) = ((fit["delay"].low, fit["delay"].high) for fit in (rich, alone))
    assert most - least > 5.0 * (high - low)


def test_least_squares_refuses_records_without_information() -> None:
    command = random_motion(200)
    measured = emulated(command)
    broken = measured.copy()
    broken[7] = np.inf
    scatter = np.random.default_rng(0).standard_normal(200)
    cases: list[tuple[Any, Any, float, str]] = [
        (command[:10], measured[:10], DT, "10 samples"),
        (command, measured[:-1], DT, "one length"),
        (command, broken, DT, "not finite at tick 7"),
        (np.zeros(200), measured, DT, "constant"),
        (command, np.ones(200), DT, "constant"),
        (command, measured, 0.0, "above 0"),
        (command, measured, float("nan"), "above 0"),
        (command.reshape(2, -1), measured, DT, "dimensions"),
        (command, scatter, DT, "does not follow"),
    ]
    for given, taken, interval, what in cases:
        with pytest.raises(InputError, match=what):
            actuator.least_squares(given, taken, interval)


def test_an_autocorrelated_residual_counts_for_fewer_samples() -> None:
    white = np.random.default_rng(0).standard_normal(20_000)
    assert estimate.inflation(white) < 1.2
    red = signal.lfilter([1.0], [1.0, -0.8], white)
    assert estimate.inflation(red) == pytest.approx(9.0, rel=0.25)  # (1 + ρ)/(1 − ρ)
    assert estimate.inflation(np.zeros(10)) == 1.0


def test_parameters_that_the_record_cannot_separate_have_infinite_intervals() -> None:
    base = np.random.default_rng(1).standard_normal((100, 2))
    jacobian = np.column_stack([base[:, 0], 2.0 * base[:, 0], base[:, 1]])
    spread, _ = estimate.deviations(jacobian, np.random.default_rng(2).standard_normal(100), [100])
    assert np.isinf(spread[:2]).all()
    assert spread[2] == pytest.approx(0.1, rel=0.3)
