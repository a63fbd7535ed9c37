"""Faults of a Dask cluster are reported in one sentence; tests/system/test_cluster.py kills its workers."""

from __future__ import annotations

from concurrent.futures import CancelledError
from types import SimpleNamespace
from typing import Any

import pytest

from common.errors import InputError, LostError
from simulation.workers import cluster
from simulation.workers.pool import spread
from simulation.workers.versions import versions

distributed = pytest.importorskip("distributed", reason="Dask is not installed: make cluster")
ADDRESS = "tcp://127.0.0.1:1"


class Failed:
    """A future whose task failed."""

    def __init__(self, error: BaseException) -> None:
        self._error = error

    def result(self) -> Any:
        raise self._error


def test_a_worker_of_another_version_is_named() -> None:
    assert cluster.computed(abs, -2, versions()) == 2
    with pytest.raises(
        InputError, match=r"has rths .*, but the task is of rths 9: install the same version there"
    ):
        cluster.computed(abs, -2, "rths 9")


@pytest.mark.parametrize(
    ("error", "kind", "said"),
    [
        (ModuleNotFoundError("no", name="simulation"), InputError, "lacks the module 'simulation': install"),
        (CancelledError(), LostError, "is lost: the same command goes on with the rows that are there"),
        (InputError("Test 3 of the sweep: no."), InputError, "Test 3 of the sweep: no."),
    ],
)
def test_a_failed_task_is_reported_in_one_sentence(
    error: BaseException, kind: type[Exception], said: str
) -> None:
    with pytest.raises(kind, match=said):
        cluster.result(Failed(error), ADDRESS)


def test_a_task_that_ends_its_workers_is_given_up() -> None:
    last = SimpleNamespace(address="tcp://192.0.2.2:9")
    with pytest.raises(
        InputError, match=r"ended its Dask workers again and again, the last one at tcp://192.0.2.2:9"
    ):
        cluster.result(Failed(distributed.KilledWorker("task", last, 3)), ADDRESS)


def test_an_absent_scheduler_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "REACH", 0.3)
    with pytest.raises(InputError, match=f"Cannot reach the Dask scheduler at {ADDRESS}"):
        list(spread(abs, [1], dask=ADDRESS))


def test_a_scheduler_without_workers_is_reported_and_one_with_a_worker_computes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(cluster, "REACH", 5.0)
    given = {"processes": False, "dashboard_address": None, "threads_per_worker": 1}
    with distributed.LocalCluster(n_workers=1, **given) as there:
        assert sorted(spread(abs, list(range(-9, 0)), dask=there.scheduler_address)) == list(range(1, 10))
    monkeypatch.setattr(cluster, "REACH", 0.3)
    with (
        distributed.LocalCluster(n_workers=0, **given) as there,
        pytest.raises(InputError, match="has no worker: start `dask worker"),
    ):
        list(spread(abs, [1], dask=there.scheduler_address))
