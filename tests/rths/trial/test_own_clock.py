"""Loggers of the trial with clocks of their own: readings between ticks, their rows, and the imported recording."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from common.errors import InputError
from common.plan.read import from_tables
from common.recording.imported import imported
from common.recording.reader import read
from common.recording.run import Run
from validation.blind.best import silent_run
from validation.blind.cases.basis import basis
from validation.blind.cases.case import Case, levels, reality
from validation.blind.draw import begin, draw
from validation.blind.logger import own_clock
from validation.blind.logger.loggers import LOGGERS, OUT_OF_STEP, AnalogueFilter
from validation.blind.record import record
from validation.blind.sets import SETS
from validation.blind.size import play

TRIAL = basis(duration=2.0)


def drawn(logger: str, kind: str = "clean") -> Case:
    case = draw(1, 3, "out_of_step", trial=TRIAL, only=(kind,))[0]
    return replace(case, logger=logger)


def test_cases_take_the_loggers_in_turn_in_the_trials_own_laboratories() -> None:
    count, library = len(OUT_OF_STEP), basis().library
    begun = [begin(index, 5, "out_of_step", library) for index in range(2 * count)]
    assert [SETS["out_of_step"].logger(item.lot) for item in begun] == 2 * list(OUT_OF_STEP)
    assert [item.kind for item in begun] == count * ["clean"] + count * ["formula"]
    assert SETS["out_of_step"].own


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    case = drawn("600_hz", "formula")
    plan = from_tables(case.plan, Path())
    return silent_run(plan, reality(case), tmp_path_factory.mktemp("true") / "true.mcap")


@pytest.mark.parametrize("role", ["master", "slave"])
def test_readings_between_ticks_are_those_of_the_ticks_where_they_meet(run: Run, role: str) -> None:
    case = drawn("600_hz", "formula")
    fine, seen = own_clock.between_ticks(case, run, role)
    assert fine == pytest.approx(1e-4)
    for name, values in play(case, case.laid, run, role).items():
        assert np.array_equal(seen[name][::20][: values.size], values), name


def test_a_filter_passes_waves_as_its_analogue_prototype_does() -> None:
    fine = 1e-4
    t = np.arange(40_000) * fine
    for one in (
        AnalogueFilter("bessel", 6, 90.0, stated=True),
        AnalogueFilter("butterworth", 8, 70.0, stated=True),
    ):
        design = signal.butter if one.type == "butterworth" else signal.bessel
        norm = {} if one.type == "butterworth" else {"norm": "mag"}
        above, below = design(one.order, 2.0 * math.pi * one.cutoff, analog=True, **norm)
        for frequency in (5.0, 40.0):
            share = complex(signal.freqs(above, below, [2.0 * math.pi * frequency])[1][0])
            passed = own_clock.behind(np.sin(2.0 * math.pi * frequency * t), one, fine)
            wanted = np.imag(share * np.exp(2j * math.pi * frequency * t))
            assert np.max(np.abs(passed - wanted)[10_000:]) < 2e-3


@pytest.mark.long
@pytest.mark.parametrize("logger", ["600_hz", "lost_rows", "bessel"])
def test_a_recording_is_an_import_whose_readings_are_those_of_the_laboratory(
    tmp_path: Path, logger: str
) -> None:
    case = drawn(logger)
    recorded = record(case, tmp_path)
    assert [path.suffix for path in tmp_path.iterdir()] == [".mcap"]
    found = read(tmp_path / recorded.name)
    stated = imported(found)
    assert stated is not None
    assert stated.data == recorded.name.replace(".mcap", ".csv")
    channel = stated.channel("master", "column_force")
    assert channel.interpolated == (logger != "bessel")
    assert (channel.filter is not None) == (logger == "bessel")
    force = play(case, (), found, "master")["column_force"]
    error = np.sqrt(np.mean((found.columns["master"]["column_force"] - force) ** 2))
    late = 0.2e-3 if logger != "bessel" else 5e-3  # s, of the clock that was found, and of the filter
    slope = np.sqrt(np.mean(np.gradient(force, 0.002) ** 2))
    assert error < 1.2 * levels(case.truths)["column_force"] + late * slope


def test_a_test_that_a_limit_ended_soon_loses_no_rows(run: Run) -> None:
    case, ticks = drawn("lost_rows", "formula"), 6
    columns = {topic: {name: x[:ticks] for name, x in own.items()} for topic, own in run.columns.items()}
    soon = replace(run, columns=columns, sequences={topic: x[:ticks] for topic, x in run.sequences.items()})
    logger = LOGGERS["lost_rows"]
    assert logger.clock is not None
    stamps, rows = own_clock.table(case, from_tables(case.plan, Path()), soon, logger, logger.clock)
    assert np.diff(stamps) == pytest.approx(1.0 / 800.0)
    assert {values.size for values in rows.values()} == {stamps.size}


def test_laboratories_whose_readings_between_ticks_are_not_known_are_refused(run: Run) -> None:
    with pytest.raises(InputError, match="laboratories are columns or tables"):
        own_clock.between_ticks(replace(drawn("600_hz"), own=False), run, "master")
