"""The same work on many items: one after the other, by several processes, or by the machines of a Dask cluster.

A worker that is killed loses nothing: the items whose results it has not handed over are computed again. ADR 0046.
"""

from __future__ import annotations

import contextlib
import importlib
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from functools import partial
from multiprocessing import resource_tracker
from typing import TypeVar

from common.errors import InputError
from models import cache
from simulation.workers import cluster
from simulation.workers.needed import needed

Item = TypeVar("Item")
Result = TypeVar("Result")

# Times in a row that all processes may be lost without a single result in between. A process that somebody kills is
# one; an item that always needs more memory than there is would otherwise be tried for ever.
MOST_LOST = 3


def spread(
    function: Callable[[Item], Result], items: Sequence[Item], jobs: int = 1, dask: str = ""
) -> Iterator[Result]:
    """Results in the order in which they are ready, one for each item; `dask` is the address of a scheduler.

    `function` and the items must be such that pickle can send them to another process.

    Raises:
        InputError: a needed package is not installed, the scheduler cannot be reached, or workers are lost again and
            again; and whatever `function` raises.
        LostError: the scheduler is lost.
    """
    if dask:
        return cluster.spread(function, items, dask)
    if jobs == 1:
        return map(function, items)
    return over_processes(function, items, jobs)


def over_processes(function: Callable[[Item], Result], items: Sequence[Item], jobs: int) -> Iterator[Result]:
    """As `spread`, by `jobs` processes, −1 for one per processor."""
    if not cache.warm():  # otherwise every worker would compile each kernel
        from simulation.warm import compile_all

        compile_all()
    left = dict(enumerate(items))
    lost = 0
    while left:
        try:
            for place, result in in_pool(partial(numbered, function), list(left.items()), jobs):
                del left[place]
                lost = 0
                yield result
        except BrokenExecutor:
            lost += 1
            if lost == MOST_LOST:
                raise InputError(
                    f"Worker processes ended {lost} times in a row without a result, as they do when memory runs out: "
                    "give fewer --jobs."
                ) from None


def numbered(function: Callable[[Item], Result], item: tuple[int, Item]) -> tuple[int, Result]:
    """The result of an item with the item's number."""
    return item[0], function(item[1])


def in_pool(function: Callable[[Item], Result], items: Sequence[Item], jobs: int) -> Iterator[Result]:
    """Results in the order in which they are ready; raises BrokenExecutor where a process is lost."""
    joblib = needed("joblib", "--jobs")
    loky = importlib.import_module("joblib.externals.loky")
    resource_tracker.ensure_running()  # before the workers, because its start lets signals through again
    done = False
    try:
        with joblib.parallel_config(backend="loky", n_jobs=jobs, inner_max_num_threads=1):
            tasks = (joblib.delayed(function)(item) for item in items)
            with uninterrupted():  # the workers start here
                results = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered")(tasks)
            yield from results
        done = True
    finally:  # the pool would otherwise wait for more work, and for work whose result is not needed
        loky.get_reusable_executor().shutdown(wait=True, kill_workers=not done)


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


def check(jobs: int, dask: str) -> None:
    """Raise InputError for values of --jobs and --dask that cannot be used, before any work is done."""
    if not (jobs >= 1 or jobs == -1):
        raise InputError(f"--jobs is {jobs}, but must be at least 1, or -1 for all processors.")
    if dask:
        needed("distributed", "--dask")
    elif jobs != 1:
        needed("joblib", "--jobs")
