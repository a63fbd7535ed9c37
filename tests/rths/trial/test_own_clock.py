"""Loggers of the trial with clocks of their own: readings between ticks, their rows, and the recording of the import."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from common.errors import InputError
from common.plan.plan import Plan
from common.plan.read import from_tables, load, with_test
from common.reality.reality import from_reality
from common.recording.imported import imported
from common.recording.reader import read
from validation.blind.best import silent_run
from validation.blind.cases.basis import basis
from validation.blind.cases.case import Case, levels
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


def test_readings_between_ticks_are_those_of_the_ticks_where_they_meet(tmp_path: Path) -> None:
    case = drawn("600_hz", "formula")
    plan = from_tables(case.plan, Path())
    from validation.blind.cases.case import reality

    run = silent_run(plan, reality(case), tmp_path / "true.mcap")
    for role in ("master", "slave"):
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


@pytest.mark.parametrize("logger", ["drifting", "lost_rows", "250_hz"])
def test_a_recording_is_an_import_whose_readings_are_those_of_the_laboratory(
    tmp_path: Path, logger: str
) -> None:
    case = drawn(logger)
    recorded = record(case, tmp_path)
    assert [path.suffix for path in tmp_path.iterdir()] == [".mcap"]
    run = read(tmp_path / recorded.name)
    found = imported(run)
    assert found is not None
    assert logger.encode() not in (tmp_path / recorded.name).read_bytes()
    channel = found.channel("master", "column_force")
    assert channel.interpolated
    analogue = LOGGERS[logger].clock.filter  # type: ignore[union-attr]
    assert (channel.filter is not None) == (analogue is not None)
    if analogue is None:
        force = play(case, (), run, "master")["column_force"]
        error = run.columns["master"]["column_force"] - force[: run.ticks("master")]
        assert np.sqrt(np.mean(error**2)) < 3.0 * levels(case.truths)["column_force"] + 300.0


def test_a_plan_of_other_laboratories_is_refused(tmp_path: Path) -> None:
    plan = with_test(load(Path("rths/plans/two_storeys.toml")), duration=0.1)
    case = replace(drawn("600_hz"), plan=plan.tables())
    with pytest.raises(InputError, match="one storey"):
        own_clock.between_ticks(case, read(tmp_path), "master")
