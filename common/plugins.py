"""Classes that a plan or a reality names: 'file.py:Class' or 'package.module:Class'."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from common.errors import InputError


def find(reference: str, base: Path, where: str) -> type[Any]:
    """The class behind a reference; file paths start from `base`; `where` stands in errors.

    Raises:
        InputError: the reference is malformed, its file or module fails to load, or holds no such class.
    """
    place, separator, name = reference.rpartition(":")
    if not separator or not place or not name:
        raise InputError(
            f"class in {where} is '{reference}', but must be 'file.py:Class' or 'package.module:Class'."
        )
    try:
        module = _from_file(base / place) if place.endswith(".py") else importlib.import_module(place)
    except InputError:
        raise
    except Exception as error:  # a user's file may raise anything on import
        raise InputError(
            f"Cannot load '{place}' named in {where}: {type(error).__name__}: {error}."
        ) from error
    found = getattr(module, name, None)
    if not isinstance(found, type):
        raise InputError(f"'{place}' named in {where} has no class '{name}'.")
    return found


def _from_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise InputError(
            f"There is no file {path}: a plug-in's path starts from the folder of the plan or reality."
        )
    name = f"rths_plugin_{path.stem}_{abs(hash(path.resolve()))}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path} is no Python file.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def construct(kind: type[Any], arguments: Mapping[str, Any], where: str) -> Any:
    """An instance; raises InputError with the class's own complaint where the options do not fit."""
    try:
        return kind(**arguments)
    except InputError:
        raise
    except Exception as error:  # a user's class may raise anything
        raise InputError(f"Cannot construct {kind.__name__} named in {where}: {error}.") from error
