"""What a logger does to forces that a building used: delays before or behind its master, and zeros that drift."""

from __future__ import annotations

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy import signal
from scipy.interpolate import CubicSpline

from common.recording.imported import IMPORT, ImportedChannel, ImportedData
from common.recording.logger.low_pass import LoggerFilter
from common.roles import MASTER
from diagnosis.fits import fitting, residuals
from diagnosis.fits.unexplained import leaves
from diagnosis.recorded.building import logged_building
from diagnosis.recorded.building import motion as recorded_motion
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.nuisances import LATE
from diagnosis.recorded.record import NOT_LATE, Delay, Late, Record
from diagnosis.signals.noise.level import white_rms
from models.registry import Array
from models.system import System
from tests.diagnosis.cases import Cases, lab_a, white


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


def test_forces_of_a_building_may_be_as_late_as_its_laboratories_say(cases: Cases) -> None:
    whole = cases.record()

    def usual(late: Late) -> float:
        part = LoggedBuilding(Building(replace(whole, late=late)))
        (delay,) = (one for one in part.nuisances if one.parameter == "delay")
        return delay.tolerance

    assert usual(NOT_LATE) == usual(Late(force=Delay(0.003))) == pytest.approx(LATE)
    assert usual(Late(force=Delay(0.016))) == pytest.approx(0.016)


def test_numbers_that_were_logged_slowly_have_no_noise_beyond_half_their_rate(cases: Cases) -> None:
    whole = cases.record()
    building = Building(whole)
    assert LoggedBuilding(building).passes == pytest.approx([125.0])  # a quarter of the rate of the ticks
    slow = ImportedChannel(interpolated=True, rate=120.0)
    building.channels = (slow, *building.channels[1:])
    assert LoggedBuilding(building).passes == pytest.approx([60.0])


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


def waves(ticks: int, frequency: float) -> Array:
    """A displacement (ticks, 1) of 1 m that oscillates."""
    return np.asarray(np.sin(2.0 * np.pi * frequency * 2e-3 * np.arange(ticks)))[:, None]


def test_slopes_at_slow_rows_are_those_of_the_motion() -> None:
    """Ten rows in a period: a cubic spline's second slope is 3 % off."""
    seen, frequency = np.arange(0, 3000, 5), 10.0
    found = recorded_motion.slopes(waves(3000, frequency), seen, 2e-3)
    turning = 2.0 * np.pi * frequency
    inner = seen[20:-20]
    velocity = turning * np.cos(turning * 2e-3 * inner)
    assert found["velocity"][inner, 0] == pytest.approx(velocity, abs=1e-5 * turning)
    bend = -(turning**2) * waves(3000, frequency)[inner, 0]
    assert found["acceleration"][inner, 0] == pytest.approx(bend, abs=1e-3 * turning**2)
    coarse = CubicSpline(seen * 2e-3, waves(3000, frequency)[seen, 0])(inner * 2e-3, 2)
    assert np.max(np.abs(coarse - bend)) > 0.02 * turning**2


def slowly(whole: Record, rate: float, names: tuple[str, ...]) -> Record:
    """The record with a building of which a logger read these numbers at a rate (Hz), at ticks of the controller."""
    channel = ImportedChannel(interpolated=True, rate=rate)
    seen = channel.seen(whole.ticks, 2e-3)
    read = {
        name: CubicSpline(seen, whole.signals[name][seen])(np.arange(whole.ticks))
        for name in (*names, "ground_acceleration")
    }
    followed = replace(channel, followed=True)
    channels = {MASTER: dict.fromkeys(names, channel) | {"ground_acceleration": followed}}
    run = replace(
        whole.run, metadata=whole.run.metadata | {IMPORT: ImportedData("", channels=channels).metadata()}
    )
    kept = {name: value for name, value in whole.signals.items() if name not in recorded_motion.MOTION}
    ground = {"ground_acceleration": whole.signals["ground_acceleration"]}  # an import follows the plan's
    return replace(whole, run=run, signals=kept | read | ground)


@pytest.mark.parametrize(
    "names",
    [("displacement",), ("displacement", "velocity"), ("displacement", "velocity", "acceleration")],
    ids=len,
)
def test_a_building_balances_beside_rows_that_are_five_times_as_slow(
    names: tuple[str, ...], cases: Cases
) -> None:
    record = slowly(cases.record(duration=12.0), 100.0, names)
    part = LoggedBuilding(Building(record))
    left, whole = part.left()[200:-200], part.measured[200:-200]
    assert np.std(left) < 0.02 * np.std(whole)


@pytest.mark.parametrize(
    ("names", "left"), [(("displacement",), 0.0), (recorded_motion.MOTION, 1.0)], ids=["alone", "all"]
)
def test_a_ground_motion_beside_slow_displacements_has_nothing_that_these_cannot_show(
    names: tuple[str, ...], left: float, cases: Cases
) -> None:
    """Rows of 100 Hz show a wave of 70 Hz as one of 30 Hz."""
    whole = cases.record()
    t = 2e-3 * np.arange(whole.ticks)
    slow, fast = np.sin(2.0 * np.pi * 4.0 * t), np.sin(2.0 * np.pi * 70.0 * t)
    ground = {"ground_acceleration": slow + fast}
    record = slowly(replace(whole, signals=whole.signals | ground), 100.0, names)
    seen = ImportedChannel(interpolated=True, rate=100.0).seen(whole.ticks, 2e-3)
    found = recorded_motion.of_ground(record)[seen]
    assert found[20:-20] == pytest.approx((slow + left * fast)[seen][20:-20], abs=0.02)


def test_a_velocity_of_slow_rows_counts_beside_an_acceleration_only(cases: Cases) -> None:
    whole = slowly(cases.record(), 100.0, recorded_motion.MOTION)
    rows = {name: whole.signals[name][:, None] for name in recorded_motion.MOTION}
    other = rows | {"velocity": rows["velocity"] + 1.0}
    assert np.all(recorded_motion.of_storeys(whole, other)["velocity"] == other["velocity"])
    less = {name: other[name] for name in recorded_motion.MOTION[:2]}
    found = recorded_motion.of_storeys(whole, less)["velocity"]
    assert np.max(np.abs(found - other["velocity"])) > 0.5
    assert np.std(found - rows["velocity"]) < 0.05 * np.std(rows["velocity"])


def test_a_stated_filter_behind_the_master_is_told_at_slow_rows(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Splines between rows have bends of their own, which say nothing of a filter."""
    record = slowly(cases.record(duration=12.0), 100.0, ("displacement",))
    building = Building(record)
    late = replace(building.channels[0], delay=0.02)
    building.channels = (*building.channels[:-2], late, late)
    asked: list[int] = []

    def before_master(plain: Array, behind: Array) -> bool:
        asked.extend((len(plain), len(behind)))
        return False

    monkeypatch.setattr(logged_building, "before_master", before_master)
    assert logged_building.logged(building).behind
    assert asked == [record.ticks // 5] * 2


def test_parameters_make_up_for_noise_within_their_tolerances() -> None:
    """A building that is heavier by a tolerance of 2 % has 2 % more of the noise of the motion, and so on."""
    noise = np.random.default_rng(8).normal(size=600)
    made_up = logged_building.within_tolerances(noise, 0.02 * noise[:, None], 1.0)
    energy = float(noise @ noise)
    expected = 4e-4 * energy / (1.0 + 4e-4 * energy)  # of a parameter of unit deviation
    assert made_up == pytest.approx(expected * noise)
    assert logged_building.within_tolerances(noise, 0.02 * noise[:, None], 0.0) == pytest.approx(noise)


def test_a_hole_in_the_rows_leaves_nothing_in_the_balance_beside_it(cases: Cases) -> None:
    whole = cases.record(duration=12.0)
    hole = slice(3000, 3020)
    there = {name: mask.copy() for name, mask in whole.present.items()}
    signals = {name: values.copy() for name, values in whole.signals.items()}
    for name in (*recorded_motion.MOTION[:1], "column_force", "damper_force_used"):
        there[name][hole] = False
        ends = np.linspace(0.0, 1.0, 22)
        signals[name][2999:3021] = (1.0 - ends) * signals[name][2999] + ends * signals[name][3020]
    for name in recorded_motion.MOTION[1:]:
        signals.pop(name)
    record = replace(whole, signals=signals, present=there)
    part = LoggedBuilding(Building(record))
    delayed = part.nuisances[[one.parameter for one in part.nuisances].index("delay")].moved(
        System(part._plan), 0.3
    )
    left = np.where(part.present, part.left(delayed), 0.0)
    assert not part.present[2998:3022].any()
    assert part.present[:2998].all()
    assert part.present[3022:].all()
    near, far = np.std(left[2900:3100]), np.std(left[200:2800])
    assert near < 1.3 * far


def test_the_motion_that_noise_is_held_against_has_none_of_it(cases: Cases) -> None:
    whole = cases.record(duration=12.0)
    part = LoggedBuilding(Building(whole))
    apart = np.diff(part.motion[:, 2], 4).std()
    assert np.diff(part.smooth[:, 2], 4).std() < 1e-3 * apart
    ticks = np.arange(whole.ticks) * 2e-3
    slow = np.sin(2.0 * np.pi * ticks / part.shortest)
    part.motion[:, 0] = slow + np.sin(6.0 * np.pi * ticks / part.shortest)
    wave = part.smooth[500:-500, 0]
    passed = np.exp(-0.5 * (0.25 * np.pi) ** 2)
    assert wave == pytest.approx(passed * slow[500:-500], abs=0.07)


@pytest.mark.parametrize("hole", [False, True])
def test_noise_of_the_motion_is_measured_behind_a_filter_and_beside_a_hole(hole: bool, cases: Cases) -> None:
    """The log has as much noise as the master read, of its own, behind a filter that the master did not have."""
    whole = cases.record(seed=0, duration=20.0)
    true = lab_a(whole).predict(System(whole.plan))[:, 1]
    rms = float(np.std(whole.signals["column_force"] - true))
    low_pass = LoggerFilter("elliptic", 6, 140.0, 0.1, 60.0)
    force = low_pass.filtered(true, whole.plan.test.interval) + rms * white(5, true.size)
    used = low_pass.filtered(whole.signals["damper_force_used"], whole.plan.test.interval)
    there = {name: mask.copy() for name, mask in whole.present.items()}
    for mask in there.values():
        mask[3000:3040] = not hole
    stated = {"filter": asdict(low_pass)}
    channels = {MASTER: {"column_force": stated, "damper_force_used": stated}}
    metadata = whole.run.metadata | {IMPORT: {"data": "a.csv", "channels": json.dumps(channels)}}
    found = logged_building.logged(
        Building(
            replace(
                whole,
                present=there,
                signals=whole.signals | {"column_force": force, "damper_force_used": used},
                run=replace(whole.run, metadata=metadata),
            )
        )
    )
    assert found.behind
    assert found.of_motion == pytest.approx(0.5, abs=0.15)


def test_the_noise_of_a_balance_is_not_measured_at_the_highest_frequencies(cases: Cases) -> None:
    """They hold less, as behind a spline through rows or a converter's own filter."""
    whole = cases.record(seed=0, duration=20.0)
    true = lab_a(whole).predict(System(whole.plan))[:, 1]
    less = signal.firwin(41, 190.0, fs=500.0)
    level = 10.0 * whole.planned_noise["column_force"]
    noise = level * np.convolve(white(6, true.size), less, "same")
    record = replace(whole, signals=whole.signals | {"column_force": true + noise})
    data = residuals.prepare(LoggedBuilding(Building(record)), record)
    assert data.white[0] == pytest.approx(level, rel=0.08)
    assert white_rms(noise[:, None])[0] < 0.8 * level
