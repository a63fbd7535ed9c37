"""One thread of the linear algebra library in each process."""

from __future__ import annotations

from contextlib import AbstractContextManager

from threadpoolctl import threadpool_limits


def one_thread() -> AbstractContextManager[object]:
    """One BLAS thread within the context: sums over several differ in their last bits with the number of threads.

    It is also faster where processors are shared: a scalar product of 20,000 samples, which takes 10 µs, took 37 ms
    with two threads on two busy processors, because each thread waited for the other one's turn.
    """
    found: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return found
