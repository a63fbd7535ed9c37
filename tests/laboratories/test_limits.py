"""Limits on values, on rates of written commands, on lasting errors, on frozen sensors, and on NaN and inf."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from common.plan.limits import LimitViolation, Standstill
from common.plan.plan import Plan
from common.plan.tables import Limits
from laboratories.checks import NONE, PATIENCE, TRAVEL
from laboratories.column.kind import COLUMN
from laboratories.kind import Kind
from laboratories.limits import Limit, TickLimits, first_beyond, limited, of_commands, of_readings
from laboratories.table.kind import TABLE
from tests.helpers import with_table

INTERVAL = Plan().test.interval
RATES = ("actuator_step", "actuator_velocity", "actuator_acceleration")


def tick_limits(kind: Kind, plan: Plan) -> TickLimits:
    """The limits on what a laboratory reads and is written."""
    readings = of_readings(kind, plan)
    return TickLimits(kind, plan, [*readings, *of_commands(kind, plan)], commands=len(readings))


class Actuator:
    """The limits of a column whose readings are zero, with rates that are limited where `most` says so."""

    def __init__(self, **most: float) -> None:
        limits = Limits(**dict.fromkeys(RATES, math.inf) | most)
        self._limits = tick_limits(COLUMN, replace(Plan(), limits=limits))

    def violation(self, command: float, error: float = 0.0) -> LimitViolation | Standstill | None:
        return self._limits.violation(error, 0.0, 0.0, command)

    def written(self, command: float) -> None:
        self._limits.written((command,))


# -- values ---------------------------------------------------------------------------------------


def test_limits_apply_by_name_and_refuse_nan() -> None:
    limits = limited(vars(Limits(column_force=10.0)), COLUMN.channels.names)
    assert first_beyond(limits, (0.0, 10.0)) is None
    assert str(first_beyond(limits, (0.0, -10.1))) == "column_force is -10.1, beyond its limit of 10 N."
    assert "column_displacement is nan" in str(first_beyond(limits, (math.nan, 0.0)))
    assert limited({}, ("other",)) == [Limit("other", NONE)]
    assert first_beyond(limited({}, ("other",)), (math.nan,)) is None


def test_the_check_of_a_tick_names_the_first_value_beyond_its_limit() -> None:
    limits = tick_limits(COLUMN, replace(Plan(), limits=Limits(column_force=10.0, actuator_step=1e-3)))
    assert limits.violation(0.0, 0.0, -10.0, 0.0) is None
    assert limits.violation(0.0, 0.0, -10.1, 2e-3) == LimitViolation("column_force", -10.1, 10.0, "N")
    assert limits.violation(0.0, 0.0, 9.0, 2e-3) == LimitViolation("actuator_step", 2e-3, 1e-3, "m")
    found = limits.violation(0.0, 0.0, math.nan, 0.0)
    assert isinstance(found, LimitViolation)
    assert (found.name, math.isnan(found.value)) == ("column_force", True)


def test_a_master_without_a_laboratory_has_only_the_limits_on_its_values() -> None:
    limits = TickLimits(None, Plan(), [Limit("velocity", 1.0), Limit("none", NONE)], commands=0)
    assert limits.violation(0.0, 1.0, math.nan) is None
    limits.written(())
    assert limits.violation(0.0, -1.1, 0.0) == LimitViolation("velocity", -1.1, 1.0)
    assert limits.standing(()) == ""


# -- changes and lasting errors -------------------------------------------------------------------


def test_the_first_commands_rate_is_measured_from_rest_at_zero() -> None:
    assert Actuator(actuator_step=1e-3).violation(1e-3) is None
    assert Actuator(actuator_step=1e-3).violation(-1.01e-3) == LimitViolation(
        "actuator_step", -1.01e-3, 1e-3, "m"
    )
    for name, most, value in (
        ("actuator_velocity", 0.5, 0.55),
        ("actuator_acceleration", 250.0, 275.0),
    ):
        found = Actuator(**{name: most}).violation(1.1e-3)
        assert isinstance(found, LimitViolation)
        assert (found.name, found.limit) == (name, most)
        assert found.value == pytest.approx(value)


def test_rates_are_measured_between_written_commands() -> None:
    change = Actuator(actuator_step=1e-3, actuator_acceleration=400.0)
    change.written(1e-3)
    assert change.violation(2.0e-3) is None
    assert change.violation(2.1e-3) is not None
    assert change.violation(2.1e-3) is not None  # nothing was written: it stays as far away
    change.written(1e-3)  # held
    found = change.violation(-0.7e-3)
    assert isinstance(found, LimitViolation)
    assert found.name == "actuator_step"
    assert found.value == pytest.approx(-1.7e-3)


def test_an_acceleration_is_the_second_difference() -> None:
    change = Actuator(actuator_acceleration=100.0)
    for command in (1e-4, 3e-4, 6e-4):
        assert change.violation(command) is None
        change.written(command)
    assert change.violation(9e-4) is None  # as fast as before
    found = change.violation(4e-4)
    assert isinstance(found, LimitViolation)
    assert found.value == pytest.approx((4e-4 - 2 * 6e-4 + 3e-4) / INTERVAL**2)


def test_a_motors_force_is_limited_in_its_step_only() -> None:
    motor = tick_limits(TABLE, replace(Plan(), limits=Limits(damper_step=10.0)))
    at_rest = (0.0,) * len(TABLE.channels.names)
    assert motor.violation(0.0, *at_rest, 0.0, 10.0) is None
    assert motor.violation(0.0, *at_rest, 0.0, 10.1) == LimitViolation("damper_step", 10.1, 10.0, "N")


def test_a_tracking_error_trips_when_it_lasts() -> None:
    column = Actuator(column_error=0.01)
    errors = [0.011, -0.02, 0.01, 0.011, -0.011, 0.012, 0.013]
    found = [column.violation(0.0, error) for error in errors]
    assert [violation is not None for violation in found] == [False] * 5 + [True] * 2
    assert found[5] == LimitViolation("column_error", 0.012, 0.01, "m")


def test_nan_exceeds_any_limit_and_only_nan_exceeds_an_infinite_one() -> None:
    column = Actuator(column_error=math.inf, actuator_command=math.inf)
    assert column.violation(1e300) is None
    assert all(column.violation(0.0, 1e9) is None for _ in range(2 * PATIENCE))
    assert [column.violation(0.0, math.nan) is not None for _ in range(PATIENCE)] == [False, False, True]
    assert Actuator().violation(math.nan) is not None


# -- frozen sensors -------------------------------------------------------------------------------

NOISE = Plan().sensors.column_displacement
COUNT = Plan().safety.frozen_readings


def watched(
    displacements: object, plan: Plan | None = None, *, speed: float = NOISE
) -> tuple[int, Standstill | None]:
    """The number of ticks read and the violation found, with a command that moves by `speed` in every tick."""
    chosen = replace(plan or Plan(), limits=Limits(column_error=math.inf))
    limits = tick_limits(COLUMN, chosen)
    forces = np.random.default_rng(2).normal(0.0, 100.0, 10_000)
    for tick, value in enumerate(np.asarray(displacements).tolist()):
        limits.written((tick * speed,))
        if found := limits.violation(0.0, value, float(forces[tick]), tick * speed):
            assert isinstance(found, Standstill)
            return tick, found
    return len(np.asarray(displacements)), None


def noisy(count: int) -> np.ndarray:
    return np.random.default_rng(1).normal(0.0, NOISE, count)


def test_a_sensor_that_freezes_is_found_after_the_set_number_of_equal_readings() -> None:
    values = noisy(100)
    values[60:] = values[60]
    tick, found = watched(values)
    assert tick == 60 + COUNT - 1
    assert found == Standstill("column_displacement", values[60], COUNT)
    assert str(found).startswith("column_displacement is frozen: 25 readings in a row of ")
    tick, found = watched(values, with_table(Plan(), "safety", frozen_readings=7), speed=5.0 * NOISE)
    assert tick == 60 + 6


def test_a_sensor_that_resumes_in_time_does_not_count_as_frozen() -> None:
    values = noisy(200)
    for first in (30, 60, 120):
        values[first : first + COUNT - 1] = values[first]
    assert watched(values) == (200, None)


def test_a_sensor_is_not_checked_for_freezing_while_the_command_rests() -> None:
    values = noisy(300)
    values[60:] = values[60]
    assert watched(values, speed=0.0) == (300, None)
    tick, found = watched(values, speed=NOISE / 10.0)
    assert found is not None
    assert tick == pytest.approx(60 + 10 * TRAVEL, abs=2)


def test_a_sensor_without_nominal_noise_may_repeat_readings() -> None:
    values = noisy(300)
    values[60:] = values[60]
    assert watched(values, with_table(Plan(), "sensors", column_displacement=0.0)) == (300, None)


@pytest.mark.parametrize("step", [2.0, 10.0, 100.0])
def test_a_sensor_with_rounding_above_its_noise_may_repeat_readings(step: float) -> None:
    moving = noisy(5000) + 0.002 * np.sin(0.001 * np.arange(5000))
    quantum = step * NOISE
    values = quantum * np.floor(moving / quantum + 0.5)
    assert len(set(values.tolist())) > 1
    assert watched(values) == (5000, None)


@pytest.mark.parametrize("step", [0.1, 0.5, 0.9])
def test_a_sensor_with_rounding_below_its_noise_is_checked_for_freezing(step: float) -> None:
    quantum = step * NOISE
    values = quantum * np.floor(noisy(8000) / quantum + 0.5)
    assert watched(values) == (8000, None)
    values[5000:] = values[4999]
    assert watched(values)[1] is not None


def test_a_rig_whose_readings_never_change_is_not_taken_for_frozen() -> None:
    assert watched(np.zeros(500)) == (500, None)
