"""Each limit stops the laboratory that would move, at its tick, before its rig sees the command."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InterlockError
from common.plan import read as plans
from common.plan.plan import Plan, ideal
from common.plan.read import from_tables, with_test
from common.plan.tables import Limits
from common.reality import reality
from common.reality.reality import Reality, from_reality
from common.recording.reader import read
from common.recording.run import Run
from common.terminal import cli
from laboratories.checks import CHANGE, LAST, PATIENCE, take_written
from loop import substructure
from loop.closed_loop import simulate
from loop.signals import signals
from master.building import Outputs
from master.step import MasterStep
from models import integrators
from simulation import virtual
from simulation.virtual import VirtualTest
from tests.helpers import largest, running, with_table, without_recorder

NO_LIMITS = dict.fromkeys(("error_energy", "numerical_drift", "column_error"), math.inf)

SERIES: dict[str, tuple[str, Callable[[dict[str, Any], float], Any]]] = {
    "velocity": ("master", lambda of, h: of["velocity"]),
    "acceleration": ("master", lambda of, h: of["acceleration"]),
    "actuator_command": ("master", lambda of, h: of["actuator_command"]),
    "actuator_step": ("master", lambda of, h: np.diff(of["actuator_command"], prepend=0.0)),
    "actuator_velocity": ("master", lambda of, h: np.diff(of["actuator_command"], prepend=0.0) / h),
    "actuator_acceleration": (
        "master",
        lambda of, h: np.diff(of["actuator_command"], 2, prepend=[0.0, 0.0]) / h**2,
    ),
    "column_error": ("master", lambda of, h: of["column_target"] - of["column_displacement"]),
    "table_target_velocity": ("master", lambda of, h: of["table_target_velocity"]),
    "table_target_acceleration": ("master", lambda of, h: of["table_target_acceleration"]),
    "table_velocity": ("slave", lambda of, h: np.diff(of["table_command"], prepend=0.0) / h),
    "table_step": ("slave", lambda of, h: np.diff(of["table_command"], prepend=0.0)),
    "table_error": (
        "slave",
        lambda of, h: np.concatenate([[0.0], of["table_target"][:-1]]) - of["table_displacement"],
    ),
    "damper_step": ("slave", lambda of, h: np.diff(of["damper_command"], prepend=0.0)),
}
LASTING = ("column_error", "table_error")


class Watched:
    """A rig that notes every command that it is given."""

    def __init__(self, rig: Any) -> None:
        self._rig = rig
        self.written: list[tuple[float, ...]] = []

    def write(self, command: Any) -> None:
        self.written.append(tuple(command))
        self._rig.write(command)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rig, name)


def played(chosen: Plan, real: Reality | None = None) -> tuple[VirtualTest, Any, dict[str, Watched]]:
    """Plays a test without a recorder to its end; its rigs are watched."""
    chosen = without_recorder(chosen)
    real = dataclasses.replace(real, plan=without_recorder(real.plan)) if real else reality.as_planned(chosen)
    bench = virtual.assemble(chosen, real, None)
    rigs = {}
    for role, loop in bench.loops.items():
        rigs[role] = Watched(loop._rig)
        loop._rig = rigs[role]  # type: ignore[assignment]
    return bench, virtual.run(bench, str), rigs


def first_beyond(values: Any, most: float, lasting: int) -> int:
    """The tick at which a series has been beyond a limit for this many ticks in a row."""
    beyond = np.abs(values) > most
    return next(
        tick for tick in range(lasting - 1, beyond.size) if beyond[tick - lasting + 1 : tick + 1].all()
    )


@pytest.fixture(scope="module")
def recording(virtual_recording: Path) -> Run:
    return read(virtual_recording)


@pytest.mark.parametrize("name", SERIES)
def test_a_limit_stops_its_laboratory_before_the_rig_sees_the_command(
    name: str, short_plan: Plan, recording: Run
) -> None:
    lab, series = SERIES[name]
    values = series(recording.columns[lab], short_plan.test.interval)
    most = 0.6 * largest(values)
    tick = first_beyond(values, most, PATIENCE if name in LASTING else 1)
    assert tick > 10
    bench, error, rigs = played(with_table(short_plan, "limits", **{name: most}))
    assert isinstance(error, InterlockError)
    assert str(error).startswith(f"{name} is {values[tick]:.6g}, beyond its limit of {most:g}")
    assert bench.loops[lab].ticks == tick + 1
    assert bench.loops[lab].lab.error is error
    written = np.array(rigs[lab].written)
    columns = ("actuator_command",) if lab == "master" else ("table_command", "damper_command")
    wanted = np.stack([recording.columns[lab][column] for column in columns], axis=1)
    assert np.array_equal(written[:tick], wanted[:tick])  # to the bit as without the limit
    assert all(np.array_equal(late, wanted[tick - 1]) for late in written[tick:])


def test_limits_that_are_not_reached_change_no_bit_of_a_test(short_plan: Plan, recording: Run) -> None:
    fields = {field.name: field for field in dataclasses.fields(Limits)}
    free = {name: math.inf for name, field in fields.items() if field.metadata["rule"].infinite}
    _, error, rigs = played(with_table(short_plan, "limits", **free))
    assert error is None
    assert np.array_equal(
        np.array(rigs["master"].written)[:, 0], recording.columns["master"]["actuator_command"]
    )


def test_every_slave_is_stopped_by_the_rate_limits_of_its_own_commands(tmp_path: Path) -> None:
    chosen = with_test(plans.load(cli.plan_path("two_dampers")), duration=2.0)
    path = tmp_path / "two.mcap"
    assert virtual.run(virtual.assemble(chosen, reality.as_planned(chosen), path), str) is None
    columns = read(path).columns
    steps = {role: np.abs(np.diff(columns[role]["damper_command"], prepend=0.0)) for role in chosen.roles}
    assert steps["slave.roof"].max() > steps["slave.middle"].max()
    most = 0.9 * float(steps["slave.roof"].max())
    bench, error, rigs = played(with_table(chosen, "limits", damper_step=most))
    tick = first_beyond(steps["slave.roof"], most, 1)
    assert bench.slaves["slave.roof"].lab.error is error
    assert str(error).startswith("damper_step is ")
    assert len(rigs["slave.roof"].written) == tick
    assert "damper_step" in str(bench.master.lab.error)
    assert "damper_step" in str(bench.slaves["slave.middle"].lab.error)


def test_a_limit_on_the_building_holds_for_every_storey(tmp_path: Path) -> None:
    chosen = with_test(plans.load(cli.plan_path("two_dampers")), duration=2.0)
    path = tmp_path / "storeys.mcap"
    assert virtual.run(virtual.assemble(chosen, reality.as_planned(chosen), path), str) is None
    for name in ("velocity", "acceleration"):
        storeys = np.abs(read(path).columns["master"][name])
        most = 0.5 * float(storeys[:, 0].max() + storeys[:, 2].max())  # beyond the reach of the first floor
        assert storeys[:, 0].max() < most
        bench, error, _ = played(with_table(chosen, "limits", **{name: most}))
        assert str(error).startswith(f"{name} is ")
        assert bench.master.ticks == first_beyond(storeys.max(axis=1), most, 1) + 1


def test_a_held_tick_counts_as_a_rate_of_zero(short_plan: Plan) -> None:
    bench = running(without_recorder(short_plan), 100)
    before = bench.master._command
    bench.world.time = bench.master.lab.tick_ns(101)  # a whole interval late
    bench.master.tick(100)
    assert bench.master._command == before
    checks = bench.master._limits._tick._checks
    take_written(checks)
    assert (checks.commands[LAST, :-1].tolist(), checks.commands[CHANGE, :-1].tolist()) == ([*before], [0.0])


# -- dangers ------------------------------------------------------------------------------------------


def nominal_peak(chosen: Plan) -> float:
    """Largest displacement of the pure simulation, m."""
    ground = substructure.ground_rows(chosen, substructure.motion(chosen))
    return largest(signals(chosen, simulate(ideal(chosen), ground))["displacement"])


@pytest.mark.parametrize("amd", [True, False])
@pytest.mark.parametrize("delay", [0.06, 0.08])
def test_a_loop_with_an_unstable_delay_is_stopped_before_the_building_moves_too_far(
    delay: float, amd: bool, default_plan: Plan
) -> None:
    chosen = with_table(with_test(default_plan, duration=10.0), "control", amd=amd)
    peaks = []
    real = from_reality({"actuator": {"delay": delay}}, chosen, Path())
    bench = virtual.assemble(
        without_recorder(chosen), dataclasses.replace(real, plan=without_recorder(real.plan)), None
    )
    check = bench.master._limits.violation

    def watched(measured: Any, wanted: Any, outputs: Any) -> Any:
        peaks.append(abs(outputs.storeys[0]))
        return check(measured, wanted, outputs)

    bench.master._limits.violation = watched  # type: ignore[method-assign]
    error = virtual.run(bench, str)
    assert isinstance(error, InterlockError)
    assert str(error).startswith("error_energy")
    assert max(peaks) < 1.5 * nominal_peak(chosen)


def test_a_slow_actuator_is_stopped_by_the_energy_it_feeds_in(default_plan: Plan) -> None:
    _, error, _ = played(
        default_plan, from_reality({"actuator": {"time_constant": 0.3}}, default_plan, Path())
    )
    assert str(error).startswith("error_energy")


class Leaping(MasterStep):
    """Commands that jump by 10 mm at tick 500."""

    def __call__(self, tick: int, *measured: Any) -> Outputs:
        outputs = super().__call__(tick, *measured)
        return outputs._replace(command=outputs.command + (0.01 if tick >= 500 else 0.0))


def test_a_step_of_ten_millimetres_is_never_written(short_plan: Plan) -> None:
    bench = virtual.assemble(
        without_recorder(short_plan), reality.as_planned(without_recorder(short_plan)), None
    )
    rig = Watched(bench.master._rig)
    bench.master._rig = rig  # type: ignore[assignment]
    bench.master._building.__class__ = Leaping
    error = virtual.run(bench, str)
    assert str(error).startswith("actuator_step is ")
    assert bench.master.ticks == 501
    assert largest(np.diff(np.array(rig.written)[:, 0])) < 1e-3


def test_a_diverging_integration_trips_the_energy_limit_long_before_the_displacement_limit(
    monkeypatch: Any,
) -> None:
    """Eight storeys whose highest mode is beyond the stability limit of the explicit method."""
    monkeypatch.setattr(integrators, "check_stability", lambda *_: None)
    tables = {
        "test": {"interval": 0.02, "duration": 20.0},
        "structure": {"mass": [1.6e5] * 8, "stiffness": [4.2e8] * 8, "damping": [4e5] * 8},
        "column": {"stiffness": 2.1e8},
        "actuator": {"delay": 0.0, "time_constant": 0.0},
        "compensator": {"kind": "none"},
        "control": {"amd": False},
    }
    chosen = from_tables(tables, Path())
    omega = 2.0 * math.sqrt(4.2e8 / 1.6e5) * math.sin(15.0 / 34.0 * math.pi)
    assert 2.0 < omega * chosen.test.interval < 2.1
    bench, error, _ = played(chosen)
    assert str(error).startswith("numerical_drift is ")
    unwatched, later, _ = played(
        with_table(chosen, "limits", **NO_LIMITS, velocity=math.inf, acceleration=math.inf)
    )
    assert later is not None
    assert bench.master.ticks < unwatched.master.ticks
