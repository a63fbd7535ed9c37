"""An error that is a share of the motion, where that share changes in time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnose import diagnose
from diagnosis.findings.sensors import swaying
from diagnosis.findings.sites.signatures import alone
from diagnosis.findings.verdict import PartVerdict
from diagnosis.fits import fitting, residuals, settling
from diagnosis.fits.search import Search
from diagnosis.recorded.record import Record
from models.registry import Array
from tests.diagnosis.cases import Cases, lab_a, lab_b

COUNT, INTERVAL = 1500, 8e-3  # averaged samples, s
SWAY = 1.7  # Hz
SIZE = 0.35  # rms of the error over that of the noise


def noise(seed: int) -> Array:
    """Normal numbers of unit variance."""
    return np.asarray(np.random.default_rng(seed).normal(size=COUNT))


def motion() -> Array:
    """A motion that grows and falls again."""
    t = np.arange(COUNT) * INTERVAL
    return np.asarray(100.0 * np.sin(np.pi * t / t[-1]) ** 2 * np.sin(2.0 * np.pi * 2.1 * t))


def wave(frequency: float = SWAY) -> Array:
    """A share of the motion that changes in time, of unit rms."""
    return np.asarray(np.sqrt(2.0) * np.sin(2.0 * np.pi * frequency * np.arange(COUNT) * INTERVAL + 0.4))


def loosening(whole: Record, name: str) -> Record:
    """The record with a reading whose gain sways, by `SIZE` times its noise."""
    read = whole.signals[name]
    error = (read - read[0]) * np.sin(2.0 * np.pi * SWAY * whole.time)
    error *= SIZE * whole.planned_noise[name] / np.sqrt(np.mean(error**2))
    return replace(whole, signals=whole.signals | {name: read + error})


@pytest.mark.long
def test_a_gain_that_sways_is_an_effect_of_its_reading(cases: Cases) -> None:
    found = diagnose({"slave": loosening(cases.record(duration=8.0), "damper_force")}, {})["slave"].report
    assert (found.status, [place.site for place in found.where]) == (
        "unknown_effect",
        ["sensor.damper_force"],
    )
    said = [one for one in found.warnings if one.startswith("damper_force errs by a share of its motion")]
    assert len(said) == 1
    assert f"at {SWAY:.2g} Hz" in said[0]


@pytest.mark.long
@pytest.mark.parametrize("moved", [False, True])
def test_a_small_sway_does_not_count_where_readings_were_moved_in_time(cases: Cases, moved: bool) -> None:
    whole = cases.record(duration=8.0)
    read = whole.signals["damper_stroke"]
    swayed = read + 5e-4 * (read - read[0]) * np.sin(2.0 * np.pi * SWAY * whole.time)
    part = lab_b(replace(whole, signals=whole.signals | {"damper_stroke": swayed})).replaced(retimed=moved)
    bare = settling.settled(fitting.fit(residuals.prepare(part, whole), {}))
    verdict = PartVerdict(Search(bare.data, bare, bare, ()), "tolerances", 1.0, (), ())
    assert (swaying.own_error(verdict, part) is None) == moved


def test_the_frequency_and_size_of_a_share_are_found() -> None:
    error = motion() * wave()
    found = swaying.line(noise(1) + 0.5 * error / error.std(), motion(), INTERVAL)
    assert found.nats > swaying.SURE
    assert found.frequency == pytest.approx(SWAY, abs=0.05)
    assert found.ratio == pytest.approx(0.5, rel=0.25)


@pytest.mark.parametrize("seed", range(20))
def test_noise_and_a_steady_share_have_no_line(seed: int) -> None:
    assert swaying.line(noise(seed), motion(), INTERVAL).nats < swaying.SURE


def test_a_reading_that_is_late_by_little_does_not_sway() -> None:
    t = np.arange(COUNT) * INTERVAL
    burst = 100.0 * np.exp(-(((t - 3.0) / 0.5) ** 2)) * np.sin(2.0 * np.pi * 2.1 * t)
    slope = np.gradient(burst)
    left = noise(3) + slope / slope.std()
    motions = np.stack([burst, slope, np.gradient(slope)], axis=1)
    freed = swaying.without_steady(left, motions)
    assert max(swaying.line(freed, one, INTERVAL).nats for one in motions.T) < swaying.MAYBE
    assert swaying.line(left, slope, INTERVAL).nats > swaying.SURE


def test_what_is_measured_by_an_error_of_the_model_as_well_is_not_credited() -> None:
    error = motion() * wave()
    whole = swaying.line(0.02 * (noise(1) + 0.5 * error / error.std()), motion(), INTERVAL)
    assert whole.nats < 1.0


def test_what_one_reading_alone_shows_comes_from_its_sensor_or_a_machine_that_changes_no_other(
    cases: Cases,
) -> None:
    whole = cases.record(duration=8.0)
    sites = {
        name: alone(part, whole.systems[part.role], name)
        for part in (lab_a(whole), lab_b(whole))
        for name in part.signals
    }
    assert sites["column_force"] == ("column", "sensor.column_force")
    assert all(len(those) == 1 for name, those in sites.items() if name != "column_force")
    assert sites["damper_stroke"] == ("sensor.damper_stroke",)
