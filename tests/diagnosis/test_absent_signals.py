"""Recordings in which signals are absent that a search would like to have."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis.diagnose import diagnose
from diagnosis.fits.laws.loop import table_of
from tests.diagnosis.cases import Cases, lab_b


@pytest.mark.long
def test_a_damper_of_which_its_force_alone_was_recorded_is_searched(cases: Cases) -> None:
    whole = cases.record({"damper.motor_lag": {"time_constant": 0.01}}, duration=4.0)
    names = ("table_command", "damper_command", "damper_force")
    signals = {name: whole.signals[name] for name in names}
    present = {name: whole.present[name] for name in names}
    found = diagnose({"slave": replace(whole, signals=signals, present=present)}, {})["slave"].report
    assert found.status in ("explained", "partly_explained", "ambiguous", "unknown_effect")
    assert {name for verdict in found.which for name in verdict.effects} & {"damper.motor_lag"}


def test_a_table_of_which_nothing_was_read_has_no_loop_that_is_looked_for(cases: Cases) -> None:
    whole = cases.record({"damper.stiffness": {"factor": 2.0}}, duration=4.0)
    names = ("table_command", "damper_command", "damper_stroke")
    signals = {name: whole.signals[name] for name in names}
    present = {name: whole.present[name] for name in names}
    assert table_of(lab_b(whole)) is not None
    assert table_of(lab_b(replace(whole, signals=signals, present=present))) is None
