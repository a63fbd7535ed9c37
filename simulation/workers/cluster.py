"""Work spread over the machines of a Dask cluster, which share no file system with this one.

What a task needs travels with it. Dask gives the tasks of a worker that is lost to another one.
"""

from __future__ import annotations

import contextlib
import logging
import socket
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from typing import Any, TypeVar

from common.errors import InputError, LostError
from simulation.workers.needed import needed
from simulation.workers.versions import versions

Item = TypeVar("Item")
Result = TypeVar("Result")

REACH = 10.0  # s, for a scheduler to answer and for its first worker to be there
AHEAD = (
    2  # tasks with the scheduler for each thread of its workers: none waits, and few inputs are held there
)


def spread(function: Callable[[Item], Result], items: Sequence[Item], address: str) -> Iterator[Result]:
    """Results in the order in which they are ready.

    Raises:
        InputError: Dask is not installed, the scheduler cannot be reached or has no worker, a worker has another
            version of this program or lacks it, or a task ends its workers again and again.
        LostError: the scheduler is lost.
    """
    distributed = needed("distributed", "--dask")
    logging.getLogger("distributed").setLevel(
        logging.CRITICAL
    )  # its log messages are reported in one sentence below
    with connected(distributed, address) as client:
        waiting = iter(items)
        running = distributed.as_completed(loop=client.loop)
        top_up(client, running, waiting, function)
        for future in running:
            yield result(future, address)
            future.release()
            top_up(client, running, waiting, function)


def top_up(client: Any, running: Any, waiting: Iterator[Item], function: Callable[[Item], Any]) -> None:
    """Send tasks until there are `AHEAD` for each thread that the workers have, but one at least."""
    most = max(AHEAD * sum(client.nthreads().values()), 1)
    while running.count() < most:
        item = next(waiting, None)
        if item is None:
            return
        running.add(submit(client, function, item))


@contextlib.contextmanager
def connected(distributed: Any, address: str) -> Iterator[Any]:
    """A client of the scheduler, which has at least one worker; raises InputError where there is none."""
    try:
        client = distributed.Client(address, timeout=REACH, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"Cannot reach the Dask scheduler at {address}: {error}.") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=REACH)
        except TimeoutError:
            raise InputError(
                f"The Dask scheduler at {address} has no worker: start `dask worker {address}` on the machines that "
                "shall compute."
            ) from None
        yield client


def submit(client: Any, function: Callable[[Item], Result], item: Item) -> Any:
    """Send a task to the scheduler; its future."""
    return client.submit(computed, function, item, versions(), pure=False)


def computed(function: Callable[[Item], Result], item: Item, wanted: str) -> Result:
    """On a worker: the result of an item; raises InputError where the worker has another version of this program."""
    if versions() != wanted:
        raise InputError(
            f"The Dask worker on {socket.gethostname()} has {versions()}, but the task is of {wanted}: install the "
            "same version there."
        )
    return function(item)


def result(future: Any, address: str) -> Any:
    """The result of a future; errors of Dask become sentences."""
    distributed = needed("distributed", "--dask")
    try:
        return future.result()
    except ModuleNotFoundError as error:
        raise InputError(
            f"A Dask worker of {address} lacks the module '{error.name}': install what it belongs to on that machine "
            "(this program in the same version, and what your files import)."
        ) from None
    except distributed.KilledWorker as error:
        raise InputError(
            f"A task ended its Dask workers again and again, the last one at {error.last_worker.address}, as it does "
            "when memory runs out: give the workers more."
        ) from None
    except (CancelledError, distributed.comm.CommClosedError):
        raise LostError(
            f"The Dask scheduler at {address} is lost: the same command goes on with the rows that are there."
        ) from None
