"""Sensors that round, are noisy or miss samples are seen in the samples themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from common.recording.imported import IMPORT, ImportedChannel, ImportedData
from common.recording.reader import read
from common.roles import MASTER, SLAVE
from diagnosis.findings.sensors import readings
from diagnosis.findings.sensors.readings import SensorFinding
from diagnosis.fits import residuals
from diagnosis.recorded import record
from diagnosis.recorded.record import Record
from tests.diagnosis.cases import Cases, lab_a, lab_b, named


def found_in(whole: Record) -> list[SensorFinding]:
    """Findings as a diagnosis makes them."""
    steps = readings.steps(whole)
    datas = [residuals.prepare(kind(whole), whole, steps) for kind in (lab_a, lab_b)]
    return readings.findings(whole, readings.levels(datas), steps, readings.resolutions(whole, steps))


@pytest.mark.long
@pytest.mark.parametrize(
    ("signal", "step"),
    [("damper_force", 2.0), ("column_displacement", 5e-5), ("column_force", 1000.0), ("damper_stroke", 1e-4)],
)
def test_a_rounded_reading_is_found_with_its_step(cases: Cases, signal: str, step: float) -> None:
    (found,) = found_in(cases.record({f"sensor.{signal}.quantization": {"step": step}}, duration=8.0))
    assert found.effect == f"sensor.{signal}.quantization"
    assert found.value == pytest.approx(step, rel=1e-9)
    assert found.ratio > 1.0


@pytest.mark.long
def test_rounding_far_below_the_noise_gives_no_finding(cases: Cases) -> None:
    whole = cases.record({"sensor.column_force.quantization": {"step": 1.0}}, duration=8.0)
    assert readings.steps(whole) == {"column_force": pytest.approx(1.0)}
    assert found_in(whole) == []


@pytest.mark.parametrize(("times", "coarse"), [(1.5, False), (2.8, True)])
def test_steps_of_about_the_noise_are_those_of_a_usual_converter(
    cases: Cases, times: float, coarse: bool
) -> None:
    step = times * cases.record(duration=8.0).planned_noise["damper_stroke"]
    whole = cases.record({"sensor.damper_stroke.quantization": {"step": step}}, duration=8.0)
    assert readings.steps(whole) == {"damper_stroke": pytest.approx(step)}
    assert len(found_in(whole)) == coarse


def test_digits_of_readings_without_noise_are_no_steps_of_a_sensor(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    reach = float(np.std(whole.signals["damper_stroke"]))
    white = {name: 1e-6 * noise for name, noise in whole.planned_noise.items()}
    for share, coarse in ((3e-5, False), (3e-4, True)):
        step = {"damper_stroke": share * reach}
        assert step["damper_stroke"] > 5e-3 * whole.planned_noise["damper_stroke"]  # far above all noise
        found = readings.findings(whole, white, step, step)
        assert [item.effect for item in found] == coarse * ["sensor.damper_stroke.quantization"]


@pytest.mark.long
@pytest.mark.parametrize(
    ("signal", "rms"), [("column_force", 500.0), ("damper_stroke", 2e-5), ("table_acceleration", 0.05)]
)
def test_a_noisy_reading_is_found_with_its_noise_level(cases: Cases, signal: str, rms: float) -> None:
    (found,) = found_in(cases.record({f"sensor.{signal}.noise": {"rms": rms}}, duration=8.0))
    assert found.effect == f"sensor.{signal}.noise"
    assert found.value == pytest.approx(rms, rel=0.05)
    assert found.interval[0] < found.value < found.interval[1]


@pytest.mark.long
def test_sensors_as_planned_give_no_finding(cases: Cases) -> None:
    for seed in (0, 1, 2):
        whole = cases.record(seed=seed, duration=8.0)
        assert readings.steps(whole) == {}
        assert found_in(whole) == []
        assert readings.held(whole, {}) == {}


def test_sensors_that_are_all_equally_noisier_than_planned_give_no_finding(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    datas = [residuals.prepare(kind(whole), whole) for kind in (lab_a, lab_b)]
    loud = {name: 1.9 * level for name, level in readings.levels(datas).items()}
    assert readings.findings(whole, loud, {}, {}) == []


@pytest.mark.long
def test_rounding_shared_by_all_readings_of_a_unit_is_attributed_to_the_logger(cases: Cases) -> None:
    effects = {f"sensor.{name}.quantization": {"step": 1.0} for name in ("column_force", "damper_force")}
    more = {
        f"sensor.{name}.quantization": {"step": 1e-6}
        for name in ("column_displacement", "table_displacement", "damper_stroke")
    }
    assert found_in(cases.record({**effects, **more}, duration=8.0)) == []


def test_a_step_like_those_stated_of_other_channels_is_that_of_the_converter(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    measured = {lab.role: [name for name in lab.measured if whole.has(name)] for lab in whole.labs}
    steps = {name: float(np.ptp(whole.signals[name])) / 4096 for names in measured.values() for name in names}
    own = {"table_acceleration": 3.0 * steps.pop("table_acceleration")}
    channels = {
        role: {name: ImportedChannel(resolution=steps[name]) for name in names if name in steps}
        for role, names in measured.items()
    }
    metadata = ImportedData("log.csv", channels=channels).metadata()
    logged = replace(whole, run=replace(whole.run, metadata=whole.run.metadata | {IMPORT: metadata}))
    white = dict.fromkeys(steps.keys() | own.keys(), 1e-9)
    assert [item.effect for item in readings.findings(whole, white, own, own, logged=True)] == [
        "sensor.table_acceleration.quantization"
    ]
    assert readings.findings(logged, white, own, own, logged=True) == []
    printed = {
        name: 0.01 * step for name, step in steps.items()
    } | own  # digits finer than the converter's steps
    printed.pop("damper_force")  # whose noise shows then
    assert readings.findings(logged, white, printed, printed, logged=True) == []


def test_a_step_that_is_the_last_decimal_of_a_text_is_no_sensor_s(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    step = {"damper_stroke": 1e-5}
    white = {"damper_stroke": 1e-9, "table_displacement": 1e-9}

    def found(printed: float) -> list[SensorFinding]:
        channels = {SLAVE: {"damper_stroke": ImportedChannel(printed=printed)}}
        metadata = ImportedData("log.csv", channels=channels).metadata()
        logged = replace(whole, run=replace(whole.run, metadata=whole.run.metadata | {IMPORT: metadata}))
        return readings.findings(logged, white, step, step, logged=True)

    assert found(1e-5) == []
    assert [item.effect for item in found(1e-6)] == ["sensor.damper_stroke.quantization"]


def test_noise_of_a_converter_is_attributed_to_the_logger(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    levels = readings.levels([residuals.prepare(kind(whole), whole) for kind in (lab_a, lab_b)])
    loud = levels | {"damper_stroke": 6e-4 * float(np.max(np.abs(whole.signals["damper_stroke"])))}
    assert [item.effect for item in readings.findings(whole, loud, {}, {})] == ["sensor.damper_stroke.noise"]
    assert readings.findings(whole, loud, {}, {}, logged=True) == []


def test_repeated_samples_are_counted(cases: Cases) -> None:
    run = read(cases.file(duration=8.0))
    force = run.columns["slave"]["damper_force"].copy()
    missed = np.arange(100, 4000, 100)
    force[missed] = force[missed - 1]
    run.columns["slave"]["damper_force"] = force
    found = readings.held(record.build(run), {})
    assert set(found) == {"damper_force"}
    assert found["damper_force"] == pytest.approx(missed.size / 4000, rel=0.01)


def test_a_sensor_at_rest_does_not_count_as_missing_samples(cases: Cases) -> None:
    run = read(cases.file(duration=8.0))
    run.columns["slave"]["damper_force"] = np.zeros(4000)
    assert readings.held(record.build(run), {}) == {}


def test_noise_and_rounding_are_in_the_report(cases: Cases) -> None:
    report = cases.report({"sensor.column_force.noise": {"rms": 500.0}}, duration=8.0)
    assert named(report) == ["sensor.column_force.noise"]
    assert [site["site"] for site in report["where"]] == ["sensor.column_force"]
    rounded = cases.report({"sensor.damper_force.quantization": {"step": 2.0}}, duration=8.0)
    assert named(rounded) == ["sensor.damper_force.quantization"]


def test_an_interpolated_channel_does_not_count_as_one_that_misses_samples(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    values = whole.signals["column_force"].copy()
    values[1::50] = values[::50]
    held = replace(whole, signals=whole.signals | {"column_force": values})
    assert readings.held(held, {}) == {"column_force": pytest.approx(0.02, rel=0.1)}
    between = ImportedData("a.csv", False, {MASTER: {"column_force": ImportedChannel(interpolated=True)}})
    logged = replace(held, run=replace(held.run, metadata=held.run.metadata | {IMPORT: between.metadata()}))
    assert readings.held(logged, {}) == {}


def test_steps_from_before_an_interpolation_are_the_loggers(cases: Cases) -> None:
    whole = cases.record(duration=8.0)
    ticks, rate = whole.time, 1024.0
    times = np.arange(0.0, ticks[-1] + 1.0 / rate, 1.0 / rate)
    force = np.round(np.interp(times, ticks, whole.signals["damper_force"]))
    between = np.interp(ticks, times, force)
    logged = replace(whole, signals=whole.signals | {"damper_force": between})
    assert readings.steps(logged) == {}
    steps = readings.resolutions(logged, {})
    assert steps == {"damper_force": pytest.approx(1.0)}
    assert readings.held(logged, steps) == {}
    floors = readings.floors({"damper_force": 0.1}, steps, [], logged)
    assert floors["damper_force"] == pytest.approx(1.0 / np.sqrt(12.0))
    levels = readings.levels([residuals.prepare(kind(logged), logged, steps) for kind in (lab_a, lab_b)])
    assert readings.findings(logged, levels, {}, steps) == []


def test_noise_is_found_beside_steps_that_it_hides(cases: Cases) -> None:
    effects = {"sensor.damper_force.noise": {"rms": 0.8}, "sensor.damper_force.quantization": {"step": 0.2}}
    whole = cases.record(effects, duration=8.0)
    assert "sensor.damper_force.noise" in [item.effect for item in found_in(whole)]
