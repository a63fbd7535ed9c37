"""The same work on many items: one after the other, by several processes, or by the machines of a Dask cluster."""

from __future__ import annotations

import contextlib
import importlib
import signal
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import resource_tracker
from typing import Any, TypeVar

from common.errors import InputError

Item = TypeVar("Item")
Result = TypeVar("Result")


def spread(
    function: Callable[[Item], Result], items: Sequence[Item], jobs: int = 1, dask: str = ""
) -> Iterator[Result]:
    """Results in the order in which they are ready; `dask` is the address of a scheduler.

    Raises:
        InputError: a needed package is not installed, or the scheduler cannot be reached.
    """
    if jobs == 1 and not dask:
        yield from map(function, items)
        return
    joblib = needed("joblib", "--jobs")
    with _backend(joblib, jobs, dask):
        tasks = (joblib.delayed(function)(item) for item in items)
        mode = "generator" if dask else "generator_unordered"
        with uninterrupted():  # the workers start here
            results = joblib.Parallel(n_jobs=-1 if dask else jobs, return_as=mode)(tasks)
        yield from results


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Delay Ctrl-C until the block ends; a process that starts within ignores it, and this process ends it."""
    if not hasattr(signal, "pthread_sigmask"):  # not POSIX
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def needed(package: str, option: str) -> Any:
    """Import a package that only an option needs."""
    try:
        return importlib.import_module(package)
    except ImportError:
        name = package.partition(".")[0]
        raise InputError(f"{option} needs the package {name}: install it, or omit the option.") from None


@contextlib.contextmanager
def _backend(joblib: Any, jobs: int, dask: str) -> Iterator[None]:
    if not dask:
        loky = importlib.import_module("joblib.externals.loky")
        resource_tracker.ensure_running()  # before the workers, because its start lets signals through again
        done = False
        try:
            with joblib.parallel_config(backend="loky", n_jobs=jobs, inner_max_num_threads=1):
                yield
            done = True
        finally:  # the pool would otherwise wait for more work, and for work whose result is not needed
            loky.get_reusable_executor().shutdown(wait=True, kill_workers=not done)
        return
    distributed = needed("dask.distributed", "--dask")
    try:
        client = distributed.Client(dask, timeout="10s")
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"Cannot reach the Dask scheduler at {dask}: {error}.") from None
    with client, joblib.parallel_config(backend="dask"):
        yield
