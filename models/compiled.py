"""The one way kernels are compiled, and where the compiled code is kept between processes.

Numba's on-disk cache looks at a function's own file only, so a kernel whose callee changed would be
served stale. The cache folder is therefore named after the content of every file of `models`.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., object])


def fingerprint(root: Path) -> str:
    """Sixteen hex digits that change with the name or content of any Python file below `root`."""
    digest = hashlib.blake2b(sys.version.encode(), digest_size=8)
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def cache_folder() -> Path:
    """Folder for compiled kernels: in the user's cache, or in a temporary folder where that is not writable."""
    name = fingerprint(Path(__file__).parent)
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "rths" / "kernels" / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        folder = Path(tempfile.gettempdir()) / f"rths-kernels-{os.getuid()}-{name}"
        folder.mkdir(mode=0o700, exist_ok=True)
    return folder


if not os.environ.get("NUMBA_CACHE_DIR"):
    numba.config.CACHE_DIR = str(cache_folder())


def jit(function: Function) -> Function:
    """Compile a kernel on its first call; divisions by zero give inf or nan as in NumPy; the GIL is released."""
    return cast(Function, numba.njit(cache=True, error_model="numpy", nogil=True, forceinline=True)(function))
