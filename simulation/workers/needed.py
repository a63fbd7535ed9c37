"""Packages that only an option needs."""

from __future__ import annotations

import importlib
from typing import Any

from common.errors import InputError

INSTALL = {"distributed": "`make cluster` installs it"}


def needed(package: str, option: str) -> Any:
    """Import a package that only an option needs; raises InputError where it is not installed."""
    try:
        return importlib.import_module(package)
    except ImportError:
        name = package.partition(".")[0]
        how = INSTALL.get(name, "install it")
        raise InputError(f"{option} needs the package {name}: {how}, or omit the option.") from None
