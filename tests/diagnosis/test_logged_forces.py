"""What a logger does to forces that a building used: delays before or behind its master, and zeros that drift."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from common.recording.imported import IMPORT, ImportedChannel, ImportedData
from common.roles import MASTER
from diagnosis.fits import fitting, residuals
from diagnosis.fits.unexplained import leaves
from diagnosis.recorded.building import logged_building
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.record import Record
from models.registry import Array
from tests.diagnosis.cases import Cases


@pytest.mark.parametrize(("before", "late"), [(True, 8), (True, 1), (False, 8), (False, 1)], ids=str)
def test_a_stated_delay_lies_before_the_master_or_behind_it(before: bool, late: int) -> None:
    """What a balance leaves is the noise of the motion less that of the recorded force."""
    rng = np.random.default_rng(late)
    motion, force = rng.normal(size=(2, 20_000))
    used = motion if before else force  # a master that read the force with this noise moved by it
    plain = (motion - used)[:, None] + 0.1 * rng.normal(size=(motion.size, 1))
    behind = plain + (np.roll(motion, late) - motion)[:, None]
    assert logged_building.before_master(plain, behind) == before


def test_a_zero_of_a_logged_force_may_be_off_and_drift_below_its_noise(cases: Cases) -> None:
    whole = cases.record()
    noise, share = whole.planned_noise["column_force"], np.linspace(0.0, 1.0, whole.ticks)
    force = whole.signals["column_force"] + noise * (0.6 * share - 0.15)
    drifting = replace(whole, signals=whole.signals | {"column_force": force})
    data = residuals.prepare(LoggedBuilding(Building(drifting)), drifting)
    fit = fitting.fit(data, {})
    found = {one.parameter: float(z) for one, z in zip(data.part.nuisances, fit.z, strict=True)}
    assert found["bias"] == pytest.approx(-0.5, abs=0.2)
    assert found["drift"] == pytest.approx(1.0, abs=0.2)
    assert not leaves(fit)


def test_numbers_that_were_logged_slowly_have_no_noise_beyond_half_their_rate(cases: Cases) -> None:
    whole = cases.record()
    building = Building(whole)
    assert LoggedBuilding(building).passes == pytest.approx([np.inf])
    slow = ImportedChannel(interpolated=True, rate=256.0)
    building.channels = (slow, *building.channels[1:])
    assert LoggedBuilding(building).passes == pytest.approx([128.0])


def with_ground(whole: Record, ground: Array, rate: float, *, followed: bool = True) -> Record:
    """The record as imported, with a ground motion (ticks,) that a logger read at a rate (Hz)."""
    channel = ImportedChannel(interpolated=True, rate=rate, followed=followed)
    stated = ImportedData("", channels={MASTER: {"ground_acceleration": channel}})
    run = replace(whole.run, metadata=whole.run.metadata | {IMPORT: stated.metadata()})
    return replace(whole, run=run, signals=whole.signals | {"ground_acceleration": ground})


@pytest.mark.parametrize("followed", [True, False])
def test_a_ground_motion_between_the_ticks_of_a_slow_logger_is_as_the_motion_is_there(
    followed: bool, cases: Cases
) -> None:
    """The balance of a building holds of numbers that one spline has, and of none that an import followed."""
    whole, rate = cases.record(), 256.0
    channel = ImportedChannel(interpolated=True, rate=rate)
    seen = channel.seen(whole.ticks, 2e-3)
    assert np.all(seen == np.unique(np.floor(np.arange(seen.size) / rate / 2e-3 + 1e-9)))

    def between(values: Array) -> Array:
        return np.asarray(CubicSpline(seen, values[seen])(np.arange(whole.ticks)))

    ground = whole.signals["ground_acceleration"]
    read = ground if followed else between(ground)
    here = Building(with_ground(whole, read, rate, followed=followed)).ground
    assert here == pytest.approx(between(ground), abs=1e-6 * float(np.std(ground)))
    assert np.std(here - ground) > 1e-4 * np.std(ground)


@pytest.mark.parametrize("rate", [500.0, 480.0])
def test_a_ground_motion_that_a_logger_read_at_nearly_every_tick_stays(rate: float, cases: Cases) -> None:
    whole = cases.record()
    ground = whole.signals["ground_acceleration"]
    assert np.all(Building(with_ground(whole, ground, rate)).ground == ground)
