"""One part alone under its recorded input gives the readings of the whole test."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from common.plan.plan import Plan
from common.plan.read import with_test
from laboratories.column.kind import COLUMN
from laboratories.effects import CATALOGUE, lay
from laboratories.effects.effect import Effect
from laboratories.table.kind import TABLE
from loop import replay, substructure
from loop.closed_loop import Rollout, simulate
from loop.signals import signals
from models import indicators
from models.system import ColumnEffects, Effects, System
from tests.laboratories.effects.distinct import DISTINCT

Array = NDArray[np.float64]

EACH = pytest.mark.parametrize("effect", DISTINCT.values(), ids=list(DISTINCT))
IN_SHORT_STEPS = ("viscous", "friction", "inertia")  # of the column: rates count


@pytest.fixture(scope="module")
def plan(default_plan: Plan) -> Plan:
    return with_test(default_plan, duration=3.0)


def ground(system: System) -> Array:
    motion = substructure.motion(system.plan)
    return substructure.ground_rows(system.plan, motion, system.effects.time_shift)


def rollout(system: System) -> Rollout:
    return simulate(system.plan, ground(system), effects=system.effects)


def measured(found: Rollout) -> tuple[Array, Array]:
    """Displacement and force of the column as read."""
    displacement, force = (np.ascontiguousarray(found.master[name]) for name in COLUMN.channels.names)
    return displacement, force


def driven(command: Array, motor: Array | float = 0.0) -> Array:
    """Commands of a laboratory as the replay takes them."""
    return np.stack([command, np.broadcast_to(motor, command.shape)], axis=1)


def alone(system: System, found: Rollout) -> tuple[Array, Array]:
    """Both laboratories alone, under the commands that they had in the loop."""
    slave = found.slaves["slave"]
    return (
        replay.laboratory(COLUMN, system, driven(found.master["actuator_command"])),
        replay.laboratory(TABLE, system, driven(slave["table_command"], found.master["damper_command"])),
    )


def assert_computed(system: System, found: Rollout) -> None:
    """The building alone computes to the last bit what it computed in the loop."""
    dampers = np.ascontiguousarray(found.master["damper_force_used"])
    got = replay.building(system, ground(system), *measured(found), dampers)
    for name, values in got.items():
        assert np.array_equal(values, found.master[name]), name


def strong(effect: Effect) -> dict[str, float]:
    """Parameters with the strongest sizes and the default shapes."""
    item = next(item for item in effect.parameters if not item.shape)
    null = 0.0 if math.isinf(item.null) else item.null
    sizes = sorted(item.sizes, key=lambda size: abs(size - null))
    return {item.name: sizes[0] if math.isinf(item.null) else sizes[-1]}


@EACH
def test_each_laboratory_alone_gives_the_readings_of_the_loop_to_the_last_bit(
    effect: Effect, plan: Plan
) -> None:
    system = lay(System(plan), [(effect.name, strong(effect))])
    found = rollout(system)
    assert found.finite
    a, b = alone(system, found)
    assert a.tobytes() == np.column_stack(measured(found)).tobytes()
    assert (
        b.tobytes()
        == np.column_stack([found.slaves["slave"][name] for name in TABLE.channels.names]).tobytes()
    )


@EACH
def test_the_building_alone_computes_the_same_as_in_the_loop(effect: Effect, plan: Plan) -> None:
    system = lay(System(plan), [(effect.name, strong(effect))])
    found = rollout(system)
    assert_computed(system, found)


def test_a_building_of_three_storeys_alone_computes_the_same_as_in_the_loop(plan: Plan) -> None:
    tables = {"mass": (1.6e5,) * 3, "stiffness": (9e7,) * 3, "damping": (4e5,) * 3}
    system = System(plan).moved("structure", **tables).moved("column", storey=2).moved("damper", floor=3)
    system = lay(system, [("structure.p_delta", {"stiffness": -1e6}), ("ground.time_shift", {"shift": 0.01})])
    found = rollout(system)
    assert_computed(system, found)


def rest(system: System, force: Array, displacement: Array) -> float:
    """Rms of the difference between the specimen's force and that of the plan's linear model."""
    return float(np.std(force - system.plan.column.stiffness * displacement))


@pytest.mark.parametrize(
    "name",
    [name for name in CATALOGUE if name.startswith("column.") and name.split(".")[1] not in IN_SHORT_STEPS],
)
def test_the_specimen_alone_has_the_same_force_as_in_the_loop(name: str, plan: Plan) -> None:
    """The forces are equal to rounding where they depend on the deformation only."""
    system = lay(System(plan), [(name, strong(CATALOGUE[name]))])
    found = rollout(system)
    displacement, force = measured(found)
    got = replay.column(system, displacement)
    assert np.allclose(got, force, rtol=1e-9, atol=1e-6 * np.max(np.abs(force)))


@pytest.mark.parametrize(
    ("effects", "share"),
    [
        (ColumnEffects(viscous=40e3), 0.02),
        (ColumnEffects(friction=900.0), 0.02),
        (ColumnEffects(friction=900.0, friction_velocity=0.003), 0.02),
        pytest.param(
            ColumnEffects(inertia=2000.0),
            0.2,
            marks=pytest.mark.xfail(
                strict=True, reason="straight lines between ticks have no acceleration there"
            ),
        ),
    ],
    ids=["viscous", "friction", "falling friction", "inertia"],
)
def test_the_specimen_alone_with_rates_from_the_ticks_has_nearly_the_force_of_the_loop(
    effects: ColumnEffects, share: float, plan: Plan
) -> None:
    """Rates come from straight lines between the ticks: near what the servo loop's finer motion gave."""
    system = System(plan, Effects(column=effects))
    found = rollout(system)
    displacement, force = measured(found)
    got = replay.column(system, displacement)
    assert np.std(got - force) < share * rest(system, force, displacement)


def test_the_forces_of_mass_and_dashpot_follow_from_the_motion_of_the_whole_test(plan: Plan) -> None:
    """Against derivatives written out, to the error of central differences, through a load cell with a gain."""
    mass, damping, omega, dt = 2000.0, 5e4, 2.0 * math.pi * 3.0, plan.test.interval
    system = System(plan).moved("column", mass=mass, damping=damping)
    system = lay(system, [("sensor.column_force.gain", {"factor": 1.07})])
    t = dt * np.arange(2000)
    got = replay.column(system, 1e-3 * np.sin(omega * t))
    stiffness = plan.column.stiffness - mass * omega**2
    wanted = 1.07e-3 * (stiffness * np.sin(omega * t) + damping * omega * np.cos(omega * t))
    scale = 1.07e-3 * (mass * omega**2 + damping * omega)
    assert np.max(np.abs(got - wanted)[2:-2]) < 0.5 * (omega * dt) ** 2 * scale


def test_a_column_with_a_dashpot_alone_has_nearly_the_same_force_as_in_the_loop(plan: Plan) -> None:
    """The loop computes in short steps, the replay with differences over the ticks."""
    system = System(plan).moved("column", damping=5e4)
    found = rollout(system)
    displacement, force = measured(found)
    got = replay.column(system, displacement)
    assert np.std(got - force) < 2e-4 * np.std(force)
    path = indicators.force_path(got, force, plan.test.interval)
    assert path.delay == pytest.approx(0.0, abs=2e-6)


def test_the_specimen_alone_is_read_through_its_load_cell(plan: Plan) -> None:
    system = lay(
        System(plan),
        [
            ("sensor.column_force.gain", {"factor": 1.07}),
            ("sensor.column_force.lag", {"time_constant": 0.008}),
            ("sensor.column_force.bias", {"offset": 300.0}),
            ("sensor.column_force.drift", {"rate": 30.0}),
            ("sensor.column_force.quantization", {"step": 100.0}),
        ],
    )
    found = rollout(system)
    got = replay.column(system, measured(found)[0])
    # the loop's deformation is that of the ticks too, so rounding to a step can differ by rounding only
    assert np.mean(got == found.master["column_force"]) > 0.999
    assert np.max(np.abs(got - found.master["column_force"])) <= 100.0 + 1e-6


def test_a_laboratory_that_begins_at_a_constant_command_stays_there(plan: Plan) -> None:
    got = replay.laboratory(COLUMN, System(plan), driven(np.full(50, 2e-3)), 2e-3)
    assert np.allclose(got[:, 0], 2e-3, rtol=1e-12)
    assert np.allclose(got[1:, 1], 12.5e6 * 2e-3, rtol=1e-12)


@pytest.mark.parametrize("tick", [0, 40])
def test_a_damper_released_from_a_stroke_vibrates_freely(tick: int, plan: Plan) -> None:
    anew, none = np.array([[tick, 0.03, 0.1]]), np.zeros(800)
    got = replay.laboratory(TABLE, System(plan), driven(none), 0.0, anew)[:, 2]
    assert not got[:tick].any()
    natural, rate = math.sqrt(56.8 / 16.0), 6.0 / 32.0
    damped, t = math.sqrt(natural**2 - rate**2), plan.test.interval * np.arange(800 - tick)
    swing = 0.03 * np.cos(damped * t) + (0.1 + rate * 0.03) / damped * np.sin(damped * t)
    assert np.allclose(got[tick:], np.exp(-rate * t) * swing, atol=1e-12)


def test_the_noise_alone_lies_between_a_noisy_loop_and_its_replay(plan: Plan) -> None:
    found = simulate(plan, ground(System(plan)), seed=8)
    system = System(plan)
    a, b = alone(system, found)
    nominal = signals(plan, found)
    for name, truth in (
        ("column_displacement", a[:, 0]),
        ("column_force", a[:, 1]),
        ("table_displacement", b[:, 0]),
        ("table_acceleration", b[:, 1]),
        ("damper_stroke", b[:, 2]),
        ("damper_force", b[:, 3]),
    ):
        residual = nominal[name] - truth
        assert residual.std() == pytest.approx(getattr(plan.sensors, name), rel=0.06), name
        neighbours = np.corrcoef(residual[1:], residual[:-1])[0, 1]
        assert abs(neighbours) < 4.0 / math.sqrt(residual.size), name
