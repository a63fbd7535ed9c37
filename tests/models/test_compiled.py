"""What kernels must keep to, as references to arrays are not counted in them."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.errors import NumbaError

import laboratories
import loop
import models
from models import compiled
from models.registry import Array


def kernels() -> dict[str, Callable[..., object]]:
    """The plain functions of all kernels by name."""
    found = {}
    rooms = [*models.__path__, *laboratories.__path__, *loop.__path__]
    modules = [item for room in rooms for item in pkgutil.walk_packages([room], f"{Path(room).name}.")]
    for item in modules:
        for name, value in vars(importlib.import_module(item.name)).items():
            if hasattr(value, "nopython_signatures"):
                found[f"{item.name}.{name}"] = value.py_func
    return found


def test_no_kernel_returns_an_array() -> None:
    returned = {name: kernel.__annotations__["return"] for name, kernel in kernels().items()}
    assert "loop.closed_loop.roll" in returned
    allowed = {"None", "int", "float", "bool"}
    for name, words in returned.items():
        inner = words.removeprefix("tuple[").removesuffix("]")
        assert set(inner.split(", ")) <= allowed, f"{name} returns {words}"


def allocating(size: int) -> float:
    kept: Array = np.zeros(size)
    return float(kept[0])


def test_a_kernel_that_allocates_does_not_compile() -> None:
    assert numba.njit(cache=False)(allocating)(3) == 0.0
    with pytest.raises(NumbaError):
        compiled.jit(allocating)(3)
