"""Recordings through a logger: forces with noise of their own, and coloured noise beside effects that look like it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from diagnosis.diagnose import own_noise
from diagnosis.findings import how_far, verdict
from diagnosis.findings.found import Diagnosis
from diagnosis.fits import residuals
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search, search
from diagnosis.recorded.parts import Building, LoggedBuilding, earlier
from diagnosis.recorded.record import Record
from diagnosis.report.records import HowFar
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_a, white

LEVEL = 200.0  # N
LATE = 2  # ticks


def relogged(whole: Record, name: str, values: Array) -> Record:
    """The record with another reading."""
    return replace(whole, signals=whole.signals | {name: values})


def logged(whole: Record) -> residuals.Data:
    """Its building by the balance of its forces."""
    part = Building(whole).logged()
    assert part is not None
    return residuals.prepare(part, whole)


def noisy(whole: Record, colour: float = 0.0) -> Record:
    """The record with noise of a logger on the force, each sample so much of the one before, which comes late."""
    force = whole.signals["column_force"]
    noise = signal.lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], white(21, force.size))
    late = np.concatenate([np.full(LATE, force[0]), force[:-LATE]])
    return relogged(whole, "column_force", late + LEVEL * noise)


def test_forces_with_noise_of_their_own_came_through_a_logger(cases: Cases) -> None:
    whole = cases.record()
    assert not own_noise(logged(whole))
    assert not own_noise(logged(cases.record({"structure.mass": {"factor": 1.1}})))
    assert own_noise(logged(noisy(whole)))


@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_a_logger_tells_its_delay_and_its_noise_is_no_gap(cases: Cases, colour: float) -> None:
    found = search(logged(noisy(cases.record(), colour)), Scales(cases.record()))
    assert found.chosen.names == ()
    assert isinstance(found.data.part, LoggedBuilding)
    assert found.data.part.late(found.chosen.z) == pytest.approx(LATE * 0.002, abs=1e-3)
    assert found.chosen.prior < 9.0  # neither gain nor delay makes the noise smaller, so none is pulled away


def test_a_delay_keeps_the_level_of_noise() -> None:
    noise = white(22, 4000)
    assert np.std(earlier(noise, 0.5)) == pytest.approx(np.std(noise), rel=0.01)
    wave = np.sin(2.0 * np.pi * np.arange(4000) / 250.0)
    assert earlier(wave, 10.0)[100:-100] == pytest.approx(wave[110:-90], abs=1e-3)


def in_column(whole: Record, values: Array) -> Search:
    """What is found in the master's laboratory with something more in the displacement."""
    name = "column_displacement"
    changed = relogged(whole, name, whole.signals[name] + values)
    return search(residuals.prepare(lab_a(changed), changed), Scales(changed))


@pytest.fixture(scope="module")
def drifting(cases: Cases) -> Search:
    """A displacement that drifts."""
    whole = cases.record()
    return in_column(whole, 3e-6 * whole.time)


def test_a_drift_is_no_slow_noise(drifting: Search) -> None:
    found = drifting
    assert found.chosen.names == ("sensor.column_displacement.drift",)
    assert found.chosen.values["sensor.column_displacement.drift"]["rate"] == pytest.approx(3e-6, rel=0.15)


def test_slow_noise_is_no_drift(cases: Cases) -> None:
    whole = cases.record()
    noise = signal.lfilter([1.0], [1.0, -0.95], white(23, whole.ticks))
    assert in_column(whole, 5e-6 * noise).chosen.names == ()


def test_a_motion_that_several_sensors_see_is_no_pickup(cases: Cases) -> None:
    whole = cases.record()
    motion = 2e-5 * np.sin(2.0 * np.pi * 11.3 * whole.time)
    alone = in_column(whole, motion)
    assert list(alone.data.noise[0].lines) == pytest.approx([11.3], abs=0.02)
    stiffness = whole.plan.column.stiffness
    moved = relogged(whole, "column_force", whole.signals["column_force"] + stiffness * motion)
    both = in_column(moved, motion)
    assert all(item.lines == () for item in both.data.noise)
    assert verdict.judge(both).outcome == "unknown"


def test_nominal_parameters_that_are_all_far_off_speak_against_an_effect(drifting: Search) -> None:
    far = replace(drifting.chosen, z=np.full(drifting.chosen.z.size, 2.9))
    assert verdict.certainty(drifting) > 0.9
    assert verdict.certainty(replace(drifting, chosen=far)) < 0.5
    worse = replace(far, reduced=far.reduced + 1.0)
    assert verdict.judge(replace(drifting, chosen=worse)).outcome == "unknown"


def test_what_hardly_closes_the_gap_explains_nothing(cases: Cases, drifting: Search) -> None:
    whole = cases.record()
    found = Diagnosis(whole, verdicts=[verdict.judge(drifting)])
    far = HowFar(
        nominal=0.1,
        before=0.1,
        after=0.08,
        closed=0.2,
        closed_interval=None,
        noise_floor=0.01,
        judged_on="other recordings",
    )
    assert not how_far.shrinks(found, far)
    assert how_far.shrinks(found, replace(far, closed=0.8))
    assert how_far.shrinks(Diagnosis(whole), far)
