"""Zeros of sensors that drift by less than can be seen, which are no gap, and by more, which are an effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.findings.verdict import judge
from diagnosis.fits import residuals
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import search
from diagnosis.recorded.record import Record
from tests.diagnosis.cases import Cases, lab_a

READING = "column_force"


def warming(whole: Record, size: float) -> Record:
    """A record whose load cell warms up: its zero drifts by up to some times its noise, ever more slowly."""
    t = np.linspace(0.0, 1.0, whole.ticks)
    drift = size * whole.planned_noise[READING] * (1.0 - np.exp(-2.0 * t))
    return replace(whole, signals=whole.signals | {READING: whole.signals[READING] + drift})


@pytest.mark.long
@pytest.mark.parametrize(("size", "unseen"), [(0.35, True), (3.0, False)])
def test_a_zero_that_drifts_unseen_is_no_gap(size: float, unseen: bool, cases: Cases) -> None:
    whole = warming(cases.record(duration=12.0), size)
    verdict = judge(search(residuals.prepare(lab_a(whole), whole), Scales(whole)))
    assert verdict.drifting == ((READING,) if unseen else ())
    assert (verdict.outcome == "tolerances") == unseen
