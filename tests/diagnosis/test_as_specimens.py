"""Effects that are the whole specimen under a further law, which promise little beside the planned one."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from diagnosis.fits import fitting
from diagnosis.fits.laws import best
from laboratories.effects import CATALOGUE
from models.specimens.fit import forces
from tests.diagnosis.specimens import LIMIT, NOISE, TICKS, Driven, K, data_of


class Held(Driven):
    """A slider behind a fixture in the specimen's place, that slides sooner to one side."""

    SLIDER: ClassVar = {"stiffness": 0.9 * K, "push": 9e3, "pull": 10e3, "play": 0.0, "corner": 0.0}

    def __init__(self) -> None:
        super().__init__()
        self.candidates = (CATALOGUE["column.yielding"], CATALOGUE["column.friction"])
        noise = NOISE * np.random.default_rng(5).standard_normal(TICKS)
        self.measured = (forces("slider", self.SLIDER, self.inputs) + noise)[:, None]


def test_a_specimen_that_is_another_mechanism_is_found_though_that_one_promises_little_beside_it() -> None:
    bare, yields = fitting.fit(data_of(Held()), {}), CATALOGUE["column.yielding"]
    first = fitting.fit(bare.data, {yields.name: yields.values({"yield_displacement": LIMIT})})
    found = best.as_specimens(bare, [first])
    assert found[0].names == ("column.friction",)
    values = found[0].values["column.friction"]
    assert values["force"] == pytest.approx(9.5e3, rel=0.01)
    assert values["stiffness"] == pytest.approx(Held.SLIDER["stiffness"], rel=0.02)
    assert found[0].cost < 0.5 * first.cost
    assert found[1].names == first.names
    assert found[1].cost <= first.cost


class Yields(Held):
    """A column that yields at one force and hardens a little, which a slider in its place nearly does."""

    YIELDS: ClassVar = {"stiffness": 0.98 * K, "yield_displacement": 2.2e-3, "hardening": 0.04}

    def __init__(self) -> None:
        super().__init__()
        noise = NOISE * np.random.default_rng(6).standard_normal(TICKS)
        self.measured = (forces("bilinear", self.YIELDS, self.inputs) + noise)[:, None]


def test_a_mechanism_whose_first_law_ended_elsewhere_is_looked_at_as_a_specimen_too() -> None:
    bare, yields = fitting.fit(data_of(Yields()), {}), CATALOGUE["column.yielding"]
    astray = fitting.at(bare.data, {yields.name: yields.values({"yield_displacement": 5e-3})}, bare.z)
    found = best.as_specimens(bare, [astray])
    assert [item.names for item in found] == [("column.yielding",), ("column.friction",)]
    values = found[0].values["column.yielding"]
    assert values["yield_displacement"] == pytest.approx(2.2e-3, rel=0.02)
    assert values["hardening"] == pytest.approx(0.04, abs=0.02)
