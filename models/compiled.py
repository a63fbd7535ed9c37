"""The options with which all kernels are compiled.

A kernel works on the arrays it is given: it allocates none and returns none, and its caller holds them while it runs.
Numba therefore need not count references to them, and the option `_nrt` turns the counting off. With it the closed loop
would take several times as long, because Numba removes needless counts within a single kernel, but hardly any once many
kernels are merged.

Numba neither documents nor guarantees `_nrt`, which its own functions use (numba/numba#1204); in a version without it,
references are counted and kernels are slower. With the option, a kernel that allocates or returns a view does not
compile. A tuple of views compiles, but whole arrays would be returned in their place, so a test forbids any array.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
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


def bound(enter: Callable[..., Any], record: tuple[Any, ...], *example: Any) -> Callable[..., Any]:
    """The kernel `enter` with its first argument given, for a loop that calls one compiled step a tick.

    `example` has the types of the further arguments. Numba looks up the types of all arguments at every call, those of
    a record's arrays in 0.3 to 0.6 µs: as long as the step itself takes. Here they are looked up once.

    Raises:
        numba.core.errors.TypingError: the kernel does not take arguments of these types.
    """
    arguments = (plain(record), *example)
    compiled = cast(Any, enter).compile(tuple(map(numba.typeof, arguments)))
    return partial(compiled, arguments[0])


def plain(record: tuple[Any, ...]) -> tuple[Any, ...]:
    """A record of arrays as a plain tuple, and records within it likewise, as an `enter` takes it.

    Numba unpacks a plain tuple in a fraction of the time that it takes for a named one.
    """
    return tuple(plain(part) if isinstance(part, tuple) else part for part in record)


def jit_apart(function: Function) -> Function:
    """Compile a kernel that its callers seldom need: it is not merged into them, so that they stay small."""
    compiled = numba.njit(cache=True, error_model="numpy", nogil=True, **UNCOUNTED)
    return cast(Function, compiled(function))
