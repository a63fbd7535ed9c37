"""The folder of recordings: whether it can be written, how fast, how long a sync takes, how much space is free.

The data go into a file without a name, which the system removes however the check ends.
"""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

from common.errors import InputError

PACE = 0.1  # s, from flush to flush, as the recorder does it
PIECE = 100_000  # bytes per flush: 1 MB/s, more than a recorder of several slaves writes


def nearest(folder: Path) -> Path:
    """The folder itself, or the nearest one above it that exists; raises InputError where a file is in the way."""
    place = folder.absolute()
    while not there(place):
        place = place.parent
    if not place.is_dir():
        raise InputError(f"'{place}' is a file: give the folder of the recordings with -o.")
    return place


def there(place: Path) -> bool:
    """Whether a file or folder exists, as far as this user may see."""
    try:
        return place.exists()
    except PermissionError:
        return False


def measure(folder: Path, until: float) -> dict[str, Any]:
    """Write and sync pieces at a recorder's pace until a time of the monotonic clock; times in s.

    `error` says why nothing could be written.
    """
    found: dict[str, Any] = {"folder": str(folder)}
    try:
        found["free"] = shutil.disk_usage(folder).free
        with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
            syncs, spent = write(file.fileno(), until)
    except OSError as error:
        return found | {"error": error.strerror or str(error)}
    return found | {
        "syncs": len(syncs),
        "worst_sync": max(syncs),
        "median_sync": sorted(syncs)[len(syncs) // 2],
        "rate": len(syncs) * PIECE / max(spent, 1e-9),
    }


def write(descriptor: int, until: float) -> tuple[list[float], float]:
    """Write a piece every `PACE`, at least once; the time that each took to reach the disk and their sum, s."""
    piece = os.urandom(PIECE)  # random, so that a file system cannot compress it
    times: list[float] = []
    while not times or time.monotonic() < until:
        began = time.monotonic()
        os.write(descriptor, piece)
        (os.fdatasync if hasattr(os, "fdatasync") else os.fsync)(descriptor)
        times.append(time.monotonic() - began)
        time.sleep(max(0.0, min(began + PACE, until) - time.monotonic()))
    return times, sum(times)
