"""Recordings through a logger with extra noise on the forces, and coloured noise beside effects that resemble it."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import cast

import numpy as np
import pytest
from scipy import signal

from common.recording.imported import IMPORT, NOTHING_STATED, ImportedChannel
from common.recording.logger.low_pass import LoggerFilter
from common.roles import MASTER
from diagnosis.findings import gaps, how_far, report, verdict
from diagnosis.findings.certainty import costs, trust
from diagnosis.findings.found import Diagnosis
from diagnosis.findings.logged.building import by_balance, own_noise, verdict_on
from diagnosis.findings.logged.logger import by_building
from diagnosis.fits import fitting, hypothesis, residuals, settling, worth
from diagnosis.fits.residuals import over_longer
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import Search, search
from diagnosis.recorded.building import logged_building
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.ground import Ground
from diagnosis.recorded.loop import RecordedLoop
from diagnosis.recorded.nuisances import CALIBRATED
from diagnosis.recorded.record import Delay, Late, Record
from diagnosis.report.records import HowFar
from diagnosis.signals import alike
from diagnosis.signals.earlier import earlier
from models.registry import Array
from models.system import System
from tests.diagnosis.cases import STRONGEST, Cases, imported, lab_a, white

LEVEL = 200.0  # N
LATE = 2  # ticks
PASSED = LoggerFilter("bessel", 4, 60.0)


def relogged(whole: Record, name: str, values: Array) -> Record:
    """The record with another reading."""
    return replace(whole, signals=whole.signals | {name: values})


def logged(whole: Record) -> residuals.Data:
    """The building of a record as a part that is judged by its balance of forces."""
    part = logged_building.logged(Building(whole))
    return residuals.prepare(part, whole)


def noisy(whole: Record, colour: float = 0.0) -> Record:
    """The record with a delayed force and autoregressive noise of the logger on it."""
    force = whole.signals["column_force"]
    noise = signal.lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], white(21, force.size))
    late = np.concatenate([np.full(LATE, force[0]), force[:-LATE]])
    return relogged(whole, "column_force", late + LEVEL * noise)


@pytest.mark.long
def test_forces_with_extra_noise_are_recognized_as_logged(cases: Cases) -> None:
    whole = cases.record()
    assert not own_noise(logged(whole))
    assert not own_noise(logged(cases.record({"structure.mass": {"factor": 1.1}})))
    assert own_noise(logged(noisy(whole)))


@pytest.mark.long
@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_a_loggers_delay_is_found_and_its_noise_is_not_a_gap(cases: Cases, colour: float) -> None:
    found = search(logged(noisy(cases.record(), colour)), Scales(cases.record()))
    assert found.chosen.names == ()
    told = by_building(verdict.judge(found))
    assert told is not None
    assert told[0] == pytest.approx(LATE * 0.002, abs=1e-3)
    assert told[0] == pytest.approx(LATE * 0.002, abs=2.0 * told[1])
    assert found.chosen.prior < 9.0  # neither gain nor delay makes the noise smaller, so none is pulled away


def test_a_building_without_a_cause_says_nothing_of_its_logger(cases: Cases) -> None:
    data = logged(noisy(cases.record()))
    found = verdict.judge(Search(data, fit := fitting.fit(data, {}), fit, ()))
    assert by_building(found) is not None
    assert by_building(replace(found, outcome="unknown")) is None


def test_readings_without_a_delay_cost_little_where_a_building_hardly_tells_one(cases: Cases) -> None:
    part = lab_a(whole := cases.record())
    surely, hardly = (
        fitting.fit(residuals.prepare(part.logged(Late(late, late)), whole), {}).prior
        for late in (Delay(1e-3), Delay(1e-3, 6e-4))
    )
    assert hardly < 0.6 * surely  # (0.5 ms)² of 0.25 + 0.36, of which the actuator's own delay bears a part


def test_what_a_logger_did_adds_to_the_error_of_a_sensor(cases: Cases) -> None:
    whole, late = cases.record(), Delay(4e-3)
    data = residuals.prepare(lab_a(whole).logged(Late(late, late)), whole)
    true = {
        "sensor.column_displacement.delay": {"delay": 3e-3},
        "sensor.column_displacement.gain": {"factor": 1.1},
    }
    places = [item.name for item in data.part.nuisances]
    z = np.zeros(len(places))
    z[places.index("gain")] = 1.0
    system = hypothesis.lay(data, z, true)
    wrong, other = (system.effects.sensors[name] for name in ("column_displacement", "column_force"))
    assert wrong.delay == pytest.approx(3e-3)
    assert wrong.gain == pytest.approx(1.1 * other.gain)
    assert wrong.logger_delay == other.logger_delay == pytest.approx(late.about)
    assert other.gain == pytest.approx(1.0 + CALIBRATED)


def test_a_logger_s_gain_acts_on_all_that_a_sensor_says(cases: Cases) -> None:
    part = lab_a(whole := cases.record())
    wrong = whole.systems[part.role].sensed(
        "column_force", gain=1.1, bias=500.0, drift=20.0, saturation=2e4, saturation_sharpness=3.0
    )
    said, recorded = (part.predict(one)[:, 1] for one in (wrong, wrong.recorded("column_force", gain=1.02)))
    np.testing.assert_allclose(recorded, 1.02 * said, rtol=1e-9)


@pytest.mark.parametrize("ticks", [4000, 4007])  # 4007 is a prime number, of which transforms are slow
def test_delaying_a_reading_keeps_its_noise_level(ticks: int) -> None:
    noise = white(22, ticks)
    assert np.std(earlier(noise, 0.5)) == pytest.approx(np.std(noise), rel=0.01)
    wave = np.sin(2.0 * np.pi * np.arange(ticks) / 250.0)
    assert earlier(wave, 10.0)[100:-100] == pytest.approx(wave[110:-90], abs=1e-3)


def in_column(whole: Record, values: Array) -> Search:
    """The search in the master's laboratory with a signal added to the displacement."""
    name = "column_displacement"
    changed = relogged(whole, name, whole.signals[name] + values)
    return search(residuals.prepare(lab_a(changed), changed), Scales(changed))


@pytest.fixture(scope="module")
def drifting(cases: Cases) -> Search:
    """A displacement that drifts."""
    whole = cases.record()
    return in_column(whole, 3e-6 * whole.time)


def test_a_drift_is_not_taken_for_slow_noise(drifting: Search) -> None:
    found = drifting
    assert found.chosen.names == ("sensor.column_displacement.drift",)
    assert found.chosen.values["sensor.column_displacement.drift"]["rate"] == pytest.approx(3e-6, rel=0.15)


@pytest.mark.long
def test_slow_noise_is_not_taken_for_a_drift(cases: Cases) -> None:
    whole = cases.record()
    noise = signal.lfilter([1.0], [1.0, -0.95], white(23, whole.ticks))
    assert in_column(whole, 5e-6 * noise).chosen.names == ()


@pytest.mark.long
def test_a_motion_in_several_readings_is_not_taken_for_pickup(cases: Cases) -> None:
    whole = cases.record()
    motion = 2e-5 * np.sin(2.0 * np.pi * 11.3 * whole.time)
    alone = in_column(whole, motion)
    assert list(alone.data.noise[0].lines) == pytest.approx([11.3], abs=0.02)
    stiffness = whole.plan.column.stiffness
    moved = relogged(whole, "column_force", whole.signals["column_force"] + stiffness * motion)
    both = in_column(moved, motion)
    assert all(item.lines == () for item in both.data.noise)
    assert verdict.judge(both).outcome == "unknown"


def test_large_errors_of_all_nominal_parameters_make_an_effect_less_certain(drifting: Search) -> None:
    far = replace(drifting.chosen, z=np.full(drifting.chosen.z.size, 2.9))
    assert costs.certainty(drifting) > 0.9
    assert costs.certainty(replace(drifting, chosen=far)) < 0.5
    worse = replace(far, reduced=far.reduced + 1.0)
    assert verdict.judge(replace(drifting, chosen=worse)).outcome == "unknown"


def test_an_effect_that_hardly_closes_the_gap_is_not_an_explanation(cases: Cases, drifting: Search) -> None:
    whole = cases.record()
    found = Diagnosis(whole, verdicts=[verdict.judge(drifting)])
    far = HowFar(
        nominal=0.1,
        before=0.1,
        after=0.08,
        closed=0.2,
        closed_interval=None,
        noise_floor=0.01,
        judged_on=gaps.INTERLEAVED,
    )
    assert not how_far.shrinks(found, far)
    assert how_far.shrinks(found, replace(far, closed=0.7))
    elsewhere = replace(far, closed=0.7, judged_on=how_far.OTHERS)
    assert not how_far.shrinks(found, elsewhere)
    assert report.open_gap(elsewhere) == report.UNLIKE
    assert report.open_gap(far) == report.OPEN
    assert how_far.shrinks(found, replace(far, closed=0.9, judged_on=how_far.OTHERS))
    assert how_far.shrinks(Diagnosis(whole), far)
    signs = {"clear": 3.0, "names": 0.0}
    assert report.most_probable(far, signs) == trust.PARTLY.probability(signs) > 0.5
    assert report.most_probable(replace(elsewhere, closed=0.1), signs) == 0.1
    assert report.most_probable(replace(elsewhere, closed=-0.1), signs) == 0.0


@pytest.mark.parametrize(
    ("before", "after", "changed", "hidden"),
    [
        (0.020, 0.019, 0.002, True),  # 12 % above the noise, of which the effects make next to nothing
        (0.0105, 0.010, 0.009, True),  # no gap at all
        (0.020, 0.012, 0.016, False),  # the effects are as large as the gap
        (0.100, 0.099, 0.002, False),  # so far above the noise that another cause must be behind it
        (0.100, 10.0, math.inf, False),  # the simulation with the effects diverges
    ],
)
def test_the_response_shows_effects_that_change_it_by_more_than_noise(
    drifting: Search, before: float, after: float, changed: float, hidden: bool
) -> None:
    far = HowFar(
        nominal=before,
        before=before,
        after=after,
        closed=0.0,
        closed_interval=None,
        noise_floor=0.010,
        judged_on=gaps.INTERLEAVED,
    )
    named = Diagnosis(cast(Record, None), verdicts=[verdict.judge(drifting)])
    assert how_far.hardly_shown(named, far, changed) is hidden
    assert not how_far.hardly_shown(Diagnosis(cast(Record, None)), far, changed)


def test_a_building_is_averaged_over_a_twelfth_of_its_shortest_period(cases: Cases) -> None:
    whole = cases.record()
    data = logged(whole)
    longer = over_longer(data, cast(LoggedBuilding, data.part))
    assert longer is not None
    assert longer.group == 5 * data.group  # 40 ms, a twelfth of a period of 0.5 s
    ticks = residuals.withheld_ticks(whole.ticks, whole.plan.test.interval)
    assert np.array_equal(np.repeat(~longer.train, longer.group), ticks[: longer.groups * longer.group])
    short = logged(cases.record(duration=4.0))
    assert over_longer(short, cast(LoggedBuilding, short.part)) is None  # too few averages


@pytest.mark.slow
def test_noise_that_only_the_controller_read_is_no_fault_of_the_building(cases: Cases) -> None:
    whole = cases.record()
    noise = 5e-3 * white(7, whole.ticks)  # m/s², in the acceleration that the master computed from it
    unread = relogged(whole, "acceleration", whole.signals["acceleration"] + noise)
    unread = relogged(
        unread, "column_force", unread.signals["column_force"] + 0.5 * LEVEL * white(9, whole.ticks)
    )
    view, scales = logged(unread), Scales(unread)
    longer = over_longer(view, cast(LoggedBuilding, view.part))
    assert longer is not None
    moved = [np.max(np.abs(search(data, scales).chosen.z)) for data in (view, longer)]
    assert moved[0] > 2.0  # tolerances, which make that noise smaller over short averages
    assert moved[1] < 1.5
    assert by_balance(view, scales).search.data.group == longer.group
    found = verdict_on(residuals.prepare(Building(unread), unread), scales, view)
    assert found.outcome == "none"
    assert not found.search.chosen.z.any()  # no parameter moves to make that noise smaller
    heavier = by_balance(logged(cases.record({"structure.mass": {"factor": 1.1}})), scales)
    assert heavier.effects == ("structure.mass",)


def stated(whole: Record, names: Sequence[str], noise: float = LEVEL) -> Record:
    """The record as an import that states a filter and a delay for these signals, which passed both."""
    signals, delay = dict(whole.signals), whole.plan.test.interval
    for place, name in enumerate(names):
        seen = ImportedChannel(PASSED, delay).through(signals[name], whole.plan.test.interval)
        signals[name] = seen + noise * (name == "column_force") * white(40 + place, whole.ticks)
    channels = {name: {"filter": asdict(PASSED), "delay": delay} for name in names}
    metadata = {IMPORT: {"data": "a.csv", "channels": json.dumps({MASTER: channels})}}
    return replace(whole, signals=signals, run=replace(whole.run, metadata=whole.run.metadata | metadata))


def test_series_behind_different_filters_and_delays_are_brought_behind_the_same() -> None:
    interval, ticks = 0.002, 2000
    t = np.arange(ticks) * interval
    motion = np.hanning(ticks) * np.sin(2.0 * np.pi * np.outer([3.0, 11.0, 23.0], t)).sum(axis=0)
    low_pass = LoggerFilter("butterworth", 3, 30.0)
    one, other = ImportedChannel(low_pass, interval), ImportedChannel(PASSED)
    rows = np.column_stack([motion, one.through(motion, interval), other.through(motion, interval)])
    found = alike.alike(rows, (NOTHING_STATED, one, other), one.delay, interval)
    assert np.allclose(found, found[:, :1], atol=1e-3 * np.max(np.abs(motion)))
    assert np.max(np.abs(found[:, 0] - motion)) > 0.1 * np.max(np.abs(motion))
    biased = 5.0 + low_pass.filtered(motion, interval)  # the bias was there before the first tick
    begun = alike.begun(biased, ImportedChannel(low_pass), interval)
    assert begun == pytest.approx(alike.passed(5.0 + motion, low_pass, interval), abs=1e-7)


@pytest.mark.parametrize("names", [["column_force"], ["column_force", "ground_acceleration", "acceleration"]])
def test_a_stated_filter_of_its_force_is_no_gap_of_the_building(cases: Cases, names: list[str]) -> None:
    seen = stated(cases.record(), names)
    view = logged(seen)
    assert cast(LoggedBuilding, view.part).behind
    assert own_noise(view)
    bare = settling.settled(fitting.fit(view, {}))
    assert not worth.is_gap(bare)
    assert np.max(np.abs(bare.z)) < 1.0


@pytest.mark.parametrize("alone", [True, False])
def test_numbers_that_came_from_the_slave_are_not_late_with_the_force_that_a_logger_read(
    cases: Cases, alone: bool
) -> None:
    whole = cases.record(duration=STRONGEST)
    late = {
        name: np.concatenate([np.full(LATE, values[0]), values[:-LATE]])
        for name, values in whole.signals.items()
        if name == "column_force" or (name == "damper_force_used" and not alone)
    }
    view = logged(replace(whole, signals=whole.signals | late))
    part = cast(LoggedBuilding, view.part)
    assert part.alone == alone
    bare = settling.settled(fitting.fit(view, {}))
    assert np.max(np.abs(bare.z[:3])) < 1.0
    delay = part.late(bare.z, np.zeros(bare.z.size))
    assert delay is not None
    assert delay.about == pytest.approx(LATE * whole.plan.test.interval, abs=2e-4)


def test_a_fault_of_the_building_has_its_size_behind_a_stated_filter(cases: Cases) -> None:
    heavier = cases.record({"structure.mass": {"factor": 1.1}})
    view = logged(stated(heavier, ["column_force"]))
    bare = settling.settled(fitting.fit(view, {}))
    assert worth.is_gap(bare)
    found = settling.settled(fitting.fit(bare.data, {"structure.mass": {"factor": 1.05}}))
    assert not worth.is_gap(found)
    assert found.values["structure.mass"]["factor"] == pytest.approx(1.1, abs=0.02)


def test_a_filter_before_the_master_too_leaves_the_building_exact(cases: Cases) -> None:
    whole = cases.record()
    seen = stated(whole, ["column_force"])
    before = replace(seen, signals=whole.signals)  # the master used what was recorded
    view = logged(before)
    assert not cast(LoggedBuilding, view.part).behind
    assert not own_noise(view)
    louder = relogged(before, "column_force", whole.signals["column_force"] + LEVEL * white(41, whole.ticks))
    assert not cast(LoggedBuilding, logged(louder).part).behind


def test_a_ground_motion_is_compared_behind_its_stated_filter(cases: Cases) -> None:
    seen = stated(cases.record(), ["ground_acceleration"])
    part = Ground(seen, cast(Array, seen.ground))
    left = part.measured - part.predict(seen.systems[MASTER])
    assert np.max(np.abs(left)) < 1e-9


def test_a_simulated_response_passes_the_stated_filter_of_its_reading(cases: Cases) -> None:
    whole = cases.record()
    seen = stated(whole, ["column_force", "column_displacement"], noise=0.0)
    loops = [
        RecordedLoop(record, cast(Array, record.ground), None, ("column_force",))
        for record in (seen, replace(seen, run=whole.run))
    ]
    known, unknown = (loop.gap(loop.simulate(loop.record.systems))["column_force"] for loop in loops)
    assert known < 0.25 * unknown


@pytest.mark.long
def test_noise_that_the_motion_has_and_the_log_has_not_moves_no_parameter(cases: Cases) -> None:
    """The nominal parameters are the true ones, and the log has as much noise as the master read, of its own."""
    whole = cases.record(seed=0, duration=20.0)
    true = lab_a(whole).predict(System(whole.plan))[:, 1]
    rms = float(np.std(whole.signals["column_force"] - true))
    logged = imported(whole)
    used = {name: whole.signals[name] for name in ("damper_force_used",)}
    read = {"column_force": true + rms * white(5, true.size)}
    logged = replace(logged, signals=logged.signals | used | read)
    found = LoggedBuilding(next(part for part in parts_of(logged) if isinstance(part, Building)))
    assert found.of_motion == pytest.approx(0.5, abs=0.1)

    def moved(building: LoggedBuilding) -> Array:
        data = residuals.prepare(building, logged, {})
        return fitting.fit(over_longer(data, building) or data, {}).z

    assert np.max(np.abs(moved(found))) < 0.3
    found.of_motion = 0.0
    assert np.min(moved(found)[:3]) < -0.8
