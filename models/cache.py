"""The folder in which compiled kernels are kept between processes.

Numba's on-disk cache checks a function's own file only, so it would return an outdated kernel after a change of a
function that the kernel calls. The folder is therefore named after the content of all files of the packages that hold
kernels. Within it, Numba keeps kernels apart by the place of their file and by the processor, so these are in its name
too: a folder that one checkout has filled is empty for another one.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from functools import cache
from pathlib import Path

READY = "ready"
ROOMS = ("models", "laboratories", "loop")


def fingerprint(*folders: Path) -> str:
    """Sixteen hex digits that change with the name or content of any Python file in these folders."""
    digest = hashlib.blake2b(sys.version.encode(), digest_size=8)
    for path, beside in sorted((path, one.parent) for one in folders for path in one.rglob("*.py")):
        digest.update(path.relative_to(beside).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def place(root: Path) -> str:
    """Sixteen hex digits that change with the place of a checkout and with the processor."""
    from llvmlite import binding

    words = str(root.resolve()), binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()
    return hashlib.blake2b("\n".join(words).encode(), digest_size=8).hexdigest()


@cache
def folder() -> Path:
    """Folder for compiled kernels: in the user's cache, or in a temporary folder where that is not writable."""
    root = Path(__file__).parent.parent
    name = f"{fingerprint(*(root / room for room in ROOMS))}-{place(root)}"
    chosen = of_user(name)
    if chosen is None:
        chosen = Path(tempfile.gettempdir()) / f"rths-kernels-{os.getuid()}-{name}"
        chosen.mkdir(mode=0o700, exist_ok=True)
    return chosen


def of_user(name: str) -> Path | None:
    """The folder of that name in the user's cache, None where the user has no home or may not write there."""
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        chosen = base / "rths" / "kernels" / name
        chosen.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # the latter: neither HOME nor an entry of the user says where home is
        return None
    return chosen if os.access(chosen, os.W_OK | os.X_OK) else None


def warm() -> bool:
    """Whether the kernels of this version have been compiled on this machine."""
    return (folder() / READY).exists()
