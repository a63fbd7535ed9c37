"""Commands that a data logger with slower rows than its controller's ticks did not record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from common.recording.imported import IMPORT, ImportedChannel, ImportedData
from common.roles import MASTER
from diagnosis.findings.verdict import judge
from diagnosis.fits import residuals
from diagnosis.fits.scales import Scales
from diagnosis.fits.search import search
from diagnosis.recorded.logger.unseen import between_shown, shown
from diagnosis.recorded.record import Record
from models.registry import Array
from models.system import System
from tests.diagnosis.cases import Cases, imported, lab_a, white

SLOW = ImportedChannel(interpolated=True, rate=201.0)
COMMAND = "actuator_command"


def shaken(whole: Record, noise: float) -> tuple[Record, Array]:
    """A test whose controller had `noise` (m rms) in its command, which slow rows show; and what that moved."""
    part = lab_a(whole)
    plain = part.inputs[COMMAND]
    sent = plain + noise * white(5, plain.size)
    logged = imported(whole)
    stated = ImportedData("log.csv", channels={MASTER: {COMMAND: SLOW}}).metadata()
    logged = replace(logged, run=replace(logged.run, metadata=logged.run.metadata | {IMPORT: stated}))
    ticks = shown(logged, MASTER, COMMAND)
    assert ticks is not None
    seen = CubicSpline(ticks, sent[ticks])(np.arange(plain.size))
    system = System(part.lab.plan)
    moved = part.replaced(inputs=part.inputs | {COMMAND: sent}).predict(system) - part.predict(system)
    readings = {name: logged.signals[name] + moved[:, place] for place, name in enumerate(part.signals)}
    found = replace(logged, signals=logged.signals | readings | {COMMAND: seen})
    missed = part.replaced(inputs=part.inputs | {COMMAND: seen}).predict(system)
    return found, moved + part.predict(system) - missed


def test_what_was_shown_is_known_and_what_was_not_is_as_noisy() -> None:
    ticks = np.arange(0, 8000, 3)
    smooth = np.sin(0.02 * np.arange(8000.0))
    apart = between_shown(smooth + 1e-3 * white(1, 8000), ticks, 7)
    assert np.max(np.abs(apart[ticks])) < 1e-12
    assert np.sqrt(np.mean(np.square(np.delete(apart, ticks)))) == pytest.approx(1e-3 * np.sqrt(1.7), rel=0.1)
    assert np.max(np.abs(between_shown(smooth, ticks, 7))) < 1e-5
    assert np.array_equal(apart, between_shown(smooth + 1e-3 * white(1, 8000), ticks, 7))
    assert not between_shown(smooth[:9], ticks, 7).any()  # too few to tell


def test_a_part_knows_what_commands_move_that_no_row_showed(cases: Cases) -> None:
    whole = cases.record()
    found, missed = shaken(whole, 2e-5)  # far more than what the controller feeds back of its readings
    assert lab_a(found).blurred == pytest.approx(np.sqrt(np.mean(np.square(missed), axis=0)), rel=0.25)
    assert lab_a(whole).blurred == 0.0


@pytest.mark.long
def test_a_motion_that_no_row_showed_the_command_of_is_no_effect(
    cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, _ = shaken(cases.record(), 1e-5)

    def outcome() -> str:
        part = lab_a(found)
        return judge(search(residuals.prepare(part, found), Scales(found))).outcome

    assert outcome() in ("none", "tolerances")
    monkeypatch.setattr("diagnosis.recorded.logger.unseen.between_shown", lambda values, *_: 0.0 * values)
    assert outcome() == "unknown"
