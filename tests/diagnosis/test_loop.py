"""A shaking table's servo loop found as a whole from its frequency response."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from diagnosis.fits import fitting, residuals
from diagnosis.fits.laws import loop
from diagnosis.fits.laws.loop_response import LoopResponse
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.recorded.record import Record
from diagnosis.signals.earlier import earlier
from laboratories.effects import CATALOGUE
from models.registry import Array
from tests.diagnosis.cases import Cases, imported, lab_b, white

STEP, FINER = 0.002, 20  # s, of the record, and steps of the truth in it
OMEGA, SECOND = 2.0 * math.pi * 9.0, 2.0 * math.pi * 4.2  # of the true loop, and of a mass on its platform
TICKS = np.asarray(np.arange(5000) * STEP, dtype=np.float64)


def wanted(t: Array) -> Array:
    """A motion of waves from 0.4 to 12 Hz, m."""
    draw = np.random.default_rng(8)
    waves = [
        np.sin(2.0 * np.pi * f * t + draw.uniform(0.0, 6.0)) / f**1.6 for f in np.geomspace(0.4, 12.0, 30)
    ]
    return np.asarray(5e-3 * np.sin(np.pi * t / TICKS[-1]) ** 2 * np.sum(waves, axis=0))


def shaken() -> Array:
    """Displacement (m) and acceleration (m/s²) of a table as its equations say, (ticks, 2).

    Velocity and acceleration are fed forward to its loop by 90 % and 60 %, and 30 % of the mass that the loop moves
    swing on the platform.
    """
    ahead = np.array([1.0, 0.1 * SECOND, SECOND**2])
    loop_ = np.array([0.7, 1.4 * OMEGA, OMEGA**2])
    pull = 0.3 * np.array([0.1 * SECOND, SECOND**2, 0.0, 0.0])  # over the mass's motion
    below = np.polyadd(np.polymul(loop_, ahead), pull)
    above = np.polymul([0.6, 0.9 * 1.4 * OMEGA, OMEGA**2], ahead)
    t = np.asarray(np.arange(TICKS.size * FINER) * STEP / FINER, dtype=np.float64)
    _, moved, _ = signal.lsim((above, below), wanted(t), t)
    rate = np.gradient(moved, t)
    return np.column_stack([moved, np.gradient(rate, t)])[::FINER]


def table(whole: Record, command: Array, read: Array) -> LaboratoryPart:
    """The table of a record under another command, with other readings."""
    part = lab_b(whole)
    measured = part.measured.copy()
    measured[:, :2] = read + white(5, *read.shape) * (5e-6, 0.01)
    inputs = {name: 0.0 * values for name, values in part.inputs.items()}
    inputs[next(iter(inputs))] = np.append(command[1:], command[-1])  # reached at the end of its interval
    there = part.present & np.array([True, True, False, False])
    return part.replaced(inputs=inputs, measured=measured * there, present=there)


def test_spectra_are_predicted_as_a_replay_is(cases: Cases) -> None:
    part = table(cases.record(), wanted(TICKS), np.zeros((TICKS.size, 2)))
    system = residuals.prepare(part, cases.record()).system
    effects = {
        "table.bandwidth": {"factor": 0.8},
        "table.feed_forward": {"velocity": 0.5, "acceleration": 0.3, "lag": 0.004, "law": 1.0},
        "table.oil_column": {"frequency": 18.0, "damping": 0.2},
        "table.second_mass": {"frequency": 5.0, "share": 0.2, "damping": 0.05},
        "sensor.table_acceleration.delay": {"delay": 0.003},
        "sensor.table_displacement.lag": {"time_constant": 0.004},
    }
    for name, values in effects.items():
        system = CATALOGUE[name].apply(system, **values)
    found = LoopResponse(part, STEP)
    lines = [found.spectrum(column) for column in part.predict(system)[:, :2].T]
    replayed = np.stack([np.concatenate([line.real, line.imag]) for line in lines], axis=1)
    apart = np.linalg.norm(found.predict(system) - replayed, axis=0) / np.linalg.norm(replayed, axis=0)
    assert np.all(apart < (0.002, 0.08))


@pytest.mark.slow
def test_a_loop_with_feed_forward_under_a_swinging_mass_is_found_as_a_whole(cases: Cases) -> None:
    whole, command = cases.record(), wanted(TICKS)
    data = residuals.prepare(table(whole, command, shaken()), whole)
    bare = fitting.fit(data, {})
    (found,) = loop.whole_loops(bare, [bare])
    assert {"table.feed_forward", "table.second_mass"} < set(loop.of_one_loop(found))
    assert found.values["table.second_mass"]["frequency"] == pytest.approx(4.2, rel=0.02)
    assert loop.missed(found) < 0.05 * loop.missed(bare)


def test_no_loop_is_looked_for_where_little_is_left(cases: Cases) -> None:
    whole = cases.record()
    bare = fitting.fit(residuals.prepare(lab_b(whole), whole), {})
    assert loop.whole_loops(bare, [bare]) == []


def by_itself(whole: Record) -> Record:
    """The record as an import of the table alone, with this command and no reading of the damper."""
    given, command = imported(whole), wanted(TICKS)
    kept = {name: given.signals[name] for name in ("table_displacement", "table_acceleration")}
    signals = kept | {"table_command": np.resize(command, given.ticks)}
    return replace(given, signals=signals, run=replace(given.run, columns={}))


@pytest.mark.parametrize("spectra", [False, True])
def test_a_table_that_was_logged_alone_follows_a_command_that_bends_between_the_rows(
    cases: Cases, spectra: bool
) -> None:
    alone = by_itself(cases.record())
    part = lab_b(alone)
    assert part.steps == 2
    system = alone.systems[part.role]
    omega, damping = 2.0 * math.pi * system.plan.table.frequency, system.plan.table.damping_ratio
    t = np.asarray(np.arange(TICKS.size * FINER) * STEP / FINER, dtype=np.float64)
    moved = signal.lsim(([omega**2], [1.0, 2.0 * damping * omega, omega**2]), wanted(t), t)[1]
    truth = np.column_stack([moved, np.gradient(np.gradient(moved, t), t)])[::FINER]
    late = system.plan.table.delay / STEP
    truth = np.column_stack([earlier(column, -late) for column in truth.T])[: alone.ticks]
    inside = slice(100, TICKS.size - 100)
    if spectra:
        found = LoopResponse(part, STEP)
        lines = [found.spectrum(column) for column in part.predict(system)[:, :2].T]
        replayed = np.stack([np.concatenate([line.real, line.imag]) for line in lines], axis=1)
        apart = np.linalg.norm(found.predict(system) - replayed, axis=0) / np.linalg.norm(replayed, axis=0)
        assert np.all(apart < (0.002, 0.08))
    else:
        apart = np.std((part.predict(system)[:, :2] - truth)[inside], axis=0) / np.std(truth[inside], axis=0)
        assert np.all(apart < (2e-5, 3e-4))


def test_of_a_damper_without_readings_no_parameter_moves(cases: Cases) -> None:
    part = lab_b(by_itself(cases.record()))
    assert {item.parameter.partition(".")[0] for item in part.nuisances if not item.of_record} == {"table"}
