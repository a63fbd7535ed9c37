"""The benchmarks with processes of their own, in their shortest form: each runs, whatever becomes of its tests."""

from __future__ import annotations

import pytest

from benchmarks import BENCHMARKS, recorder
from tests.benchmarks.test_quick import IN_REAL_TIME, plain


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(IN_REAL_TIME))
def test_a_benchmark_runs_and_gives_figures(name: str) -> None:
    found = plain(BENCHMARKS[name](quick=True))
    assert all(figure["median"] is not None for figure in found if "cable" not in figure["name"])


@pytest.mark.slow
def test_a_small_burst_is_recorded_completely() -> None:
    (burst,) = recorder.bursts(recorder.BURSTS[:1], recorder.QUICK_BURST_S)
    assert burst.whole
    assert burst.reported == 0
