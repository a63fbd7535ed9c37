"""The share of the gap that effects close in the next test of a case."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from common.plan.plan import Plan
from common.plan.read import with_test
from common.reality.reality import Reality, from_reality
from common.reality.spread import Spread
from laboratories.kinds import kinds_of
from loop.of_reality import really
from loop.signals import by_role
from simulation.prediction.draws import FoundLaboratories
from validation.blind.predicted import results
from validation.blind.predicted.closed import closed
from validation.blind.predicted.next_test import Readings
from validation.blind.predicted.predict import PredictedCase

PLAN = with_test(Plan(), duration=3.0)
NOISE = {role: dict.fromkeys(kind.channels.names, 1e-9) for role, kind in kinds_of(PLAN).items()}
LOUD = {role: dict.fromkeys(kind.channels.names, 1e9) for role, kind in kinds_of(PLAN).items()}


def with_friction(force: float) -> Reality:
    """Laboratories whose damper rubs with a force in N; none for 0."""
    effects = [{"name": "damper.friction", "force": force}] if force else []
    return from_reality({"effect": effects}, PLAN, Path())


def found(force: float) -> FoundLaboratories:
    """The same laboratories as a diagnosis finds them."""
    return FoundLaboratories(with_friction(force), Spread())


@pytest.fixture(scope="module")
def readings() -> Readings:
    """The readings of laboratories whose damper rubs with 3 N, without noise."""
    return by_role(PLAN, really(with_friction(3.0), noise=False))


@pytest.mark.parametrize(("force", "least", "most"), [(3.0, 1.0, 1.0), (2.7, 0.7, 0.95), (9.0, -3.0, -0.5)])
def test_the_share_that_closes_has_the_sign_and_size_of_what_the_effect_explains(
    readings: Readings, force: float, least: float, most: float
) -> None:
    assert least <= closed(found(force), PLAN, readings, NOISE) <= most


def test_no_share_is_judged_without_effects_or_where_noise_hides_the_gap(readings: Readings) -> None:
    assert math.isnan(closed(found(0.0), PLAN, readings, NOISE))
    assert math.isnan(closed(found(3.0), PLAN, readings, LOUD))


def test_a_stated_share_agrees_where_it_is_within_a_tenth() -> None:
    case = PredictedCase(1, "catalogue", ["damper.friction"], "m", 1.0, 1.0, 0.1, 0.9, [], closed=0.9)
    cases = [replace(case, stated=stated) for stated in (0.95, 0.85, 0.7, math.nan)]
    agrees = results.measures(cases)[-1]
    assert agrees.value == pytest.approx(2.0 / 3.0)
    assert agrees.count == 3
