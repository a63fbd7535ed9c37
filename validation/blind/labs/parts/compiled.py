"""Compilation of the independent laboratories' kernels.

They share no kernel with `models`. Compiled code is kept in a folder named after the content of this
package, because Numba compares only a function's own file with its cache.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

import numba
import numpy as np
from numpy.typing import NDArray

from models import cache

Array = NDArray[np.float64]
Function = TypeVar("Function", bound=Callable[..., object])

FOLDER = cache.folder().parent / f"trial-labs-{cache.fingerprint(Path(__file__).parents[1])}"


def jit(function: Function) -> Function:
    """Compile a kernel on its first call, kept between processes."""
    before = numba.config.CACHE_DIR  # type: ignore[attr-defined]
    numba.config.CACHE_DIR = str(FOLDER)  # type: ignore[attr-defined]
    try:
        compiled = numba.njit(cache=True, error_model="numpy", nogil=True)(function)
    finally:
        numba.config.CACHE_DIR = before  # type: ignore[attr-defined]
    return cast(Function, compiled)
