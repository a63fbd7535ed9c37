"""Data loggers of the trial: their effects on a channel, the relogged recording, and the judgement of its names."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from common.plan.plan import Plan
from common.plan.read import with_test
from common.reality.reality import from_reality
from common.recording.reader import read
from common.signals import COLUMN_CHANNELS, Signal
from models.registry import Array
from tests.rths.trial.test_scoring import RUB, answer, case, judged
from validation.blind.best import silent_run
from validation.blind.cases.basis import basis
from validation.blind.draw import begin, draw
from validation.blind.logger import logged
from validation.blind.logger.loggers import IN_STEP, LOGGERS, Logger
from validation.blind.record import record
from validation.blind.results.rows import case_rows
from validation.blind.results.stated import brier_skill
from validation.blind.sets import SETS

INTERVAL = 0.002
DISPLACEMENT, FORCE = COLUMN_CHANNELS.measured
TIME = np.arange(5000) * INTERVAL
SLOW = 3e-3 * np.sin(2.0 * math.pi * 1.5 * TIME)  # m


def through(logger: Logger, level: float = 0.0, row: Signal = DISPLACEMENT) -> Array:
    return logged.logged(logger, row, SLOW, level, INTERVAL, np.random.default_rng(4))


@pytest.mark.parametrize("colour", logged.COLOURS)
def test_noise_of_every_colour_has_rms_one(colour: str) -> None:
    rms = [
        np.sqrt(np.mean(logged.COLOURS[colour](np.random.default_rng(seed), 20_000, 500.0) ** 2))
        for seed in range(4)
    ]
    assert np.mean(rms) == pytest.approx(1.0, abs=0.06)


def test_the_coloured_noises_have_the_spectra_of_their_names() -> None:
    def noise(colour: str) -> Array:
        return logged.COLOURS[colour](np.random.default_rng(1), 50_000, 500.0)

    def below(colour: str, limit: float) -> float:
        power = np.abs(np.fft.rfft(noise(colour))) ** 2
        return float(power[np.fft.rfftfreq(50_000, INTERVAL) < limit].sum() / power.sum())

    assert below("low_pass_50", 70.0) > 0.99 > below("low_pass_100", 70.0) > below("white", 70.0)
    assert below("low_pass_200", 210.0) > 0.95
    neighbours = noise("ar1")
    assert np.corrcoef(neighbours[1:], neighbours[:-1])[0, 1] == pytest.approx(0.95, abs=0.01)
    octaves = [below("pink", high) - below("pink", high / 2.0) for high in (8.0, 32.0, 128.0)]
    assert np.ptp(octaves) < 0.2 * np.mean(octaves)  # as much power in each octave
    assert np.max(np.abs(noise("heavy_tailed"))) > 10.0 > np.max(np.abs(noise("white")))


def test_a_filter_delays_slow_signals_according_to_its_order_and_cutoff() -> None:
    delayed = through(LOGGERS["anti_alias"])
    late = 2.6131 / (2.0 * math.pi * 100.0)  # s, of a Butterworth filter of order 4 at low frequency
    expected = 3e-3 * np.sin(2.0 * math.pi * 1.5 * (TIME - late))
    assert np.max(np.abs(delayed - expected)[500:]) < 2e-6


def test_loggers_delay_forces_and_not_displacements() -> None:
    assert np.array_equal(through(LOGGERS["late_forces"]), SLOW)
    assert np.array_equal(through(LOGGERS["late_forces"], row=FORCE)[2:], SLOW[:-2])


def test_calibration_hum_decimals_and_converter_change_a_channel_as_stated() -> None:
    assert np.allclose(through(LOGGERS["calibration"]), 1.01 * SLOW, rtol=1e-12)
    hum = through(LOGGERS["hum"]) - SLOW
    assert np.max(np.abs(hum)) == pytest.approx(3e-5, rel=0.01)
    printed = through(LOGGERS["printed"])
    assert np.allclose(printed, np.round(printed, 6), atol=1e-15)
    levels = np.unique(through(LOGGERS["converter"]))
    step = np.min(np.diff(levels))
    assert step * (1.0 + 1e-6) >= 2.0 * 1.5 * 3e-3 / 4096
    assert step <= 2.0 * 5.0 * 3e-3 / 4096 * (1.0 + 1e-6)
    assert np.max(np.abs(through(LOGGERS["converter"]) - SLOW)) <= 0.5 * step * (1.0 + 1e-6)


def test_a_logger_of_another_rate_keeps_the_signal_and_its_length() -> None:
    assert np.max(np.abs(through(LOGGERS["resampled"]) - SLOW)) < 1e-7  # 3 mm at 1.5 Hz, linear over 1 ms
    assert through(LOGGERS["all"], level=5e-6).shape == SLOW.shape


def test_cases_take_the_loggers_in_turn_and_kinds_in_rounds() -> None:
    count, library = len(IN_STEP), basis().library
    begun = [begin(index, 5, "loggers", library) for index in range(2 * count)]
    assert [SETS["loggers"].logger(item.lot) for item in begun] == 2 * list(IN_STEP)
    assert {item.kind for item in begun[:count]} == {"clean"}
    assert {item.kind for item in begun[count:]} == {"catalogue"}
    assert not SETS["judge"].logger((5, "judge", 0))


def test_a_relogged_recording_is_an_import_that_does_not_name_its_logger(tmp_path: Path) -> None:
    hidden = replace(draw(1, 5, "loggers", trial=basis(duration=1.0))[0], logger="late_forces")
    assert not any(hidden.reality()["sensors"].values())  # the noise is the logger's
    recorded = record(hidden, tmp_path)
    assert [path.suffix for path in tmp_path.iterdir()] == [".mcap"]
    run = read(tmp_path / recorded.name)
    master, slave = run.columns["master"], run.columns["slave"]
    assert run.finished
    assert run.metadata["import"] == {"data": "measurements"}
    assert b"late_forces" not in (tmp_path / recorded.name).read_bytes()
    assert np.array_equal(
        master["damper_force_used"][1:], slave["damper_force"][master["damper_force_seq"][1:]]
    )
    level = hidden.truths["sensors"]["column_force"]
    bends = np.diff(master["column_force"], 2)  # white noise gives √6 of its rms, the motion next to nothing
    assert np.std(bends) == pytest.approx(math.sqrt(6.0) * level, rel=0.2)


def test_a_piston_that_stands_still_behind_a_dead_band_ends_no_test_without_noise(tmp_path: Path) -> None:
    plan = with_test(Plan(), duration=4.0)
    sensors = dict.fromkeys(asdict(plan.sensors), 0.0)
    tables = {"effect": [{"name": "actuator.deadband", "width": 0.005}], "sensors": sensors}
    run = silent_run(plan, from_reality(tables, plan, tmp_path), tmp_path / "true.mcap")
    read_ = run.columns["master"]["column_displacement"]
    alike = np.lib.stride_tricks.sliding_window_view(read_, plan.safety.frozen_readings)
    assert np.ptp(alike, axis=1).min() == 0.0
    assert run.ticks("master") == plan.ticks


def test_naming_an_effect_of_the_logger_does_not_count_as_a_false_name() -> None:
    lagging = "sensor.column_force.lag"
    late = replace(case("catalogue", RUB), logger="late_forces")
    outcome = judged(late, answer("explained", lagging, "damper.friction", site="damper"))
    assert outcome.first
    assert outcome.surplus == 0
    assert judged(replace(late, logger="white"), answer("explained", lagging, "damper.friction")).surplus == 1
    clean = replace(case("clean"), logger="late_forces")
    assert judged(clean, answer("explained", lagging)).named
    assert judged(clean, answer("no_gap")).named
    assert not judged(clean, answer("unknown_effect")).named
    assert not judged(clean, answer("explained", lagging, "column.slip")).named
    assert not judged(replace(clean, logger="white"), answer("explained", lagging)).named


def test_the_table_has_a_row_per_logger_in_their_order() -> None:
    outcomes = [
        judged(replace(case("clean"), logger="pink"), answer("no_gap")),
        judged(
            replace(case("catalogue", RUB, index=1), logger="white"),
            answer("explained", "damper.friction", "column.slip", site="damper"),
        ),
    ]
    rows = case_rows(outcomes)
    assert [row.name for row in rows] == ["white noise", "pink noise", "all cases"]
    assert rows[0].cells[2:6] == ("–", "1 of 1", "1 of 1", "1.00")
    assert rows[1].cells[2:6] == ("1 of 1", "–", "–", "0.00")


def test_the_brier_skill_is_relative_to_the_share_of_true_cases() -> None:
    assert brier_skill([(1.0, True), (0.0, False)]) == 1.0
    assert brier_skill([(0.5, True), (0.5, False)]) == 0.0
    assert math.isnan(brier_skill([(0.9, True)]))
