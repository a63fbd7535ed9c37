"""The one way kernels are compiled.

A kernel works on the arrays it is given: it allocates none and returns none, and its caller holds them while
it runs. Numba therefore need not count references to them, and is told so. Counting costs several times the
closed loop's own work, as what proves needless is dropped within a kernel, but hardly once many are merged.

`_nrt` is neither documented nor promised by Numba, whose own functions use it (numba/numba#1204); where it is
missing, references are counted and kernels are slower. With it, an allocation or a view returned does not
compile; a tuple of views does, and whole arrays would come back in their place, so tests forbid any array.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core.options import DefaultOptions

from models.cache import folder

Function = TypeVar("Function", bound=Callable[..., object])

UNCOUNTED: dict[str, Any] = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}

MERGED: Any = {
    "error_model": "numpy",
    "forceinline": True,
} | UNCOUNTED  # into the kernel that calls

numba.config.CACHE_DIR = str(folder())  # type: ignore[attr-defined]


def jit(function: Function) -> Function:
    """Compile a kernel on its first call.

    Divisions by zero give inf or nan as in NumPy, the interpreter's lock is released, and a kernel is
    merged into the one that calls it: views of arrays passed between them would cost more than the work.
    """
    compiled = numba.njit(cache=True, nogil=True, **MERGED)
    return cast(Function, compiled(function))


def plain(record: tuple[Any, ...]) -> tuple[Any, ...]:
    """A record of arrays as plain tuples, records within it likewise.

    A loop that calls one compiled step a tick hands these to the step's `enter`: Numba looks up the types of a
    plain tuple in 1 µs, those of a named one in 3 to 8 µs.
    """
    return tuple(plain(part) if isinstance(part, tuple) else part for part in record)


def jit_apart(function: Function) -> Function:
    """Compile a kernel that is seldom needed by those that call it: it stays out of them, and they stay lean."""
    compiled = numba.njit(cache=True, error_model="numpy", nogil=True, **UNCOUNTED)
    return cast(Function, compiled(function))
