"""Readings whose scale bends far above what they reach, which a fine sensor shows."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.fits import fitting, residuals, screening, settling
from diagnosis.fits.fitting import excess
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import search
from diagnosis.recorded.parts import FINE_ERROR, MODEL_ERROR
from laboratories.effects import CATALOGUE
from tests.diagnosis.cases import Cases, lab_b

NAME = "sensor.damper_stroke.saturation"
SHARPNESS = 3.4  # between those at which it is looked for


@pytest.mark.long
@pytest.mark.parametrize(("farther", "erring"), [(3.5, MODEL_ERROR), (6.0, FINE_ERROR)])
def test_a_scale_that_bends_far_above_what_is_reached_is_named(
    farther: float, erring: float, cases: Cases
) -> None:
    peak = float(np.max(np.abs(cases.record({}, duration=8.0).signals["damper_stroke"])))
    whole = cases.record({NAME: {"limit": farther * peak, "sharpness": SHARPNESS}}, duration=8.0)
    data = residuals.prepare(lab_b(whole), whole)
    bare = settling.settled(fitting.fit(data, {}))
    slight = screening.slightly_bent(CATALOGUE[NAME], screening.Plane(bare), Scales(whole))
    assert slight[0].gain > 0.5 * excess(bare)
    found = search(data, Scales(whole))
    assert found.chosen.names == (NAME,)
    assert found.data.erring == erring
    assert found.chosen.values[NAME]["limit"] == pytest.approx(farther * peak, rel=0.1)


@pytest.mark.long
def test_a_motor_that_saturates_far_above_what_it_reaches_is_named(cases: Cases) -> None:
    name, farther = "damper.force_limit", 8.0
    peak = float(np.max(np.abs(cases.record({}, duration=8.0).signals["damper_command"])))
    given = {"force": farther * peak, "sharpness": 2.0, "law": 1.0}
    whole = cases.record({name: given}, duration=8.0)
    data = residuals.prepare(lab_b(whole), whole)
    bare = settling.settled(fitting.fit(data, {}))
    slight = screening.slightly_bent(CATALOGUE[name], screening.Plane(bare), Scales(whole))
    assert slight[0].values["law"] == 1.0
    found = search(data, Scales(whole))
    assert found.chosen.names == (name,)
    assert found.chosen.values[name]["force"] == pytest.approx(farther * peak, rel=0.3)
