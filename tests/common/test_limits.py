"""Limits by themselves: rates against what was written, errors that last, sentences, NaN and inf."""

from __future__ import annotations

import math

import numpy as np
import pytest

from common.plan.limits import (
    PATIENCE,
    TRAVEL,
    Change,
    Frozen,
    Guard,
    Lasting,
    LimitViolation,
    Standstill,
    violated,
)
from common.plan.plan import Plan
from common.plan.tables import Limits
from tests.helpers import with_table

INTERVAL = 0.002
NAMES = {"step": "actuator_step", "velocity": "actuator_velocity", "acceleration": "actuator_acceleration"}


def actuator(**most: float) -> Change:
    limits = dict.fromkeys(NAMES.values(), math.inf) | most
    return Change(vars(Limits(**limits)), INTERVAL, **NAMES)


@pytest.mark.parametrize(
    ("violation", "sentence"),
    [
        (
            LimitViolation("actuator_velocity", 0.612, 0.5),
            "actuator_velocity is 0.612, beyond its limit of 0.5 m/s.",
        ),
        (LimitViolation("error_energy", 1.25, 1.0), "error_energy is 1.25, beyond its limit of 1."),
        (
            LimitViolation("column_force", math.nan, 4e5),
            "column_force is nan, beyond its limit of 400000 N.",
        ),
    ],
)
def test_a_violation_is_a_sentence_with_the_unit_of_the_plan(
    violation: LimitViolation, sentence: str
) -> None:
    assert str(violation) == violation.sentence == sentence


def test_the_first_command_is_a_change_from_rest_in_zero() -> None:
    assert actuator(actuator_step=1e-3).violation(1e-3) is None
    assert actuator(actuator_step=1e-3).violation(-1.01e-3) == LimitViolation("actuator_step", -1.01e-3, 1e-3)
    for name, most, value in (
        ("actuator_velocity", 0.5, 0.55),
        ("actuator_acceleration", 250.0, 275.0),
    ):
        found = actuator(**{name: most}).violation(1.1e-3)
        assert found is not None
        assert (found.name, found.limit) == (name, most)
        assert found.value == pytest.approx(value)


def test_rates_are_those_of_what_was_written() -> None:
    change = actuator(actuator_step=1e-3, actuator_acceleration=400.0)
    change.written(1e-3)
    assert change.violation(2.0e-3) is None
    assert change.violation(2.1e-3) is not None
    assert change.violation(2.1e-3) is not None  # nothing was written: it stays as far away
    change.written(1e-3)  # held
    found = change.violation(-0.7e-3)
    assert found is not None
    assert found.name == "actuator_step"
    assert found.value == pytest.approx(-1.7e-3)


def test_an_acceleration_is_the_second_difference() -> None:
    change = actuator(actuator_acceleration=100.0)
    for command in (1e-4, 3e-4, 6e-4):
        assert change.violation(command) is None
        change.written(command)
    assert change.violation(9e-4) is None  # as fast as before
    found = change.violation(4e-4)
    assert found is not None
    assert found.value == pytest.approx((4e-4 - 2 * 6e-4 + 3e-4) / INTERVAL**2)


def test_a_quantity_without_a_limit_of_that_kind_has_none() -> None:
    motor = Change(vars(Limits(damper_step=10.0)), INTERVAL, step="damper_step")
    assert motor.violation(10.0) is None
    assert motor.violation(10.1) == LimitViolation("damper_step", 10.1, 10.0)


def test_an_error_trips_when_it_lasts() -> None:
    lasting = Lasting(vars(Limits(column_error=0.01)), "column_error")
    errors = [0.011, -0.02, 0.01, 0.011, -0.011, 0.012, 0.013]
    found = [lasting.violation(error) for error in errors]
    assert [violation is not None for violation in found] == [False] * 5 + [True] * 2
    assert found[5] == LimitViolation("column_error", 0.012, 0.01)


def test_nan_is_beyond_any_limit_and_nothing_else_beyond_an_infinite_one() -> None:
    limits = Limits(velocity=math.inf, column_error=math.inf)
    guard = Guard(vars(limits), ("velocity",))
    assert guard.violation((math.inf,)) is guard.violation((-1e300,)) is None
    assert guard.violation((math.nan,)) is not None
    assert violated(vars(limits), velocity=1e9, column_error=math.nan) is not None
    assert actuator().violation(1e300) is None
    assert actuator().violation(math.nan) is not None
    lasting = Lasting(vars(limits), "column_error")
    assert all(lasting.violation(1e9) is None for _ in range(2 * PATIENCE))
    assert [lasting.violation(math.nan) is not None for _ in range(PATIENCE)] == [False, False, True]


# -- frozen sensors -------------------------------------------------------------------------------

CHANNELS = ("column_displacement", "column_force")
NOISE = Plan().sensors.column_displacement
COUNT = Plan().safety.frozen_readings


def watched(
    displacements: object, plan: Plan | None = None, *, speed: float = NOISE
) -> tuple[int, Standstill | None]:
    """How many ticks it took, and what was found, with a command that moves by `speed` in every tick."""
    chosen = plan or Plan()
    guard = Frozen(vars(chosen.sensors), CHANNELS, "column_displacement", chosen.safety.frozen_readings)
    forces = np.random.default_rng(2).normal(0.0, 100.0, 10_000)
    for tick, value in enumerate(np.asarray(displacements).tolist()):
        if found := guard.violation((value, float(forces[tick])), tick * speed):
            return tick, found
    return len(np.asarray(displacements)), None


def noisy(count: int) -> np.ndarray:
    return np.random.default_rng(1).normal(0.0, NOISE, count)


def test_a_sensor_that_freezes_is_found_after_so_many_equal_readings() -> None:
    values = noisy(100)
    values[60:] = values[60]
    tick, found = watched(values)
    assert tick == 60 + COUNT - 1
    assert found == Standstill("column_displacement", values[60], COUNT)
    assert str(found).startswith("column_displacement is frozen: 25 readings in a row of ")
    tick, found = watched(values, with_table(Plan(), "safety", frozen_readings=7), speed=5.0 * NOISE)
    assert tick == 60 + 6


def test_a_sensor_that_goes_on_again_in_time_is_none() -> None:
    values = noisy(200)
    for first in (30, 60, 120):
        values[first : first + COUNT - 1] = values[first]
    assert watched(values) == (200, None)


def test_nothing_is_judged_while_the_command_rests() -> None:
    values = noisy(300)
    values[60:] = values[60]
    assert watched(values, speed=0.0) == (300, None)
    tick, found = watched(values, speed=NOISE / 10.0)
    assert found is not None
    assert tick == pytest.approx(60 + 10 * TRAVEL, abs=2)


def test_a_sensor_without_nominal_noise_may_repeat_itself() -> None:
    values = noisy(300)
    values[60:] = values[60]
    assert watched(values, with_table(Plan(), "sensors", column_displacement=0.0)) == (300, None)


@pytest.mark.parametrize("step", [2.0, 10.0, 100.0])
def test_a_sensor_with_steps_above_its_noise_may_repeat_itself(step: float) -> None:
    moving = noisy(5000) + 0.002 * np.sin(0.001 * np.arange(5000))
    quantum = step * NOISE
    values = quantum * np.floor(moving / quantum + 0.5)
    assert len(set(values.tolist())) > 1
    assert watched(values) == (5000, None)


@pytest.mark.parametrize("step", [0.1, 0.5, 0.9])
def test_a_sensor_with_steps_below_its_noise_does_not_and_is_judged(step: float) -> None:
    quantum = step * NOISE
    values = quantum * np.floor(noisy(8000) / quantum + 0.5)
    assert watched(values) == (8000, None)
    values[5000:] = values[4999]
    assert watched(values)[1] is not None


def test_a_rig_that_always_gives_the_same_has_no_noise_that_could_be_missed() -> None:
    assert watched(np.zeros(500)) == (500, None)
