"""The energies that the master watches, compared with a closed form, a recording's indicator and the works."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan import read as plans
from common.plan.plan import Plan
from common.reality import reality
from common.recording.reader import read
from common.recording.run import Run
from common.rig import ColumnMeasurement
from common.terminal import cli
from loop.nominal.partition import matrices
from master.building import Outputs
from master.energy import EnergyMonitor, floor
from models import indicators
from models.energy_balance import ERROR
from simulation import virtual
from tests.helpers import largest, with_table

KINDS = ("newmark_explicit", "central_difference", "cr", "kr_alpha")


def outputs(target: float, displacement: Any = 0.0, velocity: Any = 0.0, acceleration: Any = 0.0) -> Outputs:
    motion = np.ravel([displacement, velocity, acceleration])
    return Outputs(0.0, target, 0.0, 0.0, [], [*motion.tolist(), *[0.0] * (2 * motion.size // 3)])


def replayed(chosen: Plan, run: Run) -> tuple[Any, Any]:
    """Error energy and numerical drift, tick by tick, of what a recording holds."""
    monitor, found = EnergyMonitor(chosen), []
    of = run.columns["master"]
    for tick in range(run.ticks("master")):
        motion = [of[name][tick].tolist() for name in ("displacement", "velocity", "acceleration")]
        computed = outputs(float(of["column_target"][tick]), *motion)
        computed = computed._replace(ground_acceleration=float(of["ground_acceleration"][tick]))
        measured = ColumnMeasurement(float(of["column_displacement"][tick]), float(of["column_force"][tick]))
        monitor.violation(measured, computed)
        found.append((monitor.error_energy, monitor.numerical_drift))
    shares = np.array(found)
    return shares[:, 0], shares[:, 1]


def recorded(chosen: Plan, path: Path) -> Run:
    error = virtual.run(virtual.assemble(chosen, reality.as_planned(chosen), path), str)
    assert error is None
    return read(path)


def given(chosen: Plan, run: Run) -> Any:
    """Energy of the ground (n,), J."""
    of = run.columns["master"]
    momentum = of["velocity"].reshape(run.ticks("master"), -1) @ np.array(chosen.structure.mass)
    return np.cumsum(-of["ground_acceleration"] * momentum) * chosen.test.interval


@pytest.mark.parametrize("delay", [0.012, 0.04, -0.01])
def test_the_error_energy_of_a_delayed_spring_agrees_with_the_closed_form(delay: float) -> None:
    amplitude, omega, stiffness, cycles = 2e-3, 2.0 * math.pi * 2.0, 12.5e6, 3
    chosen = Plan()
    monitor = EnergyMonitor(chosen)
    work = []
    for tick in range(round((cycles + 1) * 2.0 * math.pi / omega / chosen.test.interval) + 1):
        t = tick * chosen.test.interval
        got = amplitude * math.sin(omega * (t - delay))
        monitor.violation(ColumnMeasurement(got, stiffness * got), outputs(amplitude * math.sin(omega * t)))
        work.append(monitor._balance.sums[ERROR])
    cycle = math.pi * stiffness * amplitude**2 * math.sin(omega * delay)
    cycle *= chosen.column.represents / chosen.column.deformation_ratio
    each = round(2.0 * math.pi / omega / chosen.test.interval)
    assert np.diff(work[each::each]) == pytest.approx([cycle] * cycles, rel=1e-3)


def test_the_running_error_energy_equals_the_indicator_of_the_recording(tmp_path: Path) -> None:
    chosen = plans.with_test(plans.load(cli.plan_path("paper")), duration=6.0)
    run = recorded(chosen, tmp_path / "paper.mcap")
    of, column = run.columns["master"], chosen.column
    target, measured, force, energy = (
        np.concatenate([[0.0], values])  # from rest
        for values in (
            of["column_target"] / column.deformation_ratio,
            of["column_displacement"] / column.deformation_ratio,
            column.represents * of["column_force"],
            given(chosen, run),
        )
    )
    expected = indicators.hybrid_simulation_error_energy(target, measured, force, energy, floor(chosen))[1:]
    found, _ = replayed(chosen, run)
    assert largest(expected) > 0.05
    assert np.allclose(found, expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["default", "two_dampers"])
def test_the_energy_drift_is_the_balance_of_kinetic_energy_and_all_works(name: str, tmp_path: Path) -> None:
    chosen = plans.with_test(plans.load(cli.plan_path(name)), duration=3.0)
    run = recorded(chosen, tmp_path / "works.mcap")
    of, ticks = run.columns["master"], run.ticks("master")
    mass, damping, _ = matrices(chosen)
    x, v, numerical = (of[key].reshape(ticks, -1) for key in ("displacement", "velocity", "numerical_force"))
    storey = chosen.column.storey - 1
    forces = numerical.copy()
    forces[:, storey] += chosen.column.represents * of["column_force"]
    resisting = forces.copy()
    resisting[:, :-1] -= forces[:, 1:]
    load = -np.outer(of["ground_acceleration"], np.diag(mass))
    used = of["damper_force_used"].reshape(ticks, -1)
    for place, role in enumerate(chosen.roles):
        damper = chosen.of(role).damper
        load[:, damper.floor - 1] += damper.force_scale * used[:, place]
    net = resisting + v @ damping - load
    works = np.sum(0.5 * (net[1:] + net[:-1]) * np.diff(x, axis=0), axis=1)
    kinetic = 0.5 * np.einsum("ti,ij,tj->t", v, mass, v)
    balance = kinetic + np.concatenate([[0.0], np.cumsum(works)])
    share = balance / (floor(chosen) + np.maximum.accumulate(np.maximum(given(chosen, run), 0.0)))
    _, found = replayed(chosen, run)
    assert np.allclose(found, share, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["default", "two_dampers"])
def test_a_stable_integration_generates_no_energy(name: str, kind: str, tmp_path: Path) -> None:
    chosen = with_table(
        plans.with_test(plans.load(cli.plan_path(name)), duration=4.0), "structure", integrator=kind
    )
    _, drift = replayed(chosen, recorded(chosen, tmp_path / "stable.mcap"))
    assert largest(drift) < 0.01


def test_a_storey_without_stiffness_is_not_judged() -> None:
    chosen = with_table(Plan(), "structure", stiffness=0.0)
    chosen = dataclasses.replace(chosen, column=dataclasses.replace(chosen.column, stiffness=0.0))
    monitor = EnergyMonitor(chosen)
    assert monitor.violation(ColumnMeasurement(1.0, 1e5), outputs(0.0)) is None
    assert monitor.error_energy == monitor.numerical_drift == 0.0


def test_nan_exceeds_both_energy_limits() -> None:
    found = EnergyMonitor(Plan()).violation(ColumnMeasurement(0.0, math.nan), outputs(0.0))
    assert found is not None
    assert found.name == "error_energy"
    found = EnergyMonitor(Plan()).violation(ColumnMeasurement(0.0, 0.0), outputs(0.0, 0.0, math.nan))
    assert found is not None
