"""The beginning of a test in data that began before it, found by the ground motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError
from common.recording.imported import at_rest
from models.registry import Array
from rths.examine.importing.beginning import first_tick, ticks_before
from tests.rths.imports import PLAN, TIMES, table

INTERVAL = 0.01  # s, of the plan
MOTION = "[ground_motion]\nrecord = 'motion.csv'\nscale = 1.0\n"
COLUMNS = 'ground_acceleration = { column = "a" }\ndisplacement = { column = "x", unit = "mm" }\n'


def shaking(t: Any) -> Array:
    """A ground acceleration (n,) in m/s² that begins at 0 s and has no period."""
    return np.where((t >= 0.0) & (t < 3.5), np.sin(2.0 * np.pi * (1.0 + 0.3 * t) * t) * np.exp(-0.3 * t), 0.0)


def drift(t: Any) -> Array:
    """A displacement (n,) in mm that begins at 0 s."""
    return np.where(t > 0.0, 5.0 * (1.0 - np.cos(2.0 * np.pi * 0.7 * t)), 0.0)


@pytest.mark.parametrize(
    ("rate", "before", "held"),
    [(100.0, 1.57, True), (200.0, 1.57, True), (217.0, 1.5703, True), (100.0, 1.57, False), (0.0, 0.0, True)],
)
def test_a_test_begins_where_its_ground_motion_does(
    rate: float, before: float, held: bool, bring: Any, capsys: Any, tmp_path: Path
) -> None:
    (tmp_path / "motion.csv").write_text(table("time (s),acceleration (m/s2)", TIMES, shaking(TIMES)))
    rate = rate or 100.0
    t = np.asarray(np.arange(round((before + 3.9) * rate)) / rate - before, dtype=np.float64)
    ticks = np.asarray(INTERVAL * np.floor(t / INTERVAL + 1e-6), dtype=np.float64)
    data = table("t,a,x", t + before, 1.01 * shaking(ticks if held else t), drift(ticks))
    code, run = bring(data, COLUMNS, plan=PLAN + MOTION)
    assert code == 0
    found = run.columns["master"]
    when = found["t"][:-4]
    assert found["displacement"][:-4] == pytest.approx(1e-3 * drift(when), abs=2e-5)
    assert ("start: the plan's ground motion begins at 1.57" in capsys.readouterr().out) == (before > 0.0)


def test_a_motion_that_comes_late_by_little_is_no_beginning(bring: Any, capsys: Any, tmp_path: Path) -> None:
    (tmp_path / "motion.csv").write_text(table("time (s),acceleration (m/s2)", TIMES, shaking(TIMES)))
    t = INTERVAL * np.arange(390)
    code, run = bring(table("t,a,x", t, shaking(t - 0.2), drift(t - 0.2)), COLUMNS, plan=PLAN + MOTION)
    assert code == 0
    assert run.columns["master"]["t"].size == 390
    assert "start: " not in capsys.readouterr().out


def test_a_start_that_the_map_states_is_taken(bring: Any, capsys: Any, tmp_path: Path) -> None:
    (tmp_path / "motion.csv").write_text(table("time (s),acceleration (m/s2)", TIMES, shaking(TIMES)))
    t = np.asarray(INTERVAL * np.arange(500) - 1.0, dtype=np.float64)
    data = table("t,a,x", t + 1.0, shaking(t), drift(t))
    code, run = bring(data, COLUMNS, 'time = "t"\nstart = 0.5\n', plan=PLAN + MOTION)
    assert code == 0
    assert run.columns["master"]["t"].size == 450
    assert "start: " not in capsys.readouterr().out


def test_another_motion_has_no_beginning() -> None:
    noise = np.random.default_rng(5).standard_normal((2, 4000))
    assert ticks_before(noise[0], noise[1, :2000]) == 0
    assert ticks_before(np.zeros(4000), noise[1]) == 0
    assert ticks_before(np.concatenate([np.zeros(700), noise[0]]), noise[0]) == 700


@pytest.mark.parametrize("off", [0.0, 0.0031, 0.0069])
def test_the_first_tick_of_a_reading_on_straight_lines_lies_between_rows(off: float) -> None:
    times = np.arange(900) / 173.0
    begin = 1.2 + off
    planned = shaking(TIMES[:350])
    reading = np.interp(times - begin, TIMES[:350], planned)
    found = first_tick(times, reading, planned, 1.21, INTERVAL)
    assert found == pytest.approx(begin, abs=INTERVAL / 8.0)


@pytest.mark.parametrize(
    ("before", "moves_until", "kept"),
    [(4.0, -9.0, 3.9), (4.0, -2.5, 2.4), (4.0, -1.0, 0.0), (1.5, -9.0, 0.0)],
)
def test_readings_at_rest_before_a_test_are_kept(
    before: float, moves_until: float, kept: float, bring: Any, capsys: Any
) -> None:
    t = INTERVAL * np.arange(round((before + 3.0) / INTERVAL)) - before
    noise = 1e-3 * np.random.default_rng(8).standard_normal(t.size)
    command = drift(t) + np.where(t < moves_until, 2.0, 0.0)
    rows = 'actuator_command = { column = "u", unit = "mm" }\ncolumn_displacement = { column = "y", unit = "mm" }\n'
    code, run = bring(
        table("t,u,y", t + before, command, drift(t) + noise), rows, f'time = "t"\nstart = {before}\n'
    )
    assert code == 0
    found = at_rest(run)
    assert ("at rest: column_displacement before" in capsys.readouterr().out) == (kept > 0.0)
    assert [*found] == ([("master", "column_displacement")] if kept else [])
    for values in found.values():
        assert values.size == pytest.approx(kept / INTERVAL, abs=7)
        last = int(np.searchsorted(t, -0.05 + 1e-9))
        assert values == pytest.approx(1e-3 * noise[last - values.size : last], abs=1e-12)
    assert run.columns["master"]["t"].size == pytest.approx(300, abs=1)


def test_readings_at_rest_that_are_damaged_are_refused_in_one_sentence(bring: Any) -> None:
    t = INTERVAL * np.arange(700) - 4.0
    rows = 'actuator_command = { column = "u", unit = "mm" }\ncolumn_displacement = { column = "y", unit = "mm" }\n'
    _, run = bring(table("t,u,y", t + 4.0, drift(t), drift(t)), rows, 'time = "t"\nstart = 4.0\n')
    assert at_rest(replace(run, attachments={})) == {}
    with pytest.raises(InputError, match="'at_rest' cannot be read"):
        at_rest(replace(run, attachments={"at_rest": bytes(7)}))


@pytest.mark.parametrize(
    ("scale", "apart", "message"),
    [
        (1e6, 0.0, "its rows are 1e+04 s apart"),
        (1.0, 86_400.0, "its rows last 86403.9 s, and a test lasts 7200 s at most"),
    ],
)
def test_times_that_last_longer_than_a_test_are_refused_in_one_sentence(
    scale: float, apart: float, message: str, bring: Any, capsys: Any, tmp_path: Path
) -> None:
    """A search for the test in them would ask for more memory than there is."""
    (tmp_path / "motion.csv").write_text(table("time (s),acceleration (m/s2)", TIMES, shaking(TIMES)))
    t = INTERVAL * np.arange(390)
    times = scale * t + np.where(t > 3.8, apart, 0.0)
    code, _ = bring(table("t,a,x", times, shaking(t), drift(t)), COLUMNS, plan=PLAN + MOTION)
    assert code == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("apart", [0.3e-3, 1.7e-3, 3.1e-3, 4.4e-3, 6.2e-3])
def test_the_first_tick_of_a_test_among_faster_rows_is_that_of_its_ground_motion(
    apart: float, bring: Any, tmp_path: Path
) -> None:
    """Rows at 134 Hz of a controller whose ticks, 10 ms apart, begin at any time between two of them."""
    (tmp_path / "motion.csv").write_text(table("time (s),acceleration (m/s2)", TIMES, shaking(TIMES)))
    t = np.arange(round(5.4 * 134.0)) / 134.0 - 1.5 - apart
    ticks = INTERVAL * np.floor(t / INTERVAL + 1e-6)
    data = table("t,a,x", t + 1.5 + apart, 1.01 * shaking(ticks), drift(ticks))
    code, run = bring(data, COLUMNS, plan=PLAN + MOTION)
    assert code == 0
    found = run.columns["master"]
    count = found["t"].size - 4
    assert found["ground_acceleration"][:count] == pytest.approx(1.01 * shaking(found["t"][:count]), abs=1e-3)
