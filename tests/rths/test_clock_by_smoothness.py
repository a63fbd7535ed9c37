"""The ticks of a controller by the clock of a slower logger, from how smooth its own numbers are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from models.registry import Array
from report.text.tabular import read_table
from rths.examine.importing.clock_by_smoothness import beginning, clock_by_smoothness
from rths.examine.importing.import_map import load_map
from rths.examine.importing.onto_ticks import OnTicks, on_ticks

INTERVAL = 2e-3


def moved(t: Array) -> Array:
    """A motion (n,) at times (n,), s, with content up to 9 Hz."""
    return sum((np.sin(2.0 * np.pi * f * t + f) / f for f in (0.7, 2.3, 4.1, 9.0)), np.zeros_like(t))


def logged(rate: float, begin: float, ppm: float, seconds: float) -> tuple[Array, Array]:
    """Times by the logger, s, of rows that begin some time after a tick, and the ticks of which they show numbers."""
    times = np.arange(round(seconds * rate)) / rate
    return times, np.floor((begin + times / (1.0 + 1e-6 * ppm)) / INTERVAL + 1e-9)


@pytest.mark.parametrize("rate", [120.0, 200.0, 256.0, 333.0])
@pytest.mark.parametrize(("begin", "ppm", "seconds"), [(0.3e-3, -35.0, 30.0), (1.6e-3, 60.0, 90.0)])
def test_the_smoothest_motion_is_at_its_own_ticks(
    rate: float, begin: float, ppm: float, seconds: float
) -> None:
    times, ticks = logged(rate, begin, ppm, seconds)
    motion = moved(INTERVAL * ticks)
    found = clock_by_smoothness(times, [0.0 * times, np.round(motion, 6)], INTERVAL)
    assert found is not None
    seen, values = found.seen(times, ticks)
    apart = values - np.rint(seen / INTERVAL)
    assert np.ptp(apart) == 0.0  # it cannot know which tick is the first one
    assert abs(apart[0]) <= 1.0


def test_rows_that_keep_to_the_ticks_and_noise_tell_nothing() -> None:
    times, ticks = logged(250.0, 0.3e-3, 0.0, 30.0)
    motion = moved(INTERVAL * ticks)
    assert clock_by_smoothness(times, [motion], INTERVAL) is None
    times, ticks = logged(256.0, 0.3e-3, 20.0, 30.0)
    noise = np.random.default_rng(3).normal(size=times.size)
    assert clock_by_smoothness(times, [noise], INTERVAL) is None
    assert clock_by_smoothness(times, [moved(times)], INTERVAL) is None  # a reading, taken at its row
    assert clock_by_smoothness(times[:150], [moved(INTERVAL * ticks[:150])], INTERVAL) is None
    fast, ticks = logged(1024.0, 0.3e-3, 20.0, 30.0)
    assert clock_by_smoothness(fast, [moved(INTERVAL * ticks)], INTERVAL) is None  # repeats tell more


def test_few_rows_in_a_long_time_tell_nothing() -> None:
    times, ticks = 3.0 * np.arange(210.0), np.floor(3.0 * np.arange(210.0) / 0.04)
    assert clock_by_smoothness(times, [np.sin(ticks), 0.0 * ticks], 0.04) is None


def test_rows_that_are_few_in_twenty_seconds_are_looked_at_for_longer() -> None:
    assert beginning(np.arange(4000) / 200.0) == 20.0
    assert beginning(np.arange(400) / 4.0) == 49.75  # two hundred rows


def imported(folder: Path, stated: str) -> OnTicks:
    """An import of a slow logger's table command, of which the map states something more."""
    times, ticks = logged(256.0, 0.7e-3, 20.0, 20.0)
    target = 0.01 * moved(INTERVAL * ticks)
    rows = (f"{t:.6f},{value:.9f},{0.0:.1f}" for t, value in zip(times, target, strict=True))
    (folder / "log.csv").write_text("t,target,read\n" + "\n".join(rows) + "\n", encoding="utf-8")
    (folder / "plan.toml").write_text('[test]\nname = "slow"\nduration = 20.0\n', encoding="utf-8")
    (folder / "map.toml").write_text(
        'plan = "plan.toml"\ntime = "t"\n[signals]\n'
        f'table_target = {{ column = "target", unit = "m"{stated} }}\n'
        'table_displacement = { column = "read", unit = "m" }\n',
        encoding="utf-8",
    )
    return on_ticks(load_map(folder / "map.toml"), read_table(folder / "log.csv"), folder / "log.csv")


def test_an_import_puts_slow_rows_onto_the_ticks_of_the_controller(tmp_path: Path) -> None:
    found = imported(tmp_path, "")
    assert found.clock is not None
    assert found.clock.fast == pytest.approx(2e-5, abs=2e-6)
    inside = slice(10, -10)
    at_ticks = INTERVAL * np.arange(found.t.size, dtype=np.float64)
    early = [moved(at_ticks + by * INTERVAL) for by in (-1.0, 0.0, 1.0)]
    missed = [float(np.max(np.abs(found.values["table_target"] - 0.01 * one)[inside])) for one in early]
    assert min(missed) < 1e-6  # a row at the wrong tick is up to 5e-4 m off


@pytest.mark.parametrize(
    "stated", [', filter = { type = "butterworth", order = 2, cutoff = 30.0 }', ", delay = 0.001"]
)
def test_a_command_that_was_filtered_or_comes_late_tells_no_tick(tmp_path: Path, stated: str) -> None:
    assert imported(tmp_path, stated).clock is None
