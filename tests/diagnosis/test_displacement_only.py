"""A building of which a logger recorded the displacement, and neither velocity nor acceleration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnose import diagnose
from diagnosis.findings.logged.building import other_view, verdict_on
from diagnosis.fits import residuals
from diagnosis.fits.scales import Scales
from diagnosis.recorded.building.building import Building
from diagnosis.recorded.building.logged_building import LoggedBuilding
from diagnosis.recorded.record import Record
from models.registry import Array
from tests.diagnosis.cases import Cases, white

LEVEL = 200.0  # N
STEP = 1e-9  # m, to which the displacement was printed


def displacement_only(whole: Record) -> Record:
    """The record without the building's velocity and acceleration, with a logger's noise on its forces."""
    kept = {name: x for name, x in whole.signals.items() if name not in ("velocity", "acceleration")}
    kept["displacement"] = STEP * np.round(kept["displacement"] / STEP)
    kept["column_force"] = kept["column_force"] + LEVEL * white(31, whole.ticks)
    return replace(whole, signals=kept)


def motion(record: Record) -> Array:
    """Displacement, velocity and acceleration (ticks, 3) of a record's building."""
    return Building(record).motion


def test_central_differences_are_the_motion_of_the_explicit_newmark_method(cases: Cases) -> None:
    whole = cases.record()
    found, true = motion(displacement_only(whole)), motion(whole)
    assert np.max(np.abs(found[:, 0] - true[:, 0])) <= 0.51 * STEP
    for place, most in ((1, STEP / 0.002), (2, 2.1 * STEP / 0.002**2)):
        assert np.max(np.abs(found - true)[1:-1, place]) < most


@pytest.mark.long
@pytest.mark.parametrize("stiffer", [1.0, 1.2])
def test_a_building_is_judged_by_its_displacement_alone(cases: Cases, stiffer: float) -> None:
    effects = {"structure.stiffness": {"factor": stiffer}} if stiffer > 1.0 else {}
    record = displacement_only(cases.record(effects))
    part = Building(record)
    assert part.signals == ("displacement",)
    found = verdict_on(residuals.prepare(part, record), Scales(record), other_view(part, record, {}))
    assert isinstance(found.search.data.part, LoggedBuilding)
    assert found.effects == tuple(effects)
    if effects:
        assert found.search.chosen.values["structure.stiffness"]["factor"] == pytest.approx(stiffer, rel=0.03)
    else:
        assert found.outcome in ("none", "tolerances")


@pytest.mark.long
def test_a_whole_test_without_velocity_and_acceleration_is_diagnosed(cases: Cases) -> None:
    record = displacement_only(cases.record(duration=4.0))
    assert diagnose({"slave": record}, {})["slave"].report.status in ("no_gap", "within_tolerances")
