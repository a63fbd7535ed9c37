"""Thinning of a line: how many points are kept, which ones, and which are new to a reader."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from report.live.trace import Trace, extremes, largest

TICKS = np.arange(1000)


def in_pieces(trace: Trace, cuts: list[int], values: np.ndarray) -> None:
    for begin, end in zip([0, *cuts], [*cuts, TICKS.size], strict=True):
        trace.add(TICKS[begin:end], {"a": values[begin:end]})


@given(cuts=st.lists(st.integers(0, 1000), max_size=20), step=st.integers(1, 30))
def test_one_point_is_kept_per_step_however_the_ticks_arrive(cuts: list[int], step: int) -> None:
    trace = Trace(step, 2000)
    in_pieces(trace, sorted(cuts), TICKS * 0.5)
    assert trace.since(0)["a"].tolist() == (TICKS[::step] * 0.5).tolist()
    assert trace.total == TICKS[::step].size


@given(cuts=st.lists(st.integers(0, 1000), max_size=20), step=st.integers(1, 30), seed=st.integers(0, 99))
def test_the_worst_value_of_each_group_is_kept_however_the_ticks_arrive(
    cuts: list[int], step: int, seed: int
) -> None:
    values = np.random.default_rng(seed).normal(size=TICKS.size)
    values[::7] = np.nan
    trace = Trace(step, 2000, largest)
    in_pieces(trace, sorted(cuts), values)
    groups = [values[begin : begin + step] for begin in range(0, TICKS.size, step)][:-1]
    expected = [np.nan if np.isnan(group).all() else np.nanmax(group) for group in groups]
    assert np.array_equal(trace.since(0)["a"], expected, equal_nan=True)


@pytest.mark.slow
@given(cuts=st.lists(st.integers(0, 1000), max_size=20), step=st.integers(1, 30), seed=st.integers(0, 99))
def test_the_extremes_of_each_group_are_kept_with_their_times(cuts: list[int], step: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=(2, TICKS.size))
    values[1, ::7] = np.nan
    trace = Trace(step, 5000, extremes)
    for begin, end in zip([0, *sorted(cuts)], [*sorted(cuts), TICKS.size], strict=True):
        some = slice(begin, end)
        trace.add(TICKS[some], {"t": TICKS[some] * 0.5, "a": values[0, some], "b": values[1, some]})
    trace.close()
    kept = trace.since(0)
    places = np.rint(kept["t"] / 0.5).astype(int)
    assert np.all(np.diff(places) > 0)
    for row, name in enumerate(("a", "b")):
        assert np.array_equal(kept[name], values[row, places], equal_nan=True)
    for begin in range(0, TICKS.size, step):
        here = (places >= begin) & (places < begin + step)
        assert np.count_nonzero(here) <= 4
        for row, name in enumerate(("a", "b")):
            group = values[row, begin : begin + step]
            if not np.isnan(group).all():
                assert np.nanmin(kept[name][here]) == np.nanmin(group)
                assert np.nanmax(kept[name][here]) == np.nanmax(group)


def test_a_reader_gets_the_points_that_are_new_to_it() -> None:
    trace = Trace(1, 10)
    trace.add(TICKS[:4], {"a": TICKS[:4]})
    assert trace.since(0)["a"].tolist() == [0, 1, 2, 3]
    seen = trace.total
    trace.add(TICKS[4:7], {"a": TICKS[4:7]})
    assert trace.since(seen)["a"].tolist() == [4, 5, 6]
    assert trace.since(trace.total)["a"].size == 0
    trace.add(TICKS[7:100], {"a": TICKS[7:100]})
    assert trace.since(seen)["a"].tolist() == list(range(90, 100))
