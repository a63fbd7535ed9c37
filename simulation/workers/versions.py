"""The versions that are needed to compute a result again."""

from __future__ import annotations

import platform
from functools import cache
from importlib import metadata
from pathlib import Path

from models.cache import fingerprint

ROOMS = ("common", "models", "laboratories", "loop", "diagnosis", "simulation", "validation")
PACKAGES = ("numba", "numpy", "scipy")


@cache
def versions() -> str:
    """The version of rths with a fingerprint of its code, of Python, and of the packages that compute."""
    root = Path(__file__).resolve().parents[2]
    code = fingerprint(*(root / room for room in ROOMS))
    packages = ", ".join(f"{name} {metadata.version(name)}" for name in PACKAGES)
    return f"rths {metadata.version('rths')} (code {code}), Python {platform.python_version()}, {packages}"
