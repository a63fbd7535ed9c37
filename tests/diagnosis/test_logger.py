"""Recordings that a data logger made beside the controllers: late, filtered, humming, at a rate of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from diagnosis.diagnose import examine
from diagnosis.findings import report
from diagnosis.findings.found import Diagnosis
from diagnosis.fits import fitting, residuals, settling
from diagnosis.fits.noise import inputs, sensor_noise
from diagnosis.recorded.divided import parts_of
from diagnosis.recorded.ground import Ground
from diagnosis.recorded.nuisances import LoggedReadings
from diagnosis.recorded.parts import LaboratoryPart
from diagnosis.signals import clock
from models.registry import Array
from models.system import System
from tests.diagnosis.cases import STRONGEST, Cases, imported, lab_a, lab_b

INTERVAL = 2e-3  # s
FILTER = signal.butter(4, 100.0, fs=500.0)  # before the converter, Hz
FRICTION = {"column.friction": {"force": 900.0}}


def hum(values: Array) -> Array:
    """A reading with a hum of 1 % of its peak."""
    wave = np.sin(2.0 * np.pi * 50.0 * 0.002 * np.arange(values.size) + 0.4)
    return values + 0.01 * float(np.max(np.abs(values))) * wave


def noisy(values: Array) -> Array:
    """A reading with noise of its own, low-passed at 100 Hz, of a sixth of its rms."""
    generator = np.random.default_rng(1 + int(1e9 * abs(float(values[-1]))))
    noise = signal.lfilter(*FILTER, generator.standard_normal(2 * values.size))[values.size :]
    return np.asarray(values + np.std(values) / 6.0 * noise / np.std(noise))


def outcomes(found: Diagnosis) -> dict[str, str]:
    """The outcome of every part by its name."""
    return {verdict.search.data.part.name: verdict.outcome for verdict in found.verdicts}


@pytest.mark.long
def test_a_gain_of_all_channels_within_their_calibration_is_said(cases: Cases) -> None:
    found = examine(imported(cases.record(), lambda read: 1.012 * read))
    told = [text for text in found.warnings if text.startswith("The readings")]
    assert any("1.2 % larger than the plan says" in text for text in told)
    assert not any("larger" in text for text in examine(imported(cases.record())).warnings)


@pytest.mark.long
@pytest.mark.parametrize(("effect", "early"), [({}, 4e-4), ({"table.bandwidth": {"factor": 1.3}}, 0.0)])
def test_readings_that_are_early_by_less_than_an_interval_are_those_of_a_logger(
    effect: dict[str, dict[str, float]], early: float, cases: Cases
) -> None:
    whole = imported(
        cases.record(effect), lambda read: clock.put_right(read, 0.0, stepped=False, early=-early / INTERVAL)
    )
    assert whole.numbered
    beside = replace(
        whole, signals={name: row for name, row in whole.signals.items() if not name.endswith("_seq")}
    )
    found = examine(beside)
    assert [item.effects for item in found.verdicts if item.effects] == ([tuple(effect)] if effect else [])
    delays = [one for one in found.verdicts[-1].search.data.part.nuisances if isinstance(one, LoggedReadings)]
    assert {one.least for one in delays if one.parameter == "delay"} == {-INTERVAL}
    assert [one.early for one in parts_of(whole) if isinstance(one, LaboratoryPart)] == [0.0, 0.0]


@pytest.mark.long
def test_a_hum_far_above_the_noise_is_no_gap(cases: Cases) -> None:
    found = examine(imported(cases.record(), hum))
    assert set(outcomes(found).values()) <= {"none", "tolerances"}
    lines = {line for verdict in found.verdicts for item in verdict.search.data.noise for line in item.lines}
    assert lines == {50.0}


@pytest.mark.long
def test_an_effect_keeps_its_name_beside_a_loud_hum(cases: Cases) -> None:
    found = examine(imported(cases.record(FRICTION), hum))
    assert next(item.effects for item in found.verdicts if item.effects) == ("column.friction",)


@pytest.mark.slow
def test_an_effect_keeps_its_name_beside_loud_coloured_noise(cases: Cases) -> None:
    soft = cases.record({"damper.stiffness": {"factor": 0.7}}, duration=STRONGEST)
    found = examine(imported(soft, noisy))
    (laboratory,) = (item for item in found.verdicts if item.effects)
    assert (laboratory.effects, laboratory.outcome) == (("damper.stiffness",), "explained")
    assert all(item.steady for item in laboratory.search.data.noise)


def test_noise_beside_an_effect_is_no_louder_than_the_noise_accepted(cases: Cases) -> None:
    data = sensor_noise.modelled(
        residuals.prepare(lab_a(whole := imported(cases.record(), noisy)), whole), System(whole.plan)
    )
    assert settling.no_louder(data, data)
    assert settling.no_louder(replace(data, white=0.9 * data.white), data)
    assert not settling.no_louder(replace(data, white=1.5 * data.white), data)
    assert not settling.no_louder(data, replace(data, noise=()))
    assert not settling.no_louder(data, None)


@pytest.mark.long
def test_a_reading_without_a_gap_may_be_as_loud_beside_an_effect_on_another_one(cases: Cases) -> None:
    whole = imported(cases.record({"sensor.column_displacement.gain": {"factor": 0.8}}), noisy)
    data = residuals.prepare(lab_a(whole), whole)
    bare = settling.settled(fitting.fit(data, {})).data
    assert bare.undoubted is not None
    assert bare.undoubted[0] == 0.0
    assert bare.undoubted[1] > 0.0
    beside = sensor_noise.modelled(data, System(whole.plan))
    beside = replace(beside, noise=tuple(replace(item, steady=False) for item in beside.noise))
    assert settling.louder(beside, None)
    assert settling.louder(beside, replace(bare, undoubted=0.5 * beside.white))
    assert not settling.louder(beside, replace(bare, undoubted=beside.white))


@pytest.mark.long
def test_loud_noise_that_may_follow_the_motion_is_too_few_data_where_inputs_cannot_be_asked(
    cases: Cases,
) -> None:
    verdict = examine(imported(cases.record(), noisy)).verdicts[-1]
    data = verdict.search.data
    doubtful = replace(data, noise=tuple(replace(item, steady=False) for item in data.noise))
    seen = [
        report.unheard(replace(verdict, search=replace(verdict.search, data=one)))
        for one in (data, doubtful, replace(data, related=None), replace(doubtful, related=None))
    ]
    assert seen == [False, False, False, True]


def test_a_loud_first_sample_is_no_beginning_in_motion(cases: Cases) -> None:
    def jumping(values: Array) -> Array:
        return values + 0.1 * np.max(np.abs(values)) * (-0.9) ** np.arange(values.size)

    whole = cases.record()
    assert lab_b(imported(whole, jumping)).anew is None
    signals = {name: values[whole.ticks // 2 :] for name, values in whole.signals.items()}
    present = {name: there[whole.ticks // 2 :] for name, there in whole.present.items()}
    later = lab_b(replace(whole, signals=signals, present=present))
    assert later.anew is not None
    assert len(later.anew) == 1


def test_noise_without_any_at_the_highest_frequencies_does_not_come_and_go(cases: Cases) -> None:
    whole, generator = imported(cases.record()), np.random.default_rng(5)
    part, system = lab_a(whole), System(whole.plan)
    smooth = signal.butter(8, 20.0, fs=500.0, output="sos")
    said = part.predict(system)
    noise = signal.sosfilt(smooth, generator.standard_normal((4096 + len(said), 2)), axis=0)[4096:]
    part = part.replaced(measured=said + 0.05 * np.std(said, axis=0) * noise)
    data = sensor_noise.modelled(residuals.prepare(part, whole), system)
    assert all(item.steady and item.tails < settling.UNEVEN for item in data.noise)


def test_noise_that_a_controller_feeds_back_is_not_foreseen_by_commands(cases: Cases) -> None:
    whole = imported(cases.record())
    alone = replace(whole, present=whole.present | {"displacement": np.zeros(whole.ticks, dtype=bool)})
    assert "actuator_command" not in lab_a(alone).wanted
    assert "actuator_command" in lab_a(cases.record()).wanted
    for record in (whole, alone):
        data = residuals.prepare(lab_a(record), record)
        noise = np.random.default_rng(3).standard_normal((data.groups, 2)) * data.sigma
        data = replace(data, related=inputs.related(data, data.system))
        assert float(np.std(inputs.predictable(data, noise) / data.sigma)) < 0.1


def test_the_error_of_an_interpolated_ground_motion_is_known(cases: Cases) -> None:
    whole = cases.record()
    assert whole.ground is not None
    part = Ground(whole, whole.ground)
    ticks, rows = whole.time, np.arange(0.0, whole.time[-1] + 1e-3, 1.0 / 1024.0)
    again = np.interp(ticks, rows, np.interp(rows, ticks, whole.signals["ground_acceleration"]))
    error = float(np.sqrt(np.mean((again - whole.signals["ground_acceleration"]) ** 2)))
    assert part.blur == 0.0
    assert part.interpolated(1024.0) == pytest.approx(error, rel=0.02)


def test_a_hum_is_no_gap_although_something_unknown_moves_a_reading(cases: Cases) -> None:
    whole = cases.record({"column.yielding": {"yield_displacement": 1e-3, "hardening": 0.1}}, duration=8.0)
    hum = 400.0 * np.sin(2.0 * np.pi * 50.0 * whole.time + 0.4)
    humming = replace(whole, signals=whole.signals | {"column_force": whole.signals["column_force"] + hum})
    fit = fitting.fit(residuals.prepare(lab_a(humming), humming), {})
    lines = sensor_noise.mains(fit)
    assert lines is not None
    place = fit.data.part.signals.index("column_force")
    assert np.std(lines[:, place] - hum) < 0.05 * np.std(hum)
    assert not lines[:, 1 - place].any()
    assert settling.settled(fit).data.lines is not None
    assert sensor_noise.mains(fitting.fit(residuals.prepare(lab_a(whole), whole), {})) is None


def test_coloured_noise_larger_than_the_steps_of_a_reading_is_taken_for_noise(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    part = lab_b(whole)
    system, place = whole.systems[part.role], part.signals.index("table_acceleration")
    step, smooth = 0.02, signal.butter(2, 20.0, fs=500.0, output="sos")
    noise = signal.sosfilt(smooth, np.random.default_rng(5).standard_normal(4096 + len(part.measured)))[4096:]
    measured = part.predict(system)
    measured[:, place] = step * np.round((measured[:, place] + 0.06 * noise / np.std(noise)) / step)
    data = residuals.prepare(part.replaced(measured=measured), whole, {"table_acceleration": step})
    assert step > residuals.STEPPING * data.white[place]  # at the highest frequencies steps stand out
    model = sensor_noise.modelled(data, system).noise[place]
    assert model.density is not None
    assert model.rms == pytest.approx(0.06, rel=0.2)


@pytest.mark.parametrize("far", [True, False])
def test_a_fit_without_effects_begins_again_from_the_nominal_parameters_of_a_better_one(
    cases: Cases, far: bool
) -> None:
    data = residuals.prepare(lab_a(whole := cases.record(duration=8.0)), whole)
    best = fitting.fit(data, {})
    off = fitting.at(data, {}, best.z + 1.0)
    bare, other = (off, best) if far else (best, off)
    assert np.array_equal(settling.as_near(bare, other).z, best.z)


def test_lines_that_change_by_a_visible_share_of_the_noise_are_found_again(cases: Cases) -> None:
    data = residuals.prepare(lab_a(whole := cases.record(duration=8.0)), whole)
    hum = np.zeros_like(data.part.measured)
    hum[:, 1] = np.sin(2.0 * np.pi * 50.0 * whole.time)
    loud, faint = (replace(data, lines=share * data.white * hum) for share in (1.0, 0.1))
    assert settling.shifted(loud, data)
    assert not settling.shifted(faint, data)
    assert not settling.shifted(loud, loud)
