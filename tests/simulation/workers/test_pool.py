"""Work spread over processes, which are killed now and then."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from common.errors import InputError
from simulation.workers.pool import check, over_processes, spread
from tests.processes import HANG_S

pytestmark = pytest.mark.filterwarnings(
    "ignore:.*worker:UserWarning", "ignore:.*cancelled:UserWarning"
)  # joblib's


def hears_ctrl_c(_: int) -> bool:
    return signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def killed_once(item: tuple[int, str]) -> int:
    """The item's number; the process of number 2 is killed the first time."""
    number, mark = item
    if number == 2 and not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def killed(_: int) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_worker_processes_ignore_ctrl_c() -> None:
    assert list(spread(hears_ctrl_c, range(4), jobs=2)) == [False] * 4
    assert hears_ctrl_c(0)


def test_a_single_job_runs_without_worker_processes() -> None:
    assert list(spread(abs, [-3, 2], jobs=1)) == [3, 2]


def test_work_whose_results_are_no_longer_read_is_not_waited_for() -> None:
    began = time.monotonic()
    results = over_processes(time.sleep, [0.0, 0.0, 1000.0, 1000.0], 2)
    next(results)
    results.close()  # type: ignore[attr-defined]
    assert time.monotonic() - began < HANG_S


def test_a_killed_worker_loses_no_item_and_repeats_none(tmp_path: Path) -> None:
    items = [(number, str(tmp_path / "mark")) for number in range(12)]
    assert sorted(spread(killed_once, items, jobs=2)) == list(range(12))
    assert (tmp_path / "mark").exists()


def test_an_item_that_ends_every_worker_is_given_up() -> None:
    with pytest.raises(
        InputError, match="3 times in a row without a result, as they do when memory runs out"
    ):
        list(spread(killed, [1], jobs=2))


def test_unusable_numbers_of_jobs_are_refused() -> None:
    with pytest.raises(InputError, match="--jobs is 0, but must be at least 1, or -1 for all processors."):
        check(0, "")
