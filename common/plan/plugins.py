"""Rigs that a plan or a reality names: by a class, 'file.py:Class' or 'package.module:Class', or by an address."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

from common import blame
from common.errors import InputError, PlanError
from common.plan.laboratory_tables import RigTable
from common.udp.peer import place

NO_METHODS: Mapping[str, Sequence[str]] = MappingProxyType({})


def checked(rig: RigTable, where: str) -> RigTable:
    """The rig of a plan's table `where`; raises PlanError where its keys do not fit together."""
    if rig.class_ and rig.address:
        raise PlanError(f"[{where}] gives a class and an address, but a rig is one of both: leave one out.")
    if rig.options and rig.address:
        raise PlanError(f"options in [{where}] are for a class: leave them out beside an address.")
    if rig.address:
        place(rig.address, f"[{where}]")
    return rig


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
        source = str(base / place) if place.endswith(".py") else ""
        raise InputError(
            f"Cannot load '{place}' named in {where}: {blame.described(error, source)}."
        ) from error
    found = getattr(module, name, None)
    if not isinstance(found, type):
        raise InputError(f"'{place}' named in {where} has no class '{name}'.")
    return found


def _from_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise InputError(
            f"There is no file {path}: a plug-in's path starts from the folder of the plan, reality or recording "
            "that names it. Put the file there, or give the plan beside it with --plan where a recording names it."
        )
    digest = hashlib.blake2b(bytes(path.resolve()), digest_size=8).hexdigest()
    name = f"rths_plugin_{path.stem}_{digest}"  # the same in every process, because compiled kernels are kept by name
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path} is no Python file.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def construct(
    kind: type[Any],
    arguments: Mapping[str, Any],
    where: str,
    methods: Mapping[str, Sequence[str]] = NO_METHODS,
) -> Any:
    """An instance of a user's class, after a check that it has all `methods`, which go by name with their parameters.

    Raises:
        InputError: with the class's own complaint where the options do not fit, or for a method that it lacks.
    """
    try:
        built = kind(**arguments)
    except InputError:
        raise
    except (Exception, SystemExit) as error:  # a user's class may raise anything
        text = blame.described(error, blame.source_of(kind))
        raise InputError(f"Cannot construct {kind.__name__} named in {where}: {text}.") from error
    for name, parameters in methods.items():
        if complaint := unfit(getattr(built, name, None), parameters):
            called = f"{name}({', '.join(parameters)})"
            file = Path(blame.source_of(kind)).name or "no file"
            raise InputError(
                f"{kind.__name__} ({file}) named in {where} {complaint}, but must have {called}: "
                f"it takes the methods {', '.join(methods)}."
            )
    return built


def unfit(method: object, parameters: Sequence[str]) -> str:
    """What is wrong with a method that is called with these parameters; empty where nothing is."""
    if method is None:
        return "lacks a method"
    if not callable(method):
        return f"has {method!r} for a method"
    if inspect.iscoroutinefunction(method):
        return "has an async method, which is never awaited"
    try:
        inspect.signature(method).bind(*parameters)
    except TypeError as error:
        return f"has a method with other parameters ({error})"
    except ValueError:  # written in C, without a signature to look at
        pass
    return ""
