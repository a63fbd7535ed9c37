"""The one way kernels are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

from models.cache import folder

Function = TypeVar("Function", bound=Callable[..., object])

numba.config.CACHE_DIR = str(folder())  # type: ignore[attr-defined]


def jit(function: Function) -> Function:
    """Compile a kernel on its first call.

    Divisions by zero give inf or nan as in NumPy, the interpreter's lock is released, and a kernel is
    merged into the one that calls it: views of arrays passed between them would cost more than the work.
    """
    compiled = numba.njit(cache=True, error_model="numpy", nogil=True, forceinline=True)
    return cast(Function, compiled(function))


def jit_apart(function: Function) -> Function:
    """Compile a kernel that is seldom needed by those that call it: it stays out of them, and they stay lean."""
    compiled = numba.njit(cache=True, error_model="numpy", nogil=True)
    return cast(Function, compiled(function))
