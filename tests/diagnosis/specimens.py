"""Specimens driven by their deformation whose forces are computed step by step, apart from the models."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from common.plan.plan import Plan
from common.roles import MASTER
from diagnosis.fits import residuals
from diagnosis.fits.residuals import Data
from diagnosis.recorded.column_alone import ColumnAlone
from diagnosis.recorded.nuisances import Nuisance
from diagnosis.recorded.parts import Measured, Part
from laboratories.effects import CATALOGUE
from laboratories.effects.effect import Effect
from loop import replay
from models.registry import Array
from models.specimens.fit import forces
from models.system import System

INTERVAL, TICKS, NOISE = 0.002, 4000, 100.0
K, LIMIT, HARDENING = Plan().column.stiffness, 1.2e-3, 0.05


def swelling() -> Array:
    """A motion whose cycles grow and then shrink."""
    t = np.arange(TICKS) * INTERVAL
    return np.asarray(2.6e-3 * np.sin(2.0 * np.pi * 1.3 * t) * np.sin(np.pi * t / t[-1]))


def slider(x: Array) -> Array:
    """A spring in parallel with a spring and slider in series, computed step by step."""
    held, result = 0.0, np.empty(x.size)
    for i, step in enumerate(np.diff(x, prepend=0.0)):
        held = min(max(held + step, -LIMIT), LIMIT)
        result[i] = K * (HARDENING * x[i] + (1.0 - HARDENING) * held)
    return result


class MadeSpecimen(Measured):
    """A column alone, whose forces follow another law than the catalogue's first one."""

    name, role, exact = "column", MASTER, False
    signals: tuple[str, ...] = ("column_force",)
    nuisances: tuple[Nuisance, ...] = ()
    candidates: tuple[Effect, ...] = (CATALOGUE["column.yielding"],)

    def __init__(self) -> None:
        self.motion = swelling()
        noise = NOISE * np.random.default_rng(1).standard_normal(TICKS)
        self.measured = (slider(self.motion) + noise)[:, None]
        self.present = np.ones((TICKS, 1), dtype=bool)

    def predict(self, system: System) -> Array:
        return replay.column(system, self.motion)[:, None]

    def first(self, ticks: int) -> MadeSpecimen:
        raise NotImplementedError


class Driven(ColumnAlone):
    """A column alone that yields by the pinched law, driven by its deformation."""

    TRUE: ClassVar = {
        "hardening": 0.03,
        "first_bend": 0.5,
        "second_stiffness": 0.6,
        "pinch_force": 0.3,
        "pinch_displacement": 0.5,
        "unloading": 0.3,
        "damage": 0.02,
        "asymmetry": 0.2,
    }

    def __init__(self) -> None:
        self.signals, self.nuisances, self.candidates = ("column_force",), (), MadeSpecimen.candidates
        self.role = MASTER
        self.inputs = swelling()
        force = forces("pinched", {"stiffness": K, "yield_displacement": LIMIT, **self.TRUE}, self.inputs)
        self.measured = (force + NOISE * np.random.default_rng(2).standard_normal(TICKS))[:, None]
        self.present = np.ones((TICKS, 1), dtype=bool)


def data_of(part: Part, system: System | None = None) -> Data:
    """The residuals of a specimen under the default plan, or another one, in units of its noise."""
    group, train = residuals.withheld(TICKS, INTERVAL)
    level = np.array([NOISE])
    return Data(part, system or System(Plan()), level, level, group, train, np.zeros(1))
