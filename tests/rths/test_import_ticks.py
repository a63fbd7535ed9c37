"""The rows of a data file on the ticks of a plan: between them, at rates of their own, held, and with holes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.plan.plan import Plan
from rths.examine.importing.import_map import lab_signals
from rths.examine.importing.onto_ticks import TickGrid
from tests.rths.imports import COMMAND, DRIVE, LATE, PLAN, TIMES, known, table


def test_rows_between_the_ticks_lose_nothing_of_a_motion(bring: Any) -> None:
    rows = np.arange(TIMES.size) / 57.0
    wave = 10.0 * np.sin(2.0 * np.pi * 2.0 * rows)
    code, run = bring(table("t,u,y", rows, wave, wave), DRIVE)
    assert code == 0
    found = run.columns["master"]["column_displacement"]
    expected = 1e-2 * np.sin(2.0 * np.pi * 2.0 * 0.01 * np.arange(found.size))
    assert np.max(np.abs(found - expected)[8:-8]) < 2e-6  # straight lines are off by up to 60 µm


def test_the_rate_of_rows_is_that_of_all_although_their_times_are_rounded(bring: Any) -> None:
    times = np.delete(np.round(np.arange(400) / 1024.0 * 10.0, 3), [40, 41, 90])
    code, run = bring(table("t,u,y", times, COMMAND[: times.size], LATE[: times.size]), DRIVE)
    assert code == 0
    assert known(run).channel("master", "column_displacement").rate == pytest.approx(102.4, rel=2e-4)


@pytest.mark.parametrize("begun", [0.0, 0.003, -0.003])
def test_what_a_controller_holds_is_no_curve_and_tells_when_its_ticks_are(
    begun: float, bring: Any, capsys: Any
) -> None:
    rows = np.arange(850) / 205.0 + 0.1  # 2.05 rows in an interval
    ticks = np.floor((rows + begun) / 0.01 + 1e-9)
    steps = 5.0 * np.sin(2.0 * np.pi * 0.7 * 0.01 * ticks)
    smooth = 5.0 * np.sin(2.0 * np.pi * 0.7 * rows)
    code, run = bring(table("t,u,y", rows, steps, smooth), DRIVE)
    assert code == 0
    command = run.columns["master"]["actuator_command"]
    expected = 5e-3 * np.sin(2.0 * np.pi * 0.7 * 0.01 * (10.0 + np.arange(command.size)))
    assert np.max(np.abs(command - expected)[1:-1]) < 1e-9
    read = run.columns["master"]["column_displacement"]
    true = 5e-3 * np.sin(2.0 * np.pi * 0.7 * (0.1 - begun + 0.01 * np.arange(read.size)))
    assert np.max(np.abs(read - true)[2:-2]) < 2e-6  # within a tenth of a millisecond
    side = f"its first tick is 3 ms {'before' if begun > 0.0 else 'after'} the first row"
    assert (side in capsys.readouterr().out) == (begun != 0.0)
    assert not known(run).channel("master", "actuator_command").interpolated
    assert known(run).channel("master", "column_displacement").interpolated


def test_what_a_controller_held_where_rows_are_lost_is_between_its_neighbours(bring: Any) -> None:
    rows = np.delete(np.arange(800) / 200.0, [401, 402, 403])  # both of a tick and one of the tick before
    steps = 5.0 * np.sin(2.0 * np.pi * 0.7 * 0.01 * np.floor(rows / 0.01 + 1e-9))
    code, run = bring(table("t,u,y", rows, steps, 5.0 * np.sin(2.0 * np.pi * 0.7 * rows)), DRIVE)
    assert code == 0
    command = run.columns["master"]["actuator_command"]
    expected = 5e-3 * np.sin(2.0 * np.pi * 0.7 * 0.01 * np.arange(command.size))
    assert np.max(np.abs(command - expected)[1:-1]) < 3e-6  # the row before would be off by 2e-4


def test_the_ground_motion_tells_the_ticks_of_a_slower_logger(bring: Any, tmp_path: Path) -> None:
    ground = np.sin(2.0 * np.pi * TIMES) * (TIMES < 3.5)
    (tmp_path / "motion.csv").write_text(table("time (s),acceleration (m/s2)", TIMES, ground))
    rows = 0.003 + np.arange(95) / 27.0  # s, of which the logger knows the differences
    ticks = np.floor(rows / 0.01).astype(int)
    computed = 5.0 * np.sin(2.0 * np.pi * 0.7 * TIMES[ticks])
    read = 5.0 * np.sin(2.0 * np.pi * 0.7 * rows)
    data = table("t,a,x,y", rows - rows[0], ground[ticks], computed, read)
    columns = (
        'ground_acceleration = { column = "a" }\ndisplacement = { column = "x", unit = "mm" }\n'
        'column_displacement = { column = "y", unit = "mm" }\n'
    )
    code, run = bring(data, columns, plan=f"{PLAN}[ground_motion]\nrecord = 'motion.csv'\nscale = 1.0\n")
    assert code == 0
    found = run.columns["master"]
    expected = 5e-3 * np.sin(2.0 * np.pi * 0.7 * found["t"])
    for name in ("displacement", "column_displacement"):
        assert np.max(np.abs(found[name] - expected)[8:-8]) < 2e-5  # 3 ms would be 7e-5
    assert (
        np.max(np.abs(found["ground_acceleration"] - ground[: found["t"].size])) < 1e-5
    )  # a cubic misses the corner
    followed = {
        name: known(run).channel("master", name).followed for name in ("ground_acceleration", "displacement")
    }
    assert followed == {"ground_acceleration": True, "displacement": False}
    assert known(run).channel("master", "displacement").interpolated


def test_rows_between_the_ticks_are_marked(bring: Any, capsys: Any) -> None:
    code, run = bring(table("t,u,y", 1.05 * TIMES, COMMAND, LATE), DRIVE)
    assert code == 0
    assert known(run).channel("master", "column_displacement").interpolated
    said = capsys.readouterr().out
    assert "interpolated onto the ticks, and marked so: actuator_command, column_displacement" in said
    assert (
        "link: the link cannot be judged, because the data hold no numbers and no time stamps of messages"
        in said
    )


def test_rows_on_the_ticks_keep_their_steps_although_times_are_not_exact(bring: Any) -> None:
    times = TIMES + 12.34567  # whose differences are no whole multiples of an interval
    steps = np.round(COMMAND, 1)
    code, run = bring(table("t,u,y", times, steps, steps), DRIVE)
    assert code == 0
    assert not known(run).channel("master", "column_displacement").interpolated
    assert set(np.unique(run.columns["master"]["column_displacement"])) == set(np.unique(1e-3 * steps))


SLOW = 0.03 * np.arange(134) + 0.004  # s, rows of a channel with a clock of its own
OTHER_RATES = {
    "half as often": (TIMES, slice(1, None, 2), 50.0),
    "of two loggers": (np.unique(np.r_[TIMES, SLOW]), None, 1.0 / 0.03),
}


@pytest.mark.parametrize("case", OTHER_RATES)
def test_a_channel_with_a_rate_of_its_own_has_empty_cells(bring: Any, case: str) -> None:
    times, rows, rate = OTHER_RATES[case]
    motion = 5.0 * np.sin(2.0 * np.pi * 0.7 * times)
    read = np.full(times.size, np.nan)
    there = np.isin(times, SLOW) if rows is None else rows
    read[there] = motion[there]
    commanded = np.where(np.isin(times, TIMES), motion, np.nan)
    text = table("t,u,y", times, commanded, read).replace("nan", "")
    code, run = bring(text, DRIVE)
    assert code == 0
    ticks = run.columns["master"]["t"]
    found = run.columns["master"]["column_displacement"]
    inside = (ticks > 0.1) & (ticks < 3.9)
    expected = 5e-3 * np.sin(2.0 * np.pi * 0.7 * ticks)
    assert np.max(np.abs(found - expected)[inside]) < 2e-7
    assert run.columns["master"]["actuator_command"] == pytest.approx(expected, abs=1e-11)
    channels = [known(run).channel("master", name) for name in ("column_displacement", "actuator_command")]
    assert [one.interpolated for one in channels] == [True, False]
    assert [one.rate for one in channels] == pytest.approx([rate, 100.0])


def test_rows_of_two_loggers_at_one_time_are_one_row(bring: Any, capsys: Any) -> None:
    slow = TIMES[::3]
    times = np.r_[TIMES, slow]
    order = np.argsort(times, kind="stable")
    motion = 5.0 * np.sin(2.0 * np.pi * 0.7 * times)
    commanded, read = motion.copy(), motion.copy()
    commanded[TIMES.size :], read[: TIMES.size] = np.nan, np.nan
    rows = [column[order] for column in (times, commanded, read)]
    code, run = bring(table("t,u,y", *rows).replace("nan", ""), DRIVE)
    assert code == 0
    ticks, found = run.columns["master"]["t"], run.columns["master"]["column_displacement"]
    assert np.max(np.abs(found - 5e-3 * np.sin(2.0 * np.pi * 0.7 * ticks))[20:-20]) < 2e-7
    assert known(run).channel("master", "column_displacement").rate == pytest.approx(100.0 / 3.0)
    capsys.readouterr()
    twice = [column[np.r_[0, 0, 1 : column.size]] for column in (TIMES, COMMAND, LATE)]
    twice[2][1] += 1e-3
    assert bring(table("t,u,y", *twice), DRIVE)[0] == 2
    assert "does not increase at row 2" in capsys.readouterr().err


@pytest.mark.parametrize("stuck", [True, False], ids=["at the same time", "at the next time"])
def test_rows_that_a_logger_wrote_twice_are_left_out(bring: Any, capsys: Any, stuck: bool) -> None:
    motion, read = COMMAND.copy(), LATE.copy()
    motion[100], read[100] = motion[99], read[99]
    times = np.where(np.arange(TIMES.size) == 100, TIMES[99], TIMES) if stuck else TIMES
    code, run = bring(table("t,u,y", times, motion, read), DRIVE)
    assert code == 0
    assert "left out, as they repeat the row before them in every column: 1 rows" in capsys.readouterr().out
    found, smooth = run.columns["master"]["column_displacement"], 1e-3 * LATE
    assert abs(found[100] - smooth[100]) < 0.05 * abs(smooth[100] - smooth[99])


def test_rows_of_coarse_steps_that_are_alike_where_hardly_anything_moves_stay(
    bring: Any, capsys: Any
) -> None:
    motion, read = (np.where(np.arange(TIMES.size) < 4, column[4], column) for column in (COMMAND, LATE))
    assert bring(table("t,u,y", TIMES, motion, read), DRIVE)[0] == 0
    assert "repeat the row before them" not in capsys.readouterr().out


def test_rows_of_a_logger_that_is_faster_than_what_it_reads_stay(bring: Any, capsys: Any) -> None:
    twice = np.repeat(np.arange(TIMES.size // 2), 2)
    assert bring(table("t,u,y", TIMES[: twice.size], COMMAND[twice], LATE[twice]), DRIVE)[0] == 0
    assert "repeat the row before them" not in capsys.readouterr().out


def test_rows_where_one_of_two_loggers_has_not_begun_or_has_ended_are_left_out(
    bring: Any, capsys: Any
) -> None:
    times = np.unique(np.r_[TIMES, SLOW])
    motion = 5.0 * np.sin(2.0 * np.pi * 0.7 * times)
    read, commanded = (np.where(np.isin(times, those), motion, np.nan) for those in (SLOW[2:-2], TIMES))
    assert bring(table("t,u,y", times, commanded, read).replace("nan", ""), DRIVE)[0] == 0
    said = capsys.readouterr().out
    assert "left out, as not all columns have begun or go on there: 9 rows at the begin, 8 at the end" in said


@pytest.mark.parametrize("holes", [slice(200, 201), slice(200, 260), slice(0, 30), slice(380, None)])
def test_a_channel_with_a_hole_is_refused(bring: Any, capsys: Any, holes: slice) -> None:
    read = LATE.copy()
    read[holes] = np.nan
    assert bring(table("t,u,y", TIMES, COMMAND, read).replace("nan", ""), DRIVE)[0] == 2
    assert "column 'y' has no number in row" in capsys.readouterr().err


def test_sequence_numbers_are_held_between_rows_and_incomplete_time_stamps_are_left_out(
    bring: Any, capsys: Any
) -> None:
    numbers = np.floor(TIMES / 0.02)
    rows = (
        DRIVE
        + 'damper_force_seq = { column = "n" }\ncommand_seq = { column = "n" }\ncommand_one_way = { column = "w" }\n'
    )
    text = table("t,u,y,n,w", 1.01 * TIMES, COMMAND, LATE, numbers, 1e-3 + 0.0 * TIMES)
    code, run = bring(text, rows)
    assert code == 0
    assert set(np.unique(run.columns["master"]["damper_force_seq"])) <= set(range(200))
    assert np.all(run.columns["latency"]["command_one_way"] == 1e-3)
    assert np.all(np.isnan(run.columns["latency"]["round_trip"]))
    assert "link:" not in capsys.readouterr().out


def test_as_many_ticks_as_are_wanted_are_not_those_ticks() -> None:
    """A logger that began a tick early and passed over one later has as many rows as there are ticks."""
    interval = 0.002
    grid = TickGrid(interval * np.arange(40.0), interval, None)
    seen = interval * np.r_[-1.0, np.arange(20.0), np.arange(21.0, 40.0)]
    row = lab_signals(Plan())["displacement"][1]
    assert grid.between(seen, 3.0 * seen, row, None) == pytest.approx(3.0 * grid.t, abs=1e-12)
    assert grid.between(grid.t, 3.0 * grid.t, row, None) == pytest.approx(3.0 * grid.t, abs=0.0)
