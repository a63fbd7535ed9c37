"""The rules for kernels, which are compiled without counting references to arrays."""

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
from common.plan.laboratory_tables import Actuator, Column
from laboratories.column import model as column
from models import cache, compiled
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


def test_a_bound_kernel_updates_the_record_that_it_was_given() -> None:
    lab, other = (column.build(0.002, Actuator(), Column()) for _ in range(2))
    move = compiled.bound(column.enter, lab, 0.0)
    for command in np.linspace(1e-4, 2e-3, 20).tolist():
        assert move(command) == column.enter(compiled.plain(other), command)
    assert np.array_equal(lab.state, other.state)
    assert lab.state.any()


def test_a_bound_kernel_refuses_arguments_of_another_type() -> None:
    move = compiled.bound(column.enter, column.build(0.002, Actuator(), Column()), 0.0)
    with pytest.raises(TypeError):
        move(None)
    with pytest.raises(TypeError):
        move()


def test_every_checkout_and_processor_has_its_own_folder_of_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    here = cache.place(Path("/one"))
    assert cache.folder().name.endswith(cache.place(Path(compiled.__file__).parents[1]))
    assert cache.place(Path("/other")) != here == cache.place(Path("/one"))
    monkeypatch.setattr("llvmlite.binding.get_host_cpu_name", lambda: "another")
    assert cache.place(Path("/one")) != here
