"""Where much of a gap is left, a simpler effect that tells the strongest part of a motion stands first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from common.plan.plan import Plan
from diagnosis.fits import fitting, residuals, trade
from diagnosis.fits.fitting import Fit
from diagnosis.fits.residuals import Data
from laboratories.effects import CATALOGUE
from loop import replay
from models.registry import Array
from models.system import System
from tests.diagnosis.test_laws import INTERVAL, NOISE, TICKS, FrictionDamper, swelling

Values = dict[str, dict[str, float]]
WORN: Values = {"column.degradation": {"rate": 0.5}}
PINCHED: Values = {"column.pinching": {"factor": 0.3, "width": 1e-3, "hardening": 0.0}}


class Made(FrictionDamper):
    """A column alone with an effect, beside a force that is in no catalogue and acts at small deformations only."""

    def __init__(self, effect: Values, beside: float, motion: Array) -> None:
        super().__init__()
        (name,), (values,) = effect.keys(), effect.values()
        self.inputs = motion
        force = replay.column(CATALOGUE[name].apply(System(Plan()), **values), motion)
        force += beside * np.sin(motion / 1.5e-4) * (np.abs(motion) < 1e-3)
        self.measured = (force + NOISE * np.random.default_rng(6).standard_normal(TICKS))[:, None]
        self.candidates = ()


def fits(truth: Values, beside: float, motion: Array) -> tuple[Fit, Fit, Fit]:
    """The fits without effects, and with the effects `WORN` and `PINCHED`."""
    group, train = residuals.withheld(TICKS, INTERVAL)
    level = np.array([NOISE])
    data = Data(Made(truth, beside, motion), System(Plan()), level, level, group, train, np.zeros(1))
    bare, worn, pinched = (fitting.fit(data, values) for values in ({}, WORN, PINCHED))
    return bare, worn, pinched


def test_a_simpler_effect_stands_where_it_tells_the_strongest_part() -> None:
    bare, worn, pinched = fits(WORN, 6e3, swelling())
    assert trade.holding(bare, pinched, [worn]) is worn


def test_a_closer_fit_stands_where_the_simpler_one_does_not_tell_the_strongest_part() -> None:
    bare, worn, pinched = fits(PINCHED, 6e3, swelling())
    assert trade.holding(bare, pinched, [worn]) is pinched


def test_the_fit_decides_where_little_is_left() -> None:
    bare, worn, pinched = fits(WORN, 0.0, swelling())
    exact = replace(pinched, reduced=worn.reduced)
    assert trade.holding(bare, exact, [worn]) is exact


@pytest.mark.parametrize("ticks", [0, 300])
def test_a_motion_that_is_strongest_at_once_has_no_weaker_part(ticks: int) -> None:
    motion = 2e-3 * np.sin(np.pi * np.minimum(np.arange(TICKS) / (ticks + 1), 0.5))
    _, worn, _ = fits(WORN, 0.0, motion)
    assert trade.weaker(worn) is None
