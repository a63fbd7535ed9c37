"""Whether a further effect is worth its parameters."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from diagnosis.fits import worth
from diagnosis.fits.fitting import Fit


@pytest.mark.parametrize(
    ("at", "saved", "worthy"), [(3.0, 0.4, True), (3.0, 0.2, False), (2.9, 0.4, False), (2.9, 0.6, True)]
)
def test_an_effect_that_frees_nominal_parameters_explains_less(
    at: float, saved: float, worthy: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes one from the bound of its range, beside noise that is most of what is left."""
    before, after = (cast(Fit, SimpleNamespace(z=np.array([z]))) for z in (at, 0.1))
    left = {id(before): 1000.0, id(after): 1000.0 * (1.0 - saved)}
    monkeypatch.setattr(worth, "gained", lambda before, after: (9.5, 1000.0 * saved))
    monkeypatch.setattr(worth, "excess", lambda fit: left[id(fit)])
    monkeypatch.setattr(worth, "changes", lambda fit: [])
    monkeypatch.setattr(worth, "idle", lambda fit, sizes: False)
    monkeypatch.setattr(worth, "remaining", lambda fit: 1.0)
    monkeypatch.setattr(worth, "cancelling", lambda bare, fit, sizes: False)
    monkeypatch.setattr(worth, "refines", lambda bare, before, after: False)
    assert worth.is_worth(cast(Fit, SimpleNamespace()), before, after) == worthy
